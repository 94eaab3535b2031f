"""Answers of solvers, as types that need no solver to be imported."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:  # a run that finds everything in the cache imports nothing that proves
    from aeros.spec.expr import terms as t

ScalarValue = bool | Fraction | str
"""A value of a scalar variable: truth, exact real in SI, enum member."""


class Question(NamedTuple):
    """Question whether conditions can hold together.

    Attributes:
        variables: every free variable of the terms.
        ranges: closed range (SI) of each real scalar variable; one without a range is unbounded.
        terms: boolean terms without past-time operators.
    """

    variables: Sequence[t.Variable]
    ranges: Mapping[str, tuple[Fraction, Fraction]]
    terms: Sequence[t.Term]


class SatResult(Enum):
    """Result of a satisfiability question."""

    SAT = "sat"
    UNSAT = "unsat"
    UNKNOWN = "unknown"


class NoAnswerError(Exception):
    """A question without an answer; the message is the reason."""


@dataclass(frozen=True, slots=True)
class SolverAnswer:
    """Answer of a solver to one question.

    Attributes:
        result: SAT, UNSAT or UNKNOWN.
        model: value by scalar variable if SAT; otherwise empty.
        reason: the solver's reason if UNKNOWN; otherwise empty.
    """

    result: SatResult
    model: Mapping[str, ScalarValue]
    reason: str = ""


def timeout_answer(seconds: float) -> SolverAnswer:
    """Make the answer to a question that took too long.

    Args:
        seconds: the time limit, s.

    Returns:
        UNKNOWN with the limit as the reason. No store keeps it: another try may be answered.
    """
    return SolverAnswer(SatResult.UNKNOWN, {}, f"no answer within {seconds:g} s")


@dataclass(frozen=True, slots=True)
class ScriptAnswer:
    """Result of SMT-LIB text with one `check-sat`.

    Attributes:
        result: SAT, UNSAT or UNKNOWN.
        model: if SAT, the value of each constant that the text declares, as SMT-LIB text.
        unsat_core: if UNSAT, the number of assertions that are enough for it.
        rlimit_used: resource units that the solver used.
        reason: if UNKNOWN, the reason.
    """

    result: SatResult
    model: Mapping[str, str]
    unsat_core: int
    rlimit_used: int
    reason: str = ""


class SecondSolver(Protocol):
    """A solver that answers SMT-LIB scripts with one query."""

    @property
    def name(self) -> str:
        """Name and version of the solver, for people."""

    def solve_script(self, script: str) -> SolverAnswer:
        """Solve a script with one `check-sat`.

        Args:
            script: SMT-LIB text.

        Returns:
            The answer.
        """
