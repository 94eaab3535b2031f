"""Expression fields → typed terms, with every fault underlined in the file it was written in."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple, TypeVar

from aeros.spec.diagnostics.codes import Diagnostics, SpanLabel
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import ExpressionSyntaxError, parse
from aeros.spec.expr.scope import ExpressionTypeError, Scope
from aeros.spec.expr.semantics import evaluate
from aeros.spec.expr.syntax import Node, TextRange
from aeros.spec.expr.typecheck import check, check_condition, infer
from aeros.spec.expr.types import BOOL, RealType, Type
from aeros.spec.expr.units import Dimension, Unit, parse_quantity, parse_unit
from aeros.spec.model.model import Conjunct
from aeros.spec.text.fields import ExpressionField, TextField
from aeros.spec.text.scalar_positions import sub_span

_T = TypeVar("_T")


def elaborate_expression(
    expression: ExpressionField, scope: Scope, sink: Diagnostics, expected: Type = BOOL
) -> t.Term | None:
    """The typed term of `expression`, or None after reporting why there is none."""
    return _report_errors(expression, sink, lambda node: check(node, scope, expected))


class ElaboratedCondition(NamedTuple):
    """A condition and its parts; it is false where all premises are true and all alternatives false."""

    term: t.Term
    conjuncts: tuple[Conjunct, ...]
    premises: tuple[Conjunct, ...]
    alternatives: tuple[Conjunct, ...]


def elaborate_condition(
    expression: ExpressionField, scope: Scope, sink: Diagnostics
) -> ElaboratedCondition | None:
    """As `elaborate_expression`, with the parts that the condition is made of."""
    found = _report_errors(expression, sink, lambda node: check_condition(node, scope))
    if found is None:
        return None
    term, *parts = found
    conjuncts, premises, alternatives = (
        tuple(Conjunct(one, _span(expression, extent)) for one, extent in each) for each in parts
    )
    whole = (Conjunct(term, expression.span),)
    return ElaboratedCondition(term, conjuncts if len(conjuncts) > 1 else whole, premises, alternatives)


def elaborate_constant(expression: ExpressionField, scope: Scope, sink: Diagnostics, expected: Type) -> Any:
    """The value of an expression under a `scope` without variables, or None after reporting why not."""
    term = elaborate_expression(expression, scope, sink, expected)
    return None if term is None else evaluate(term, {})


def elaborate_number(expression: ExpressionField, scope: Scope, sink: Diagnostics) -> t.Literal | None:
    """The real constant that `expression` is, in the dimension it is written in; `scope` has no variables."""
    found = _report_errors(expression, sink, lambda node: infer(node, scope))
    if found is None:
        return None
    term, type_ = found
    value = evaluate(term, {})
    if not isinstance(type_, RealType) or not isinstance(value, Fraction):
        sink.error("AE203", f"expected a number, found {type_}", expression.span, str(type_))
        return None
    return t.Literal(value, type_)


def _report_errors(
    expression: ExpressionField, sink: Diagnostics, checked: Callable[[Node], _T]
) -> _T | None:
    try:
        return checked(parse(expression.value))
    except ExpressionSyntaxError as fault:
        help_ = (fault.help,) if fault.help else ()
        sink.error("AE201", fault.message, _span(expression, fault.extent), help=help_)
    except ExpressionTypeError as fault:
        beside = (
            ()
            if fault.related is None
            else (SpanLabel(_span(expression, fault.related[0]), fault.related[1]),)
        )
        sink.error(
            fault.code,
            fault.message,
            _span(expression, fault.extent),
            fault.label,
            secondary=beside,
            help=(fault.cure,) if fault.cure else (),
        )
    return None


def elaborate_unit(text: TextField | None, sink: Diagnostics) -> Unit | None:
    """The unit that a `unit` field names, or None after reporting that it names none."""
    if text is None:
        return parse_unit("1")
    unit = parse_unit(text.value)
    if unit is None:
        sink.error(
            "AE207",
            f"`{text.value}` is not a unit",
            text.span,
            help=("write it without spaces, as in `mm/s`, `N`, `rad`, `kg*m/s^2`; `1` for a bare number",),
        )
    return unit


def elaborate_quantity(text: TextField, dimension: Dimension, sink: Diagnostics) -> Fraction | None:
    """The value in SI of a field like `250 mm`, or None after reporting what is wrong with it."""
    parsed = parse_quantity(text.value)
    if parsed is None:
        sink.error(
            "AE207",
            f"`{text.value}` is not a number with a unit",
            text.span,
            help=("write it like `100 ms`",),
        )
        return None
    value, unit = parsed
    if unit.dimension != dimension:
        sink.error(
            "AE204",
            f"expected a value in {dimension}, found {unit.dimension}",
            text.span,
            str(unit.dimension),
        )
        return None
    return value * unit.factor


def _span(expression: ExpressionField, extent: TextRange) -> SourceSpan:
    """Where `extent` of the expression's text stands in its file."""
    return sub_span(expression.node, extent.start, extent.end)
