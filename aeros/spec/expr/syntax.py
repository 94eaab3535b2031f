"""Surface syntax of the expression language: untyped nodes with offsets into the text."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from fractions import Fraction

from aeros.spec.expr.units import Unit


@dataclass(frozen=True, slots=True)
class TextRange:
    """Range of characters of the expression's text.

    Attributes:
        start: index of the first character.
        end: index after the last one.
    """

    start: int
    end: int


@dataclass(frozen=True, slots=True)
class NumberLiteral:
    """A numeral and its unit.

    Attributes:
        value: the value in SI.
        unit: the unit as written.
        extent: its place in the text.
    """

    value: Fraction
    unit: Unit
    extent: TextRange


@dataclass(frozen=True, slots=True)
class BooleanLiteral:
    """`true` or `false`.

    Attributes:
        value: the truth value.
        extent: its place in the text.
    """

    value: bool
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Name:
    """Name that the type checker resolves.

    Attributes:
        text: the name as written.
        extent: its place in the text.
    """

    text: str
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Attribute:
    """`base.name`.

    Attributes:
        base: expression before the dot.
        name: name after the dot.
        extent: its place in the text.
    """

    base: Node
    name: Name
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Index:
    """`base[index]`.

    Attributes:
        base: expression before the bracket.
        index: expression inside the brackets.
        extent: its place in the text.
    """

    base: Node
    index: Node
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Call:
    """`function(arguments)`.

    Attributes:
        function: name of the function.
        arguments: expressions in the parentheses, in order.
        extent: its place in the text.
    """

    function: Name
    arguments: tuple[Node, ...]
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Unary:
    """`not operand` or `-operand`.

    Attributes:
        op: `not` or `-`.
        operand: expression after it.
        extent: its place in the text.
    """

    op: str
    operand: Node
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Binary:
    """`left op right`.

    Attributes:
        op: `implies`, `+`, `-`, `*` or `/`.
        left: expression before the operator.
        right: expression after it.
        extent: its place in the text.
    """

    op: str
    left: Node
    right: Node
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Junction:
    """`a and b and …` or `a or b or …`.

    Attributes:
        op: `and` or `or`.
        operands: at least two expressions, in order.
        extent: its place in the text.
    """

    op: str
    operands: tuple[Node, ...]
    extent: TextRange


@dataclass(frozen=True, slots=True)
class ComparisonChain:
    """A comparison chain, `a <= b < c`: each adjacent pair compared, all required.

    Attributes:
        operands: the compared expressions, in order.
        ops: comparison operators between them, one fewer than `operands`.
        extent: its place in the text.
    """

    operands: tuple[Node, ...]
    ops: tuple[str, ...]
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Membership:
    """`operand in volume` or `operand in {member, …}`, negated by `not in`.

    Attributes:
        operand: expression before `in`.
        container: name of a volume, or the members of a set.
        negated: True for `not in`.
        extent: its place in the text.
    """

    operand: Node
    container: Name | tuple[Name, ...]
    negated: bool
    extent: TextRange


@dataclass(frozen=True, slots=True)
class IfElse:
    """`if condition then one else other`.

    Attributes:
        condition: the condition.
        then: value if it holds.
        otherwise: value if it does not.
        extent: its place in the text.
    """

    condition: Node
    then: Node
    otherwise: Node
    extent: TextRange


@dataclass(frozen=True, slots=True)
class Quantifier:
    """`all(body for index in set)`, `any(…)`, `sum(…)` or `count(…)`.

    Attributes:
        kind: `all`, `any`, `sum` or `count`.
        body: expression that is evaluated for each member.
        index: name of the index.
        set: name of the enumeration over which it ranges.
        extent: its place in the text.
    """

    kind: str
    body: Node
    index: Name
    set: Name
    extent: TextRange


@dataclass(frozen=True, slots=True)
class PastOperator:
    """`previously`, `once`, `historically`, `since` or `count within` of conditions, oldest operand last.

    Attributes:
        op: name of the operator.
        operands: conditions it applies to.
        window: duration that it looks back; None to look back to the first state.
        extent: its place in the text.
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
