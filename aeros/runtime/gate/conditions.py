"""Deciding conditions at given values: by compiled functions, or by asking Z3 every time.

Both answer exactly as `semantics.py` does, so which one a gate uses changes its speed alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from enum import Enum
from fractions import Fraction
from functools import lru_cache
from typing import Any, Protocol

from aeros.spec.backends.compiled import compile_condition
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import scalar_variables
from aeros.spec.model.model import Declared, ranges_of


class ConditionValue(Enum):
    """Whether a condition holds; UNDECIDED denies."""

    HOLDS = "holds"
    FAILS = "fails"
    UNDECIDED = "undecided"


class DecidableCondition(Protocol):
    """One condition, ready to be decided.

    names: the scalar variables it depends on.
    """

    names: frozenset[str]

    def decide(self, values: Mapping[str, Any]) -> ConditionValue:
        """Whether it holds at `values`: float, bool or str by scalar variable, all in range."""


class CompiledCondition:
    """A condition as a generated function; never undecided."""

    def __init__(self, term: t.Term, declared: Iterable[Declared]) -> None:
        mentioned = _variables_used(term, declared)
        self.names = _scalar_names(mentioned)
        self.holds = _compiled(term, tuple(ranges_of(mentioned).items()))

    def decide(self, values: Mapping[str, Any]) -> ConditionValue:
        """See `DecidableCondition`."""
        return ConditionValue.HOLDS if self.holds(values) else ConditionValue.FAILS


@lru_cache(maxsize=1024)
def _compiled(
    term: t.Term, ranges: tuple[tuple[str, tuple[Fraction, Fraction]], ...]
) -> Callable[[Mapping[str, Any]], bool]:
    """Compiled once, however many runs there are under one site: the function keeps nothing of its calls."""
    return compile_condition(term, dict(ranges))


class SolverCondition:
    """A condition that Z3 decides, with the values as exact rationals.

    beside: another one of the same gate, with which it shares what the solver keeps.
    """

    def __init__(
        self, term: t.Term, declared: Iterable[Declared], shared_context: SolverCondition | None = None
    ) -> None:
        # z3 takes 80 ms to import, which the compiled gate need not pay.
        from aeros.spec.backends.z3_solver import IncrementalSolver

        self._term = term
        mentioned = _variables_used(term, declared)
        self.names = _scalar_names(mentioned)
        variables = (one.variable for one in mentioned)
        shared = None if shared_context is None else shared_context._session
        self._session: IncrementalSolver = IncrementalSolver(
            variables, ranges_of(mentioned), shared_context=shared
        )

    def decide(self, values: Mapping[str, Any]) -> ConditionValue:
        """See `DecidableCondition`."""
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
