"""Typed terms: the form of every condition of a site or a manifest, and the input of all back ends.

`typecheck.py` builds only well-typed terms, and back ends rely on it. `semantics.py` defines their meaning.
`lower.py` rewrites a term to the scalar core, which back ends compile.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from enum import Enum
from fractions import Fraction
from typing import Any, Final, cast, get_args
from typing import Literal as OneOf

from aeros.spec.expr.types import BOOL, EnumType, FamilyType, ScalarType, Type


class VariableRole(Enum):
    """Source of a variable's value."""

    STATE = "state"  # measured, by vocabulary name
    PARAMETER = "parameter"  # of the action that is decided
    INPUT = "input"  # of the skill that asks, written `inputs.NAME`


@dataclass(frozen=True, slots=True)
class Literal:
    """Constant.

    Attributes:
        value: truth value, exact real in SI, or name of an enum member.
        type: type of the value.
    """

    value: bool | Fraction | str
    type: ScalarType


@dataclass(frozen=True, slots=True)
class Variable:
    """Free variable.

    Attributes:
        name: name, unique within one vocabulary and action kind.
        type: its type.
        role: source of its value, such as the measured state or a parameter of the action.
    """

    name: str
    type: Type
    role: VariableRole

    def __hash__(self) -> int:
        return hash(
            self.name
        )  # equal names seldom differ in the rest, and hashing it too takes ten times as long


@dataclass(frozen=True, slots=True)
class BoundVariable:
    """Index of a quantifier, which takes each member of its set.

    Attributes:
        name: name of the index.
        type: the set, whose members it takes.
    """

    name: str
    type: EnumType


@dataclass(frozen=True, slots=True)
class ConstantTable:
    """Constant family.

    Attributes:
        name: name of the constant.
        type: its index set, and the type of its values.
        values: one value for each member of the index set, in order, SI.
    """

    name: str
    type: FamilyType
    values: tuple[Fraction, ...]


@dataclass(frozen=True, slots=True)
class Select:
    """`family[index]`.

    Attributes:
        family: family to select from.
        index: term of the family's index type.
    """

    family: Variable | ConstantTable
    index: Term

    @property
    def family_type(self) -> FamilyType:
        """Type of the family."""
        return cast("FamilyType", self.family.type)

    @property
    def members(self) -> tuple[str, ...]:
        """Members of the enum that indexes the family, in order."""
        return self.family_type.index.members


@dataclass(frozen=True, slots=True)
class Vector:
    """`vec(x, y, z)`.

    Attributes:
        x, y, z: components, reals of one dimension.
    """

    x: Term
    y: Term
    z: Term


@dataclass(frozen=True, slots=True)
class Component:
    """Component of a vector: `vector.x`, `.y` or `.z`.

    Attributes:
        vector: the vector.
        axis: 0 for x, 1 for y, 2 for z.
    """

    vector: Term
    axis: int


@dataclass(frozen=True, slots=True)
class Not:
    """`not operand`.

    Attributes:
        operand: a condition.
    """

    operand: Term


@dataclass(frozen=True, slots=True)
class And:
    """Conjunction. True if it has no operands.

    Attributes:
        operands: conditions.
    """

    operands: tuple[Term, ...]


@dataclass(frozen=True, slots=True)
class Or:
    """Disjunction. False if it has no operands.

    Attributes:
        operands: conditions.
    """

    operands: tuple[Term, ...]


@dataclass(frozen=True, slots=True)
class Implies:
    """`premise implies conclusion`.

    Attributes:
        premise: a condition.
        conclusion: a condition.
    """

    premise: Term
    conclusion: Term


@dataclass(frozen=True, slots=True)
class Compare:
    """Comparison `left op right`.

    Attributes:
        op: `<` or `<=`, of reals; `==`, of reals, booleans, enum members and vectors.
        left: term on the left.
        right: term on the right, of the same type.
    """

    op: OneOf["<", "<=", "=="]
    left: Term
    right: Term


@dataclass(frozen=True, slots=True)
class Add:
    """Sum of two reals or two vectors.

    Attributes:
        left: first summand.
        right: second summand, of the same type.
    """

    left: Term
    right: Term


@dataclass(frozen=True, slots=True)
class Multiply:
    """Product of two reals, or of a real and a vector.

    Attributes:
        left: first factor, a real.
        right: second factor, a real or a vector.
    """

    left: Term
    right: Term


@dataclass(frozen=True, slots=True)
class Extremum:
    """`min(a, b)` or `max(a, b)` of two reals.

    Attributes:
        kind: `min` or `max`.
        left: first real.
        right: second real, of the same dimension.
    """

    kind: OneOf["min", "max"]
    left: Term
    right: Term


@dataclass(frozen=True, slots=True)
class Absolute:
    """`abs(operand)` of a real.

    Attributes:
        operand: a real.
    """

    operand: Term


@dataclass(frozen=True, slots=True)
class Conditional:
    """`if condition then one else other`, both of one type.

    Attributes:
        condition: the condition.
        then: value if it holds.
        otherwise: value if it does not.
    """

    condition: Term
    then: Term
    otherwise: Term


@dataclass(frozen=True, slots=True)
class Quantified:
    """`all(body for index in SET)` or `any(body for index in SET)` over a finite set.

    Attributes:
        kind: `all` or `any`.
        index: the index that `body` reads.
        body: condition that is evaluated for each member.
    """

    kind: OneOf["all", "any"]
    index: BoundVariable
    body: Term


@dataclass(frozen=True, slots=True)
class Aggregate:
    """`sum(body for index in SET)` of reals, or `count(body for index in SET)`: how many conditions hold.

    Attributes:
        kind: `sum` or `count`.
        index: the index that `body` reads.
        body: term that is evaluated for each member: a real for `sum`, a condition for `count`.
    """

    kind: OneOf["sum", "count"]
    index: BoundVariable
    body: Term


@dataclass(frozen=True, slots=True)
class Previously:
    """True if `operand` held in the previous state; false in the first state.

    Attributes:
        operand: a condition.
    """

    operand: Term


@dataclass(frozen=True, slots=True)
class Since:
    """`trigger` held in some state, and `sustained` held in every later state up to the present one.

    `once c` is `true since c`, and `historically c` is `not once not c`.

    Attributes:
        sustained: condition that must have held since then.
        trigger: condition that held in some state.
        window_s: greatest age in seconds of the state in which `trigger` held; None for any age.
    """

    sustained: Term
    trigger: Term
    window_s: Fraction | None


@dataclass(frozen=True, slots=True)
class Occurrences:
    """Number of recent states in which a condition held.

    Attributes:
        operand: the condition.
        window_s: greatest age of a state that counts, s.
    """

    operand: Term
    window_s: Fraction


PastTerm = Previously | Since | Occurrences
"""Terms that depend on states before the present one."""

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
    """Yield the direct sub-terms of a term.

    Args:
        term: any term.

    Yields:
        Its operands, in the order of the fields.
    """
    for name in _FIELDS[type(term)]:
        value = getattr(term, name)
        if type(value) in _KINDS:
            yield value
        elif type(value) is tuple:
            yield from (item for item in value if type(item) in _KINDS)


_KINDS: Final = frozenset(get_args(Term))
_FIELDS: Final = {kind: tuple(field.name for field in fields(kind)) for kind in _KINDS}


def walk(terms: Iterable[Term]) -> Iterator[Term]:
    """Yield terms and all that is in them.

    Args:
        terms: any terms.

    Yields:
        Each of them and each of their sub-terms, in no particular order.
    """
    pending = [*terms]
    while pending:
        one = pending.pop()
        yield one
        pending.extend(children(one))


def constants_in(terms: Iterable[Term]) -> set[Fraction]:
    """Collect the numbers that are written in terms.

    Args:
        terms: any terms.

    Returns:
        The values of all literals that are numbers, in SI.
    """
    found = (one.value for one in walk(terms) if isinstance(one, Literal))
    return {value for value in found if isinstance(value, Fraction)}


def variables_of(term: Term) -> dict[str, Variable]:
    """Collect the free variables of a term.

    Args:
        term: any term. The result is cached by its identity.

    Returns:
        A new mapping of variables by name, in order of first occurrence.
    """
    while isinstance(term, Not):  # most terms are looked up both plain and negated
        term = term.operand
    known = _FREE_VARIABLES_CACHE.get(id(term))
    if known is None:
        if len(_FREE_VARIABLES_CACHE) >= 4096:
            _FREE_VARIABLES_CACHE.clear()
        known = _FREE_VARIABLES_CACHE[id(term)] = (term, _variables_of(term))
    return dict(known[1])


_FREE_VARIABLES_CACHE: Final[dict[int, tuple[Term, dict[str, Variable]]]] = {}
"""Free variables by the term's identity, since comparing terms costs as much as walking them.

Each term is kept with its variables, so that its identity is not reused."""


def _variables_of(term: Term) -> dict[str, Variable]:
    variables: dict[str, Variable] = {}
    pending = [term]
    while pending:
        current = pending.pop()
        if isinstance(current, Variable):
            variables.setdefault(current.name, current)
            continue
        if isinstance(current, Literal):
            continue
        pending.extend(reversed(list(children(current))))
    return variables


def substitute(term: Term, replacements: Mapping[str, Term]) -> Term:
    """Replace variables in a term.

    Args:
        term: any term.
        replacements: terms by name of a free variable, or of an index bound outside `term`.

    Returns:
        The term with each of these names replaced.
    """
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
    """Join conditions by `and`, without needless nesting.

    Args:
        terms: boolean terms.

    Returns:
        Their conjunction, flattened and without `true`; a single condition stays as it is.
    """
    flat: list[Term] = []
    for term in terms:
        flat.extend(term.operands if isinstance(term, And) else (term,))
    kept = tuple(term for term in flat if term != TRUE)
    return kept[0] if len(kept) == 1 else And(kept)
