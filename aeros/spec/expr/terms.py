"""Typed terms: what every condition of a site or a manifest becomes, and all that back ends see.

A term is well typed by construction of `check.py`; back ends rely on it.  `semantics.py` is what
a term means; `lower.py` rewrites a term to the scalar core that the back ends compile.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from enum import Enum
from fractions import Fraction
from typing import Any, Final, get_args
from typing import Literal as OneOf

from aeros.spec.expr.types import BOOL, EnumType, FamilyType, ScalarType, Type


class VariableRole(Enum):
    """Where a variable's value comes from."""

    STATE = "state"  # measured, by vocabulary name
    PARAMETER = "parameter"  # of the action that is decided
    INPUT = "input"  # of the skill that asks, written `inputs.NAME`


@dataclass(frozen=True, slots=True)
class Literal:
    """A constant: bool, exact real in SI, or enum member."""

    value: bool | Fraction | str
    type: ScalarType


@dataclass(frozen=True, slots=True)
class Variable:
    """A free variable; `name` is unique within one vocabulary and action kind."""

    name: str
    type: Type
    role: VariableRole

    def __hash__(self) -> int:
        return hash(self.name)  # the rest seldom differs where the name does not, and takes ten times as long


@dataclass(frozen=True, slots=True)
class BoundVariable:
    """The index that a quantifier runs through its set."""

    name: str
    type: EnumType


@dataclass(frozen=True, slots=True)
class ConstantTable:
    """A constant family: one SI value for each member of its index set, in order."""

    name: str
    type: FamilyType
    values: tuple[Fraction, ...]


@dataclass(frozen=True, slots=True)
class Select:
    """`family[index]`."""

    family: Variable | ConstantTable
    index: Term


@dataclass(frozen=True, slots=True)
class Vector:
    """`vec(x, y, z)`."""

    x: Term
    y: Term
    z: Term


@dataclass(frozen=True, slots=True)
class Component:
    """`vector.x`, `.y` or `.z` as axis 0, 1 or 2."""

    vector: Term
    axis: int


@dataclass(frozen=True, slots=True)
class Not:
    """`not operand`."""

    operand: Term


@dataclass(frozen=True, slots=True)
class And:
    """Conjunction; true when empty."""

    operands: tuple[Term, ...]


@dataclass(frozen=True, slots=True)
class Or:
    """Disjunction; false when empty."""

    operands: tuple[Term, ...]


@dataclass(frozen=True, slots=True)
class Implies:
    """`premise implies conclusion`."""

    premise: Term
    conclusion: Term


@dataclass(frozen=True, slots=True)
class Compare:
    """`left op right`: order on reals; equality on reals, booleans, enum members and vectors."""

    op: OneOf["<", "<=", "=="]
    left: Term
    right: Term


@dataclass(frozen=True, slots=True)
class Add:
    """Sum of two reals or two vectors."""

    left: Term
    right: Term


@dataclass(frozen=True, slots=True)
class Multiply:
    """Product of two reals, or of a real and a vector, the vector on the right."""

    left: Term
    right: Term


@dataclass(frozen=True, slots=True)
class Extremum:
    """`min(a, b)` or `max(a, b)` of two reals."""

    kind: OneOf["min", "max"]
    left: Term
    right: Term


@dataclass(frozen=True, slots=True)
class Absolute:
    """`abs(operand)` of a real."""

    operand: Term


@dataclass(frozen=True, slots=True)
class Conditional:
    """`if condition then one else other`, both of one type."""

    condition: Term
    then: Term
    otherwise: Term


@dataclass(frozen=True, slots=True)
class Quantified:
    """`all(body for index in SET)` or `any(body for index in SET)` over a finite set."""

    kind: OneOf["all", "any"]
    index: BoundVariable
    body: Term


@dataclass(frozen=True, slots=True)
class Aggregate:
    """`sum(body for index in SET)` of reals, or `count(body for index in SET)`: how many conditions hold."""

    kind: OneOf["sum", "count"]
    index: BoundVariable
    body: Term


@dataclass(frozen=True, slots=True)
class Previously:
    """Whether `operand` held at the moment before; false at the first."""

    operand: Term


@dataclass(frozen=True, slots=True)
class Since:
    """Whether `trigger` held at some moment, at most `window_s` seconds ago, and `kept` at each one after it.

    within: None where it may be any time ago.  `once c` is `true since c`, and `historically c` is
    `not once not c`.
    """

    sustained: Term
    trigger: Term
    window_s: Fraction | None


@dataclass(frozen=True, slots=True)
class Occurrences:
    """At how many moments, at most `window_s` seconds ago, `operand` held."""

    operand: Term
    window_s: Fraction


PastTerm = Previously | Since | Occurrences
"""What depends on moments before the present one."""

Term = (
    Literal
    | Variable
    | BoundVariable
    | ConstantTable
    | Select
    | Vector
    | Component
    | Not
    | And
    | Or
    | Implies
    | Compare
    | Add
    | Multiply
    | Extremum
    | Absolute
    | Conditional
    | Quantified
    | Aggregate
    | Previously
    | Since
    | Occurrences
)

TRUE = Literal(True, BOOL)
FALSE = Literal(False, BOOL)


def children(term: Term) -> Iterator[Term]:
    """The direct sub-terms of `term`."""
    for name in _FIELDS[type(term)]:
        value = getattr(term, name)
        if type(value) in _KINDS:
            yield value
        elif type(value) is tuple:
            yield from (item for item in value if type(item) in _KINDS)


_KINDS: Final = frozenset(get_args(Term))
_FIELDS: Final = {kind: tuple(field.name for field in fields(kind)) for kind in _KINDS}


def variables_of(term: Term) -> dict[str, Variable]:
    """Every free variable of `term` by name, in order of first occurrence."""
    while isinstance(term, Not):  # most are asked about before and after they are negated
        term = term.operand
    known = _FREE_VARIABLES_CACHE.get(id(term))
    if known is None:
        if len(_FREE_VARIABLES_CACHE) >= 4096:
            _FREE_VARIABLES_CACHE.clear()
        known = _FREE_VARIABLES_CACHE[id(term)] = (term, _variables_of(term))
    return dict(known[1])


_FREE_VARIABLES_CACHE: Final[dict[int, tuple[Term, dict[str, Variable]]]] = {}
"""By identity, as comparing terms costs as much as walking them; each is held, so that it stays itself."""


def _variables_of(term: Term) -> dict[str, Variable]:
    found: dict[str, Variable] = {}
    pending = [term]
    while pending:
        current = pending.pop()
        if isinstance(current, Variable):
            found.setdefault(current.name, current)
            continue
        if isinstance(current, Literal):
            continue
        pending.extend(reversed(list(children(current))))
    return found


def substitute(term: Term, replacements: Mapping[str, Term]) -> Term:
    """`term` with each free variable and outer index that `replacements` names replaced by its term."""
    if isinstance(term, Variable | BoundVariable):
        return replacements.get(term.name, term)
    changed: dict[str, Any] = {}
    for field in fields(term):
        value = getattr(term, field.name)
        if isinstance(value, Term):
            changed[field.name] = substitute(value, replacements)
        elif isinstance(value, tuple) and value and isinstance(value[0], Term):
            changed[field.name] = tuple(substitute(part, replacements) for part in value)
    return replace(term, **changed)


def conjunction(*terms: Term) -> Term:
    """The conjunction of `terms`, without needless nesting."""
    flat: list[Term] = []
    for term in terms:
        flat.extend(term.operands if isinstance(term, And) else (term,))
    kept = tuple(term for term in flat if term != TRUE)
    return kept[0] if len(kept) == 1 else And(kept)
