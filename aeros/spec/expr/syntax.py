"""Surface syntax of the expression language: untyped nodes with offsets into the text."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from fractions import Fraction

from aeros.spec.expr.units import Unit


@dataclass(frozen=True, slots=True)
class TextRange:
    """Characters `start` (inclusive) to `end` (exclusive) of the expression's text."""

    start: int
    end: int


@dataclass(frozen=True, slots=True)
class NumberLiteral:
    """A numeral and its unit; the value is in SI."""

    value: Fraction
    unit: Unit
    extent: TextRange


@dataclass(frozen=True, slots=True)
class BooleanLiteral:
    """`true` or `false`."""

    value: bool
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Name:
    """Name that the type checker resolves."""

    text: str
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Attribute:
    """`base.name`."""

    base: Node
    name: Name
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Index:
    """`base[index]`."""

    base: Node
    index: Node
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Call:
    """`function(arguments)`."""

    function: Name
    arguments: tuple[Node, ...]
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Unary:
    """`not operand` or `-operand`."""

    op: str
    operand: Node
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Binary:
    """`left op right` for `implies`, `+`, `-`, `*`, `/`."""

    op: str
    left: Node
    right: Node
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Junction:
    """`a and b and …` or `a or b or …`."""

    op: str
    operands: tuple[Node, ...]
    extent: TextRange


@dataclass(frozen=True, slots=True)
class ComparisonChain:
    """A comparison chain, `a <= b < c`: each adjacent pair compared, all required."""

    operands: tuple[Node, ...]
    ops: tuple[str, ...]
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Membership:
    """`operand in volume` or `operand in {member, …}`, negated by `not in`."""

    operand: Node
    container: Name | tuple[Name, ...]
    negated: bool
    extent: TextRange


@dataclass(frozen=True, slots=True)
class IfElse:
    """`if condition then one else other`."""

    condition: Node
    then: Node
    otherwise: Node
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Quantifier:
    """`all(body for index in set)`, `any(…)`, `sum(…)` or `count(…)`."""

    kind: str
    body: Node
    index: Name
    set: Name
    extent: TextRange


@dataclass(frozen=True, slots=True)
class PastOperator:
    """`previously`, `once`, `historically`, `since` or `count within` of conditions, oldest operand last.

    Attributes:
        window: duration that it looks back; None to look back to the first state.
    """

    op: str
    operands: tuple[Node, ...]
    window: Node | None
    extent: TextRange


Node = (
    NumberLiteral
    | BooleanLiteral
    | Name
    | Attribute
    | Index
    | Call
    | Unary
    | Binary
    | Junction
    | ComparisonChain
    | Membership
    | IfElse
    | Quantifier
    | PastOperator
)


def children(node: Node) -> Iterator[Node]:
    """Yield the direct sub-expressions of a node.

    Args:
        node: any expression.

    Yields:
        Its operands, in the order of the fields.
    """
    for field in fields(node):
        value = getattr(node, field.name)
        if isinstance(value, Node):
            yield value
        elif isinstance(value, tuple):
            yield from (item for item in value if isinstance(item, Node))
