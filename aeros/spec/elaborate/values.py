"""Elaboration of the values that a module gives: constants of a variable's type, inside its range."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.expressions import elaborate_constant, expression_of_argument
from aeros.spec.elaborate.names import resolve_need
from aeros.spec.elaborate.scopes import constant_scope
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.types import EnumType, IntegerType, RealType, VectorType
from aeros.spec.expr.units import NUMBER, format_quantity
from aeros.spec.model.ecm import VERDICT_VALUE
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.text.fields import ExpressionField, MappingField, TextField


def elaborate_value(
    expression: ExpressionField, variable: Declared, site: Site, diagnostics: Diagnostics
) -> Any:
    """Elaborate the value that a variable gets.

    Args:
        expression: constant expression, with its position in the file.
        variable: declaration of the variable, with its range in SI units.
        site: site whose constants and enums the expression may use.
        diagnostics: receives the faults.

    Returns:
        The value, numbers in SI units; None after reporting that there is none. A value outside the range is
        reported, too.
    """
    value = elaborate_constant(expression, constant_scope(site), diagnostics, variable.variable.type)
    if value is not None and variable.range is not None:
        low, high = variable.range
        components = value if isinstance(value, tuple) else (value,)
        if not all(low <= component <= high for component in components):
            bounds = " to ".join(format_quantity(one, variable.unit) for one in variable.range)
            headline = f"this value is outside the declared range, {bounds}"
            diagnostics.error("AE111", headline, expression.span)
    return value


def elaborate_state_values(
    entries: MappingField[ExpressionField], site: Site, diagnostics: Diagnostics
) -> dict[str, Any]:
    """Elaborate the values that state variables are set to.

    Args:
        entries: constant expressions by state variable.
        site: site that declares the state variables, by the names that the module uses.
        diagnostics: receives the faults.

    Returns:
        Value of each of them that is declared, by full name, numbers in SI units; None for a faulty one.
    """
    values: dict[str, Any] = {}
    for name, expression in entries:
        variable = resolve_need(name, site.state, "variable", diagnostics)
        if variable is not None:
            values[variable.name] = elaborate_value(expression, variable, site, diagnostics)
    return values


def elaborate_verdict(text: TextField, site: Site, diagnostics: Diagnostics) -> str:
    """Elaborate the text of a verdict, in which braces enclose the names of state variables.

    Args:
        text: as in `out of reach at {object_position}`.
        site: site that declares the state variables, by the names that the module uses.
        diagnostics: receives the faults.

    Returns:
        The text with the full name and the SI unit of each in the braces.
    """

    def full_name(name: re.Match[str]) -> str:
        variable = resolve_need(replace(text, value=name[1]), site.state, "variable", diagnostics)
        if variable is None:
            return ""
        type_ = variable.variable.type
        unit = str(type_.dimension) if isinstance(type_, RealType | VectorType) else ""
        return f"{{{variable.name} {unit}}}" if unit not in ("", str(NUMBER)) else f"{{{variable.name}}}"

    return VERDICT_VALUE.sub(full_name, text.value)


def value_of_argument(text: str, variable: Declared) -> Any:
    """Read the value that a person gives to a variable, as in `left`, `2` or `5 cm`.

    Args:
        text: what the person wrote.
        variable: declaration of the variable.

    Returns:
        The value, numbers in SI units; None if the text is no value of this type and range.
    """
    type_ = variable.variable.type
    enums = {type_.name: type_} if isinstance(type_, EnumType) else {}
    faults = Diagnostics()
    expression = expression_of_argument(variable.name, text)
    value = elaborate_constant(expression, Scope({}, {}, {}, enums), faults, type_)
    if value is None or (isinstance(type_, IntegerType) and value.denominator != 1):
        return None
    if variable.range is not None and not variable.range[0] <= value <= variable.range[1]:
        return None
    return value
