"""Elaboration of declared quantities to variables with types, units and bounds."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Final

from aeros.spec.declared import site as declared
from aeros.spec.declared.perception import ModuleVariable
from aeros.spec.declared.quantity import Quantity
from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean
from aeros.spec.elaborate.expressions import elaborate_quantity, elaborate_unit
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import (
    BOOL,
    BoolType,
    EnumType,
    FamilyType,
    IntegerType,
    RealType,
    Type,
    VectorType,
)
from aeros.spec.expr.units import NUMBER, TIME, Unit, format_number
from aeros.spec.model.variables import Declared
from aeros.spec.text.fields import NumberField, TextField

Enums = Mapping[str, EnumType]
_MEMORY: Final = re.compile(r"([1-9][0-9]{0,5}) ?(MiB|GiB)")
_LEAST_SHARE: Final = Fraction(1, 100)
"""Least processor share; the kernel bounds no smaller one in its usual period."""
_TYPES = ("bool", "int", "real", "vec3")


def elaborate_variable(
    name: str, quantity: Quantity, role: t.VariableRole, enums: Enums, diagnostics: Diagnostics
) -> Declared | None:
    """Elaborate a declared quantity to a variable.

    A number or vector needs a range; other types have neither a range nor a unit.

    Args:
        name: name of the variable.
        quantity: declared type, unit and range.
        role: role of the variable: state, parameter or input.
        enums: declared enumerations by name.
        diagnostics: receives the faults.

    Returns:
        The variable with its bounds in SI units, or None after reporting the fault.
    """
    unit = elaborate_unit(quantity.unit, diagnostics)
    type_ = _type(quantity, unit, enums, diagnostics)
    if type_ is None or unit is None:
        return None
    numeric = isinstance(type_, RealType | VectorType)
    if numeric and quantity.range is None:
        diagnostics.error(
            "AE208",
            "a number needs a range: proofs cover every value inside it, and the gate denies all others",
            quantity.type.span,
            help=("add `range: [lowest, highest]`, in `unit`",),
        )
        return None
    for text, field in ((quantity.unit, "unit"), (quantity.range, "range")):
        if text is not None and not numeric:
            span = text.span if isinstance(text, TextField) else quantity.span
            diagnostics.error("AE208", f"a {type_} has no {field}", span)
            return None
    place = quantity.range[0].span.merge(quantity.range[-1].span) if quantity.range else None
    bounds = None if quantity.range is None else _range(quantity.range, unit, diagnostics)
    if bounds is not None and isinstance(type_, IntegerType) and any(end.denominator != 1 for end in bounds):
        diagnostics.error("AE208", "the range of an int ends at whole numbers", place)
        return None
    if numeric and bounds is None:
        return None
    return Declared(t.Variable(name, type_, role), quantity.span, unit, bounds, range_span=place)


def elaborate_state(
    name: str, quantity: declared.StateVariable, enums: Enums, diagnostics: Diagnostics
) -> Declared | None:
    """Elaborate a declared state variable, as a family if it has an index.

    Args:
        name: name of the variable.
        quantity: declared quantity, sensor, greatest age and index.
        enums: declared enumerations by name.
        diagnostics: receives the faults.

    Returns:
        The variable with bounds and greatest age in SI units, or None after reporting the fault.
    """
    base = elaborate_variable(name, quantity, t.VariableRole.STATE, enums, diagnostics)
    age = _max_age(quantity.max_age, diagnostics)
    if base is None or age is None:
        return None
    type_: Type = base.variable.type
    if quantity.index is not None:
        index = enums.get(quantity.index.value)
        if index is None:
            _unknown_enum(quantity.index, enums, diagnostics)
            return None
        if not isinstance(type_, BoolType | RealType):
            diagnostics.error("AE208", f"a family of {type_} is not supported", quantity.index.span)
            return None
        type_ = FamilyType(index, type_)
    variable = t.Variable(name, type_, t.VariableRole.STATE)
    return replace(base, variable=variable, span=quantity.span, max_age=age, sensor=quantity.sensor.value)


def elaborate_module_variable(
    name: str, quantity: ModuleVariable, enums: Enums, diagnostics: Diagnostics, sensor: str | None = None
) -> Declared | None:
    """Elaborate a state variable of a module.

    A number or vector that a perceiver computes needs an uncertainty; a count needs none, and a sensor's
    value has none.

    Args:
        name: full name of the variable, as in `kettle.water_hot`.
        quantity: declared quantity, greatest age and uncertainty.
        enums: enumerations of the site by name.
        diagnostics: receives the faults.
        sensor: sensor of the site that measures it; None if a perceiver or a definition does.

    Returns:
        The variable with bounds, greatest age and uncertainty in SI units; None after
        reporting the fault.
    """
    base = elaborate_variable(name, quantity, t.VariableRole.STATE, enums, diagnostics)
    age = _max_age(quantity.max_age, diagnostics)
    if base is None or age is None:
        return None
    type_, stated = base.variable.type, quantity.uncertainty
    is_number = isinstance(type_, RealType | VectorType) and not isinstance(type_, IntegerType)
    if stated is None:
        if is_number and sensor is None:
            diagnostics.error(
                "AE208",
                "a measured number needs an uncertainty: a perceiver's less certain values are unknown",
                quantity.type.span,
                help=("add `uncertainty`, with its unit, as in `uncertainty: 5 mm`",),
            )
            return None
        return replace(base, span=quantity.span, max_age=age, sensor=sensor)
    if sensor is not None:
        headline = "an uncertainty is of what a perceiver computes; a sensor does not tell its own"
        diagnostics.error("AE208", headline, stated.span, help=("remove `uncertainty`",))
        return None
    if not isinstance(type_, RealType | VectorType) or isinstance(type_, IntegerType):
        diagnostics.error("AE208", f"a {type_} has no uncertainty", stated.span)
        return None
    uncertainty = elaborate_quantity(stated, type_.dimension, diagnostics)
    if uncertainty is not None and uncertainty <= 0:
        diagnostics.error("AE208", "`uncertainty` must be above 0", stated.span)
        return None
    return (
        None
        if uncertainty is None
        else replace(base, span=quantity.span, max_age=age, uncertainty=uncertainty)
    )


def _max_age(text: TextField, diagnostics: Diagnostics) -> Fraction | None:
    """Elaborate the greatest age of a value, s."""
    age = elaborate_quantity(text, TIME, diagnostics)
    if age is not None and age <= 0:
        diagnostics.error("AE208", "`max_age` must be above 0 s", text.span)
        return None
    return age


def _type(quantity: Quantity, unit: Unit | None, enums: Enums, diagnostics: Diagnostics) -> Type | None:
    word = quantity.type.value
    if word == "bool":
        return BOOL
    if word == "int":
        if unit is not None and unit.dimension == NUMBER and unit.factor == 1:
            return IntegerType()
        diagnostics.error(
            "AE208", "an int is a bare number, without a unit", (quantity.unit or quantity.type).span
        )
        return None
    if word in ("real", "vec3"):
        if unit is None:
            return None
        return RealType(unit.dimension) if word == "real" else VectorType(unit.dimension)
    if word in enums:
        return enums[word]
    near = did_you_mean(word, [*_TYPES, *enums])
    diagnostics.error(
        "AE122",
        f"`{word}` is not a type",
        quantity.type.span,
        help=(f"did you mean `{near}`?" if near else "use `bool`, `int`, `real`, `vec3` or a declared enum",),
    )
    return None


def _unknown_enum(name: TextField, enums: Enums, diagnostics: Diagnostics) -> None:
    near = did_you_mean(name.value, enums)
    help_ = f"did you mean `{near}`?" if near else "declare it under `enums`"
    diagnostics.error("AE122", f"`{name.value}` is not a declared enum", name.span, help=(help_,))


def _range(
    numbers: tuple[NumberField, ...], unit: Unit, diagnostics: Diagnostics
) -> tuple[Fraction, Fraction] | None:
    span = numbers[0].span.merge(numbers[-1].span) if numbers else None
    if len(numbers) != 2 or numbers[0].value >= numbers[1].value:
        diagnostics.error(
            "AE208", "a range is two numbers, the lower one first", span, help=("as in `range: [0, 3]`",)
        )
        return None
    return unit.to_si(numbers[0].value), unit.to_si(numbers[1].value)


def elaborate_processor_share(text: TextField, most: Fraction, diagnostics: Diagnostics) -> Fraction | None:
    """Elaborate a share of one core.

    Args:
        text: the share, as in `50 %`.
        most: greatest share that may stand here, at most 1.
        diagnostics: receives the fault.

    Returns:
        The share; None after reporting that it is none, below 1 %, or above `most`.
    """
    share = elaborate_quantity(text, NUMBER, diagnostics)
    if share is not None and not _LEAST_SHARE <= share <= most:
        headline = f"a processor share is at least 1 % and at most {format_number(most * 100)} % here"
        diagnostics.error("AE129", headline, text.span)
        return None
    return share


def elaborate_memory(text: TextField, diagnostics: Diagnostics) -> int | None:
    """Elaborate an amount of memory.

    Args:
        text: the amount, as in `256 MiB`.
        diagnostics: receives the fault.

    Returns:
        Bytes; None after reporting that it is none.
    """
    match = _MEMORY.fullmatch(text.value)
    if match is None:
        headline = f"`{text.value}` is not an amount of memory"
        diagnostics.error("AE207", headline, text.span, help=("write it like `256 MiB` or `1 GiB`",))
        return None
    return int(match[1]) << (20 if match[2] == "MiB" else 30)
