"""Elaboration of expression fields to typed terms; faults are underlined in the file that holds them."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple, TypeVar

from aeros.spec.diagnostics.codes import Diagnostics, SpanLabel, did_you_mean
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.expr import terms as t
from aeros.spec.expr.doubles import double_problem
from aeros.spec.expr.parser import ExpressionSyntaxError, parse
from aeros.spec.expr.scope import ExpressionTypeError, Scope
from aeros.spec.expr.semantics import evaluate
from aeros.spec.expr.syntax import Node, TextRange
from aeros.spec.expr.typecheck.check import check, check_condition, infer
from aeros.spec.expr.types import BOOL, RealType, Type
from aeros.spec.expr.units import (
    NUMBER,
    Dimension,
    Unit,
    cure_of_bare_number,
    other_units,
    parse_quantity,
    parse_unit,
    unit_names,
)
from aeros.spec.model.rules import Conjunct
from aeros.spec.text.fields import ExpressionField, TextField
from aeros.spec.text.nodes import ScalarNode
from aeros.spec.text.scalar_positions import sub_span

_T = TypeVar("_T")


def expression_of_argument(name: str, text: str) -> ExpressionField:
    """Make an expression of a text that was given on the command line; faults are underlined in the text.

    Args:
        name: the option, which messages show in place of a file.
        text: the text.

    Returns:
        The expression.
    """
    span = Source(name, text).span(0, len(text))
    return ExpressionField(text, span, ScalarNode(text, span))


def elaborate_expression(
    expression: ExpressionField,
    scope: Scope,
    diagnostics: Diagnostics,
    expected: Type = BOOL,
    rewrite: Callable[[Node], Node] = lambda node: node,
) -> t.Term | None:
    """Elaborate an expression to a typed term.

    Args:
        expression: field of a file, with its text and position.
        scope: meaning of the names in the expression.
        diagnostics: receives the faults.
        expected: type that the term must have.
        rewrite: applied to the parsed expression before it is checked; it may raise `ExpressionTypeError`.

    Returns:
        The term, or None after reporting the fault.
    """
    return _report_errors(expression, diagnostics, lambda node: check(rewrite(node), scope, expected))


class ElaboratedCondition(NamedTuple):
    """A condition and its parts.

    The condition is false where all premises are true and all alternatives are false.

    Attributes:
        term: the whole condition.
        conjuncts: its conjuncts, or the whole where it has fewer than two.
        premises: conditions under which it requires something.
        alternatives: conditions of which it requires one.
    """

    term: t.Term
    conjuncts: tuple[Conjunct, ...]
    premises: tuple[Conjunct, ...]
    alternatives: tuple[Conjunct, ...]


def elaborate_condition(
    expression: ExpressionField, scope: Scope, diagnostics: Diagnostics
) -> ElaboratedCondition | None:
    """Elaborate a condition as `elaborate_expression` does, together with the parts that it is made of.

    Args:
        expression: field of a file, with its text and position.
        scope: meaning of the names in the expression.
        diagnostics: receives the faults.

    Returns:
        The condition with its parts, each with its position; None after reporting the fault.
    """
    checked = _report_errors(expression, diagnostics, lambda node: check_condition(node, scope))
    if checked is None:
        return None
    term, *parts = checked
    conjuncts, premises, alternatives = (
        tuple(Conjunct(one, _span(expression, extent)) for one, extent in each) for each in parts
    )
    whole = (Conjunct(term, expression.span),)
    return ElaboratedCondition(term, conjuncts if len(conjuncts) > 1 else whole, premises, alternatives)


def elaborate_constant(
    expression: ExpressionField, scope: Scope, diagnostics: Diagnostics, expected: Type
) -> Any:
    """Elaborate an expression without variables and evaluate it.

    Args:
        expression: field of a file, with its text and position.
        scope: meaning of the names; it has no variables.
        diagnostics: receives the faults.
        expected: type that the value must have.

    Returns:
        The value, numbers in SI units; None after reporting the fault.
    """
    term = elaborate_expression(expression, scope, diagnostics, expected)
    return None if term is None else evaluate(term, {})


def elaborate_number(expression: ExpressionField, scope: Scope, diagnostics: Diagnostics) -> t.Literal | None:
    """Elaborate an expression without variables to a real constant, in the dimension that its units give.

    Args:
        expression: field of a file, with its text and position.
        scope: meaning of the names; it has no variables.
        diagnostics: receives the faults.

    Returns:
        The constant in SI units with its type; None after reporting the fault.
    """
    inferred = _report_errors(expression, diagnostics, lambda node: infer(node, scope))
    if inferred is None:
        return None
    term, type_ = inferred
    value = evaluate(term, {})
    if not isinstance(type_, RealType) or not isinstance(value, Fraction):
        diagnostics.error("AE203", f"expected a number, found {type_}", expression.span, str(type_))
        return None
    return t.Literal(value, type_)


def _report_errors(
    expression: ExpressionField, diagnostics: Diagnostics, checked: Callable[[Node], _T]
) -> _T | None:
    try:
        return checked(parse(expression.value))
    except ExpressionSyntaxError as fault:
        help_ = (fault.help,) if fault.help else ()
        diagnostics.error("AE201", fault.message, _span(expression, fault.extent), help=help_)
    except ExpressionTypeError as fault:
        secondary = (
            ()
            if fault.related is None
            else (SpanLabel(_span(expression, fault.related[0]), fault.related[1]),)
        )
        diagnostics.error(
            fault.code,
            fault.message,
            _span(expression, fault.extent),
            fault.label,
            secondary=secondary,
            help=(fault.cure,) if fault.cure else (),
        )
    return None


def elaborate_unit(text: TextField | None, diagnostics: Diagnostics) -> Unit | None:
    """Elaborate the `unit` field of a quantity.

    Args:
        text: the field; None where the quantity declares no unit.
        diagnostics: receives the faults.

    Returns:
        The unit, `1` where there is no field; None after reporting that the text is not a unit.
    """
    if text is None:
        return parse_unit("1")
    unit = parse_unit(text.value)
    if unit is None:
        diagnostics.error(
            "AE207",
            f"`{text.value}` is not a unit",
            text.span,
            help=(
                f"did you mean `{near}`?"
                if (near := did_you_mean(text.value, unit_names()))
                else "write it without spaces, as in `mm/s`, `N`, `rad`, `kg*m/s^2`; `1` for a bare number",
            ),
        )
    return unit


def elaborate_quantity(text: TextField, dimension: Dimension, diagnostics: Diagnostics) -> Fraction | None:
    """Elaborate a field that holds a number with a unit, such as `250 mm`.

    Args:
        text: the field.
        dimension: dimension that the value must have.
        diagnostics: receives the faults.

    Returns:
        The value in SI units; None after reporting the fault.
    """
    parsed = parse_quantity(text.value)
    if parsed is None:
        diagnostics.error(
            "AE207",
            f"`{text.value}` is not a number with a unit",
            text.span,
            help=(_cure_of_unit(dimension),),
        )
        return None
    value, unit = parsed
    if unit.dimension != dimension:
        diagnostics.error(
            "AE204",
            f"expected a value in {dimension}, found "
            + ("a number without a unit" if unit.text == "1" else str(unit.dimension)),
            text.span,
            str(unit.dimension),
            help=(cure_of_bare_number(text.value.strip(), dimension),) if unit.text == "1" else (),
        )
        return None
    if unit.offset:
        diagnostics.error(
            "AE204",
            f"`{text.value}` is a point of a scale, and a length of it is needed here",
            text.span,
            help=("write it in K",),
        )
        return None
    lost = double_problem(value * unit.factor)
    if lost is not None:
        diagnostics.error(
            "AE207", f"`{text.value}` {lost}", text.span, help=("write 0 or a number that is nearer to 1",)
        )
        return None
    return value * unit.factor


def _cure_of_unit(dimension: Dimension) -> str:
    if dimension == NUMBER:
        return "write a bare number, or one in `%`"
    return f"write a number and its unit, as in `2 {dimension}`{other_units(dimension)}"


def _span(expression: ExpressionField, extent: TextRange) -> SourceSpan:
    """Return the position in the file of a range of the expression's text."""
    return sub_span(expression.node, extent.start, extent.end)
