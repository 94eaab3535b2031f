"""Interval solver: decides questions by bounds alone, exactly and without an SMT solver; most need no more.

A box gives each scalar variable the interval, truth values or members that it may still have. A bound on one
variable, or on a sum of several, narrows the box. Alternatives are tried one after another. Any other
condition narrows the one variable that it compares with something, or is refuted, by interval arithmetic. So

- UNSAT is answered only if each choice of alternatives leaves some variable without a value, or refutes a
  condition for every value in the box: conditions that it cannot handle are assumed to hold;
- SAT is answered with a model, which the caller replays through `semantics.py`;
- anything else is left to the SMT solver.

An answer depends on the question alone. A differential test compares with Z3 and with the definition. The
`interval` package narrows the boxes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Final, TypeAlias

from aeros.spec.backends.interval.box import Box, declared_interval, pick_value
from aeros.spec.backends.interval.formula import (
    Conjunction,
    Disjunction,
    Formula,
    conjuncts_of,
    names_of,
    to_formula,
)
from aeros.spec.backends.interval.search import BranchAndPrune
from aeros.spec.backends.solver_results import SatResult, ScalarValue, SolverAnswer
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, scalar_variables

MAX_CACHED: Final = 20_000
"""Answers about parts of questions that are cached; beyond it the cache is emptied, which only costs time."""

_Range: TypeAlias = tuple[Fraction, Fraction]


@dataclass(frozen=True, slots=True)
class _Conjunct:
    """One of the conditions that a question is the conjunction of. Equal ones have the same number."""

    number: int
    formula: Formula
    names: frozenset[str]


class IntervalSolver:
    """Solver that decides a question part by part: conditions that share no variable are independent.

    It caches how terms read and how parts were decided, as most questions share most of their parts.
    """

    def __init__(self) -> None:
        self._read: dict[tuple[int, bool], tuple[t.Term, Formula]] = {}  # by identity: terms are large
        self._parts: dict[tuple[int, bool], tuple[t.Term, tuple[_Conjunct, ...]]] = {}
        self._numbers: dict[Formula, int] = {}
        self._ranges: dict[int, tuple[_Range | None, int]] = {}  # likewise
        self._numbers_of_ranges: dict[_Range | None, int] = {}
        self._decided: dict[object, SolverAnswer | None] = {}

    def decide(
        self,
        variables: Sequence[t.Variable],
        ranges: Mapping[str, tuple[Fraction, Fraction]],
        terms: Sequence[t.Term],
    ) -> SolverAnswer | None:
        """Check if all terms can hold together.

        Args:
            variables: every free variable of the terms.
            ranges: closed range (SI) of each real scalar variable; one without a range is unbounded.
            terms: boolean terms without past-time operators.

        Returns:
            SAT with a model of all scalar variables, or UNSAT; None if bounds alone do not decide.
        """
        if len(self._decided) > MAX_CACHED:
            for kept in (self._read, self._parts, self._numbers, self._decided):
                kept.clear()
            self._ranges.clear()
            self._numbers_of_ranges.clear()
        scalars = {scalar.name: scalar for variable in variables for scalar in scalar_variables(variable)}
        model: dict[str, ScalarValue] = {}
        is_known = True
        parts = {part.number: part for term in terms for part in self._conjuncts_of(term)}
        for group in _connected(parts.values()):
            answer = self._decide_group(group, scalars, ranges)
            if answer is None:
                is_known = False
            elif answer.result is SatResult.UNSAT:
                return answer
            else:
                model |= answer.model
        rest = {
            name: pick_value(scalar, declared_interval(scalar, ranges))
            for name, scalar in scalars.items()
            if name not in model
        }
        return SolverAnswer(SatResult.SAT, model | rest) if is_known else None

    def _decide_group(
        self,
        group: Sequence[_Conjunct],
        scalars: Mapping[str, t.Variable],
        ranges: Mapping[str, tuple[Fraction, Fraction]],
    ) -> SolverAnswer | None:
        names = sorted(frozenset[str]().union(*(part.names for part in group)))
        own = [scalars[name] for name in names]
        numbers = [part.number for part in group]
        key = (*numbers, *own, *(self._range_id(ranges.get(name)) for name in names))
        if key not in self._decided:
            box: Box = {scalar.name: declared_interval(scalar, ranges) for scalar in own}
            self._decided[key] = BranchAndPrune(own).run([part.formula for part in group], box)
        return self._decided[key]

    def _range_id(self, range_: _Range | None) -> int:
        """Number each range: hashing a fraction takes longer than finding most answers."""
        known = self._ranges.get(id(range_))
        if known is None:
            number = self._numbers_of_ranges.setdefault(range_, len(self._numbers_of_ranges))
            known = self._ranges[id(range_)] = (range_, number)
        return known[1]

    def _conjuncts_of(self, term: t.Term) -> tuple[_Conjunct, ...]:
        is_true = True
        while isinstance(term, t.Not):
            term, is_true = term.operand, not is_true
        key = (id(term), is_true)
        if key not in self._parts:
            conjuncts = conjuncts_of(self._formula(term, is_true=is_true))
            parts = tuple(
                _Conjunct(self._numbers.setdefault(formula, len(self._numbers)), formula, names_of(formula))
                for formula in conjuncts
            )
            self._parts[key] = (term, parts)
        return self._parts[key][1]

    def _formula(self, term: t.Term, *, is_true: bool) -> Formula:
        key = (id(term), is_true)
        if key not in self._read:
            self._read[key] = (term, self._read_formula(term, is_true=is_true))
        return self._read[key][1]

    def _read_formula(self, term: t.Term, *, is_true: bool) -> Formula:
        match term:
            case t.Not(operand=operand):
                return self._formula(operand, is_true=not is_true)
            case t.And(operands=operands) | t.Or(operands=operands):
                parts = tuple(self._formula(operand, is_true=is_true) for operand in operands)
                return Conjunction(parts) if isinstance(term, t.And) is is_true else Disjunction(parts)
            case t.Implies(premise=premise, conclusion=conclusion):
                sides = (
                    self._formula(premise, is_true=not is_true),
                    self._formula(conclusion, is_true=is_true),
                )
                return Disjunction(sides) if is_true else Conjunction(sides)
            case _:
                return to_formula(lower(term), is_true=is_true)


def _connected(parts: Iterable[_Conjunct]) -> list[list[_Conjunct]]:
    """Group the parts so that parts which share a variable, directly or through others, are together."""
    groups: list[tuple[frozenset[str], list[_Conjunct]]] = []
    for part in parts:
        apart, names, joined = [], part.names, []
        for group in groups:
            if group[0].isdisjoint(part.names):
                apart.append(group)
            else:
                names |= group[0]
                joined += group[1]
        groups = [*apart, (names, [*joined, part])]
    return [group for _, group in groups]
