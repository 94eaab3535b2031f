"""Evaluation of conditions at given values, by compiled functions or by Z3.

Both agree exactly with `semantics.py`, so the choice affects only the speed of a gate.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from enum import Enum
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, Final, Protocol

from aeros.spec.backends.compiled import compile_condition
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import scalar_variables
from aeros.spec.model.variables import Declared, ranges_of

if TYPE_CHECKING:
    from aeros.spec.backends.z3_solver import IncrementalSolver, SolverContext

_SECONDS: Final = 1.0
"""Time limit for one condition, s: with all values given, Z3 takes some 2 ms."""


class ConditionValue(Enum):
    """Value of a condition; the gate denies on UNDECIDED."""

    HOLDS = "holds"
    FAILS = "fails"
    UNDECIDED = "undecided"


class DecidableCondition(Protocol):
    """One condition, prepared for evaluation.

    Attributes:
        names: the scalar variables it depends on.
    """

    names: frozenset[str]

    def decide(self, values: Mapping[str, Any]) -> ConditionValue:
        """Evaluate the condition.

        Args:
            values: float, bool or str by scalar variable, all within their declared ranges; contains `names`.

        Returns:
            HOLDS, FAILS, or UNDECIDED if the solver could not tell.
        """


class CompiledCondition:
    """A condition compiled to a Python function; never undecided."""

    def __init__(self, term: t.Term, declared: Iterable[Declared]) -> None:
        self._term = term
        self._mentioned = _variables_used(term, declared)
        self.names = _scalar_names(self._mentioned)

    @cached_property
    def holds(self) -> Callable[[Mapping[str, Any]], bool]:
        """The function, compiled when it is first asked: the fast path needs none of them."""
        return _compiled(self._term, tuple(ranges_of(self._mentioned).items()))

    def decide(self, values: Mapping[str, Any]) -> ConditionValue:
        """Implement `DecidableCondition.decide`."""
        return ConditionValue.HOLDS if self.holds(values) else ConditionValue.FAILS


@lru_cache(maxsize=1024)
def _compiled(
    term: t.Term, ranges: tuple[tuple[str, tuple[Fraction, Fraction]], ...]
) -> Callable[[Mapping[str, Any]], bool]:
    """Compile each condition once for all runs under one site; the function keeps no state."""
    return compile_condition(term, dict(ranges))


class GateSolver:
    """Z3 as the conditions of one gate share it; started by the first question. Not thread-safe."""

    @cached_property
    def context(self) -> SolverContext:
        """Context of all solvers of the gate."""
        # Importing z3 takes 50 ms, which the compiled gate does not need to spend.
        from aeros.spec.backends.z3_solver import SolverContext

        return SolverContext()


class SolverCondition:
    """A condition that Z3 evaluates, with the values as exact rationals.

    It is encoded when it is first asked: a run asks a tenth of the conditions of its site.

    Args:
        solver: shared with other conditions of the same gate; None for one of its own.
    """

    def __init__(self, term: t.Term, declared: Iterable[Declared], solver: GateSolver | None = None) -> None:
        self._term = term
        self._mentioned = _variables_used(term, declared)
        self.names = _scalar_names(self._mentioned)
        self._solver = solver or GateSolver()

    @cached_property
    def _session(self) -> IncrementalSolver:
        from aeros.spec.backends.z3_solver import IncrementalSolver

        return IncrementalSolver(
            (one.variable for one in self._mentioned),
            ranges_of(self._mentioned),
            context=self._solver.context,
            seconds=_SECONDS,
        )

    def decide(self, values: Mapping[str, Any]) -> ConditionValue:
        """Implement `DecidableCondition.decide`."""
        given = {name: _exact(values[name]) for name in self.names}
        result = self._session.check_at_values(given, self._term).result.value
        return {"sat": ConditionValue.HOLDS, "unsat": ConditionValue.FAILS}.get(
            result, ConditionValue.UNDECIDED
        )


def _variables_used(term: t.Term, declared: Iterable[Declared]) -> list[Declared]:
    used = t.variables_of(term)
    return [one for one in declared if one.name in used]


def _scalar_names(declared: Iterable[Declared]) -> frozenset[str]:
    return frozenset(scalar.name for one in declared for scalar in scalar_variables(one.variable))


def _exact(value: Any) -> Any:
    return Fraction(value) if type(value) is float else value
