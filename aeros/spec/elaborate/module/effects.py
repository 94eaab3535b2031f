"""Elaboration of the effects of outcomes: values, increments of whole numbers, and ranges of quantities."""

from __future__ import annotations

import re
from dataclasses import replace
from fractions import Fraction
from typing import Any, Final

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.expressions import elaborate_constant
from aeros.spec.elaborate.names import resolve_need
from aeros.spec.elaborate.scopes import constant_scope
from aeros.spec.elaborate.values import elaborate_value
from aeros.spec.expr.effects import Increment, QuantityRange
from aeros.spec.expr.types import FamilyType, IntegerType, RealType, VectorType
from aeros.spec.expr.units import format_quantity
from aeros.spec.model.site import Site
from aeros.spec.model.task_parameters import is_parameter
from aeros.spec.model.variables import Declared
from aeros.spec.text.fields import ExpressionField, MappingField, TextField
from aeros.spec.text.nodes import ScalarNode
from aeros.spec.text.scalar_positions import sub_span

MAX_COUNT: Final = 64
"""Greatest number of values of a whole number that outcomes increment."""

_INCREMENT: Final = re.compile(r"\s*([+-])=(.*)", re.DOTALL)
_RANGE: Final = re.compile(r"\s*in\s*\[(.*?),(.*?)\]\s*", re.DOTALL)


def elaborate_effects(
    entries: MappingField[ExpressionField], site: Site, diagnostics: Diagnostics
) -> tuple[dict[str, Any], tuple[QuantityRange, ...]]:
    """Elaborate the effects of an outcome.

    Args:
        entries: effects by state variable, or by component of one.
        site: site that declares the state variables, by the names that the module uses.
        diagnostics: receives the faults.

    Returns:
        Value or increment by the full name of the variable, None for a faulty one; and the ranges.
    """
    found = _Effects(site, diagnostics)
    for name, expression in entries:
        found.add(name, expression)
    return found.effects, tuple(found.ranges)


class _Effects:
    """Effects of one outcome, elaborated one after the other."""

    def __init__(self, site: Site, diagnostics: Diagnostics) -> None:
        self._site, self._diagnostics = site, diagnostics
        self.effects: dict[str, Any] = {}
        self.ranges: list[QuantityRange] = []

    def add(self, name: TextField, expression: ExpressionField) -> None:
        whole, _, last = name.value.rpartition(".")
        axis = "xyz".index(last) if last in ("x", "y", "z") and name.value not in self._site.state else None
        named = name if axis is None else replace(name, value=whole)
        variable = resolve_need(named, self._site.state, "variable", self._diagnostics)
        if variable is None:
            return
        type_ = variable.variable.type
        if is_parameter(variable):
            headline = f"no skill changes `{name.value}`: it is what an instruction says"
            self._diagnostics.error("AE203", headline, name.span)
        elif _RANGE.fullmatch(expression.value):
            self._add_range(name, expression, variable, axis)
        elif isinstance(type_, FamilyType | VectorType):
            self._diagnostics.error(
                "AE203",
                f"an effect on a {type_} cannot be declared",
                name.span,
                help=("state a range of a component, as in `position.y: in [380 mm, 420 mm]`",)
                if isinstance(type_, VectorType)
                else (),
            )
        elif axis is not None:
            self._diagnostics.error("AE203", f"`{whole}` is a {type_}, which has no components", name.span)
        elif _INCREMENT.match(expression.value):
            self._add_increment(name, expression, variable)
        else:
            value = elaborate_value(expression, variable, self._site, self._diagnostics)
            self.effects[variable.name] = value

    def _add_increment(self, name: TextField, expression: ExpressionField, variable: Declared) -> None:
        bounds = variable.range
        if not isinstance(variable.variable.type, IntegerType) or bounds is None:
            self._diagnostics.error(
                "AE203",
                f"only a whole number with a range is incremented, and `{name.value}` is none",
                name.span,
                help=("of a quantity, declare the range after the outcome, as in `in [1 l, 2 l]`",),
            )
            return
        if bounds[1] - bounds[0] >= MAX_COUNT:
            headline = f"`{name.value}` has more than {MAX_COUNT} values, so plans cannot list them"
            self._diagnostics.error("AE111", headline, name.span)
            return
        match = _INCREMENT.match(expression.value)
        assert match is not None  # noqa: S101  for the type checker
        amount = self._number(_part(expression, *match.span(2)), variable)
        if amount is not None and (amount.denominator != 1 or amount <= 0):
            headline = "an increment is a whole number above 0"
            self._diagnostics.error("AE111", headline, expression.span)
        elif amount is not None:
            self.effects[variable.name] = Increment(amount if match[1] == "+" else -amount)

    def _add_range(
        self, name: TextField, expression: ExpressionField, variable: Declared, axis: int | None
    ) -> None:
        type_ = variable.variable.type
        is_quantity = isinstance(type_, VectorType) if axis is not None else isinstance(type_, RealType)
        if isinstance(type_, IntegerType) or not is_quantity:
            self._diagnostics.error(
                "AE203",
                f"a range is of a real number, or of a component of a vector, and `{name.value}` is none",
                name.span,
            )
            return
        match = _RANGE.fullmatch(expression.value)
        assert match is not None  # noqa: S101  for the type checker
        low, high = (self._number(_part(expression, *match.span(side)), variable) for side in (1, 2))
        if low is None or high is None:
            return
        bounds = variable.range
        if low > high:
            self._diagnostics.error("AE111", "the lower bound is above the upper bound", expression.span)
        elif bounds is not None and not (bounds[0] <= low and high <= bounds[1]):
            text = " to ".join(format_quantity(one, variable.unit) for one in bounds)
            headline = f"this range is not inside the declared range, {text}"
            self._diagnostics.error("AE111", headline, expression.span)
        else:
            self.ranges.append(QuantityRange(variable.name, axis, low, high))

    def _number(self, expression: ExpressionField, variable: Declared) -> Fraction | None:
        """Evaluate a number in the dimension of a variable; None after reporting its fault."""
        type_ = variable.variable.type
        expected = RealType(type_.dimension) if isinstance(type_, VectorType) else type_
        scope = constant_scope(self._site)
        value = elaborate_constant(expression, scope, self._diagnostics, expected)
        return None if value is None else Fraction(value)


def _part(expression: ExpressionField, start: int, end: int) -> ExpressionField:
    """Return a part of an expression's text as an expression, whose faults are underlined in the file."""
    text = expression.value[start:end]
    left = start + len(text) - len(text.lstrip())
    span = sub_span(expression.node, left, start + len(text.rstrip()))
    return ExpressionField(text.strip(), span, ScalarNode(text.strip(), span))
