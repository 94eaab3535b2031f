"""Conditions as text: reading the numbers in them and replacing these by others."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from fractions import Fraction

from aeros.spec.expr import syntax as s
from aeros.spec.expr.parser import parse
from aeros.spec.expr.units import NUMBER, Unit, to_unit
from aeros.spec.model.variables import Declared

_NUMERAL = re.compile(r"-?\s*[0-9.]+(?:[eE][-+]?[0-9]+)?")


def comparisons_in(node: s.Node) -> Iterator[tuple[s.Node, s.Node, str]]:
    """Yield each comparison of two values that makes a condition stricter if it is stricter itself.

    These stand outside of negations, premises and alternatives, as `a <= 1` does in `near implies a <= 1`.

    Args:
        node: syntax tree of the condition.

    Yields:
        Left operand, right operand and comparison operator.
    """
    if isinstance(node, s.Junction) and node.op == "and":
        for operand in node.operands:
            yield from comparisons_in(operand)
    elif isinstance(node, s.Binary) and node.op == "implies":
        yield from comparisons_in(node.right)
    elif isinstance(node, s.IfElse):
        yield from comparisons_in(node.then)
        yield from comparisons_in(node.otherwise)
    elif isinstance(node, s.ComparisonChain):
        yield from zip(node.operands, node.operands[1:], node.ops, strict=False)


def branches_of(node: s.Node) -> Iterator[s.Node]:
    """Yield the values that an operand may have, such as both numbers of `if near then 1 m/s else 2 m/s`.

    Args:
        node: syntax tree of the operand.

    Yields:
        The operand itself, unless it is a choice by `if`; then the values of all its branches.
    """
    if isinstance(node, s.IfElse):
        yield from branches_of(node.then)
        yield from branches_of(node.otherwise)
    else:
        yield node


def read_number(node: s.Node) -> tuple[Fraction, Unit] | None:
    """Read a number, with or without a minus sign.

    Args:
        node: syntax tree of an operand.

    Returns:
        The value in the unit it is written in, and that unit; None if the node is not a number.
    """
    if isinstance(node, s.Unary) and node.op == "-" and isinstance(node.operand, s.NumberLiteral):
        return -to_unit(node.operand.value, node.operand.unit), node.operand.unit
    return (to_unit(node.value, node.unit), node.unit) if isinstance(node, s.NumberLiteral) else None


def count_decimals(numeral: str) -> int:
    """Count the digits after the decimal point.

    Args:
        numeral: a number as it is written.

    Returns:
        The number of digits.
    """
    match = re.search(r"\.([0-9]+)", numeral)
    return len(match[1]) if match else 0


def replace_number(
    text: str, literal: s.TextRange, between: tuple[int, int] | None, op: str
) -> Callable[[str, bool], str | None]:
    """Prepare a text for the replacement of one of its numbers.

    Args:
        text: text of the condition.
        literal: range of the number in the text.
        between: offsets of the start and end of the text between the operands, which holds the operator; None
            if the operator has to stay.
        op: the comparison operator.

    Returns:
        A function from a numeral, and whether the bound itself is excluded, to the edited text; to None if it
        is to be excluded and the operator has to stay.
    """

    def edit(value: str, excluded: bool) -> str | None:
        if excluded and between is None:
            return None
        written = _NUMERAL.sub(value, text[literal.start : literal.end], count=1)
        edits = [(literal.start, literal.end, written)]
        if excluded and between is not None:
            edits.append((*between, text[slice(*between)].replace(op, op[0])))
        edited = text
        for start, end, new in sorted(edits, reverse=True):
            edited = edited[:start] + new + edited[end:]
        return edited

    return edit


def add_bound(text: str, name: str, upper: bool, unit: Unit) -> Callable[[str, bool], str]:
    """Prepare a text for an additional bound.

    Args:
        text: text of the condition.
        name: variable to be bounded.
        upper: True for a bound from above.
        unit: unit in which the bound is written.

    Returns:
        A function from a numeral, and whether the bound itself is excluded, to the edited text.
    """

    def edit(value: str, excluded: bool) -> str:
        op = ("<" if upper else ">") + ("" if excluded else "=")
        quantity = value if unit.dimension == NUMBER and unit.text == "1" else f"{value} {unit.text}"
        return conjoin_texts(text, f"{name} {op} {quantity}")

    return edit


def conjoin_texts(text: str, condition: str) -> str:
    """Write the conjunction of two conditions.

    Args:
        text: text of a condition.
        condition: text of another condition.

    Returns:
        The text, with parentheses where they are needed.
    """
    parts = [part.strip() for part in (text, condition) if part.strip() != "true"]
    return parts[0] if len(parts) == 1 else " and ".join(map(_parenthesize, parts))


def is_conditional(node: s.Node) -> bool:
    """Tell if a condition requires something in some cases only.

    Args:
        node: syntax tree of the condition.

    Returns:
        True for an implication, a choice by `if`, and alternatives.
    """
    is_implication = isinstance(node, s.Binary) and node.op == "implies"
    return is_implication or isinstance(node, s.IfElse) or (isinstance(node, s.Junction) and node.op == "or")


def _parenthesize(text: str) -> str:
    node, written = parse(text), text.strip()
    loose = (
        isinstance(node, s.IfElse)
        or (isinstance(node, s.Junction) and node.op == "or")
        or (isinstance(node, s.Binary) and node.op == "implies")
    )
    is_closed = node.extent.start > text.index(written)  # a node does not include the parentheses around it
    return f"({written})" if loose and not is_closed else written


def unit_used_for(variable: Declared, *texts: str) -> Unit:
    """Find the unit in which texts give values of a variable's dimension.

    Args:
        variable: declaration of the variable.
        texts: texts of conditions, searched in order.

    Returns:
        The unit of the first such number, or else that of the declaration.
    """
    for text in texts:
        pending: list[s.Node] = [parse(text)]
        while pending:
            node = pending.pop(0)
            pending.extend(s.children(node))
            if isinstance(node, s.NumberLiteral) and node.unit.dimension == variable.unit.dimension:
                return node.unit
    return variable.unit
