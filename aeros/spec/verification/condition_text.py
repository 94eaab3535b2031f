"""Conditions as text: the numbers that stand in them, and how to put others in their place."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from fractions import Fraction

from aeros.spec.expr import syntax as s
from aeros.spec.expr.parser import parse
from aeros.spec.expr.units import NUMBER, Unit
from aeros.spec.model.model import Declared

_NUMERAL = re.compile(r"-?\s*[0-9.]+(?:[eE][-+]?[0-9]+)?")


def comparisons_in(node: s.Node) -> Iterator[tuple[s.Node, s.Node, str]]:
    """Each comparison of two values among the conjuncts of `node`."""
    if isinstance(node, s.Junction) and node.op == "and":
        for operand in node.operands:
            yield from comparisons_in(operand)
    elif isinstance(node, s.ComparisonChain):
        yield from zip(node.operands, node.operands[1:], node.ops, strict=False)


def read_number(node: s.Node) -> tuple[Fraction, Unit] | None:
    """The value in the unit it is written in, and that unit, if `node` is a number."""
    if isinstance(node, s.Unary) and node.op == "-" and isinstance(node.operand, s.NumberLiteral):
        return -node.operand.value / node.operand.unit.factor, node.operand.unit
    return (node.value / node.unit.factor, node.unit) if isinstance(node, s.NumberLiteral) else None


def count_decimals(numeral: str) -> int:
    """How many digits are written after the point."""
    found = re.search(r"\.([0-9]+)", numeral)
    return len(found[1]) if found else 0


def replace_number(
    text: str, literal: s.TextRange, between: tuple[int, int], op: str
) -> Callable[[str, bool], str]:
    """`text` with another number at `literal`, and a strict comparison `between` if that is asked for."""

    def put(value: str, excluded: bool) -> str:
        written = _NUMERAL.sub(value, text[literal.start : literal.end], count=1)
        edits = [(literal.start, literal.end, written)]
        if excluded:
            edits.append((*between, text[slice(*between)].replace(op, op[0])))
        edited = text
        for start, end, new in sorted(edits, reverse=True):
            edited = edited[:start] + new + edited[end:]
        return edited

    return put


def add_bound(text: str, name: str, upper: bool, unit: Unit) -> Callable[[str, bool], str]:
    """`text` and a bound on `name`, from above or below, itself excluded if that is asked for."""

    def put(value: str, excluded: bool) -> str:
        op = ("<" if upper else ">") + ("" if excluded else "=")
        quantity = value if unit.dimension == NUMBER and unit.text == "1" else f"{value} {unit.text}"
        return conjoin_texts(text, f"{name} {op} {quantity}")

    return put


def conjoin_texts(text: str, condition: str) -> str:
    """The text of the conjunction of two conditions."""
    return " and ".join(_parenthesize(part) for part in (text, condition) if part.strip() != "true")


def _parenthesize(text: str) -> str:
    node, written = parse(text), text.strip()
    loose = (
        isinstance(node, s.IfElse)
        or (isinstance(node, s.Junction) and node.op == "or")
        or (isinstance(node, s.Binary) and node.op == "implies")
    )
    is_closed = node.extent.start > text.index(written)  # brackets are no part of what they enclose
    return f"({written})" if loose and not is_closed else written


def unit_used_for(variable: Declared, *texts: str) -> Unit:
    """The unit in which the texts give values of this dimension, or else that of the declaration."""
    for text in texts:
        pending: list[s.Node] = [parse(text)]
        while pending:
            node = pending.pop(0)
            pending.extend(s.children(node))
            if isinstance(node, s.NumberLiteral) and node.unit.dimension == variable.unit.dimension:
                return node.unit
    return variable.unit
