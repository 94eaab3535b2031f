"""Oracle for satisfiability questions: each is answered once, by bounds alone or by a new solver.

So an answer depends on the question alone, not on earlier questions. Modules repeat themselves: skills share
envelopes, and most questions of a run were asked in an earlier run.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path

from aeros.spec.backends.answer_store import AnswerStore
from aeros.spec.backends.interval_solver import IntervalSolver
from aeros.spec.backends.package_versions import z3_version
from aeros.spec.backends.resource_limit import DEFAULT_RLIMIT, QUESTION_SECONDS
from aeros.spec.backends.solver_process import SOLVER_PROCESS
from aeros.spec.backends.solver_results import SatResult, SolverAnswer, timeout_answer
from aeros.spec.expr import terms as t

_SPEC_FOLDER = Path(__file__).parents[1]


@dataclass(frozen=True)
class SolverQuery:
    """Question with its answer, for a second solver.

    Attributes:
        description: purpose of the question, in words.
        variables: every free variable of the terms.
        ranges: closed range (SI) of each real scalar variable.
        terms: conditions that must hold together.
        answer: the answer.
        by_intervals: True if bounds alone answered it, and not Z3.
    """

    description: str
    variables: Sequence[t.Variable]
    ranges: Mapping[str, tuple[Fraction, Fraction]]
    terms: Sequence[t.Term]
    answer: SolverAnswer
    by_intervals: bool = False


@dataclass
class _Timeouts:
    """Number of questions without an answer in time, shared by oracles of one run."""

    used: int = 0


class Oracle:
    """Source of answers under one budget: memory, the store, or Z3.

    Args:
        rlimit: the solver's budget for one question, in its resource units.
        store: answers of earlier runs; None to ask everything.
        recording: keep the questions in `asked`.
        seconds: time limit for one question, s.
        max_timeouts: questions that may have no answer within `seconds`, after which no other is asked;
            None for any number.

    Attributes:
        asked: questions by key, wherever the answer came from; empty unless `recording`.
    """

    def __init__(
        self,
        rlimit: int = DEFAULT_RLIMIT,
        store: AnswerStore | None = None,
        *,
        recording: bool = False,
        seconds: float = QUESTION_SECONDS,
        max_timeouts: int | None = None,
    ) -> None:
        self.rlimit = rlimit
        self._seconds = seconds
        self._max_timeouts = max_timeouts
        self._timeouts = _Timeouts()
        self.asked: dict[str, SolverQuery] = {}
        self._recording = recording
        self._store = store
        self._known: dict[str, SolverAnswer] = {}
        self._new: dict[str, SolverAnswer] = {}
        self._boxes = IntervalSolver()

    def check_sat(
        self,
        variables: Sequence[t.Variable],
        ranges: Mapping[str, tuple[Fraction, Fraction]],
        terms: Sequence[t.Term],
        description: str = "an explanation",
        *,
        shown: bool = False,
    ) -> SolverAnswer:
        """Check if all terms can hold together.

        Args:
            variables: every free variable of the terms.
            ranges: closed range (SI) of each real scalar variable.
            terms: boolean terms without past-time operators.
            description: purpose of the question, in words.
            shown: True if a person will read the model; then the model is Z3's.

        Returns:
            SAT with a model, UNSAT, or UNKNOWN where the budget or the time limit ran out.
        """
        bounded = self._boxes.decide(variables, ranges, terms)
        if bounded is not None and not (shown and bounded.result is SatResult.SAT):
            if self._recording:
                key = self._key(variables, ranges, terms)
                self.asked.setdefault(
                    key, SolverQuery(description, variables, ranges, terms, bounded, by_intervals=True)
                )
            return bounded
        key = self._key(variables, ranges, terms)
        answer = self._known.get(key)
        if answer is None and self._store is not None:
            answer = self._store.get(key)
        if answer is None:
            answer = self._new[key] = self._solve(variables, ranges, terms)
        self._known[key] = answer
        if self._recording:
            self.asked.setdefault(key, SolverQuery(description, variables, ranges, terms, answer))
        return answer

    def with_reduced_budget(self, times: int) -> Oracle:
        """Make an oracle with the same memory and store and a smaller budget.

        Args:
            times: divisor of the budget.

        Returns:
            The oracle.
        """
        other = Oracle(
            max(self.rlimit // times, 1),
            self._store,
            recording=self._recording,
            seconds=self._seconds,
            max_timeouts=self._max_timeouts,
        )
        other._timeouts = self._timeouts
        other._known, other._new, other.asked = self._known, self._new, self.asked
        other._boxes = self._boxes
        return other

    def save_answers(self) -> None:
        """Put the new answers into the store."""
        if self._store is not None and self._new:
            self._store.put(self._new)
            self._new = {}

    def _solve(
        self,
        variables: Sequence[t.Variable],
        ranges: Mapping[str, tuple[Fraction, Fraction]],
        terms: Sequence[t.Term],
    ) -> SolverAnswer:
        if self._timeouts.used == self._max_timeouts:
            late = f"{self._timeouts.used} questions had no answer within {self._seconds:g} s"
            why = f"not asked, as {late}"
            return SolverAnswer(SatResult.UNKNOWN, {}, why)
        answer = SOLVER_PROCESS.check_sat(variables, ranges, terms, self.rlimit, self._seconds)
        self._timeouts.used += answer == timeout_answer(self._seconds)
        return answer

    def _key(
        self,
        variables: Sequence[t.Variable],
        ranges: Mapping[str, tuple[Fraction, Fraction]],
        terms: Sequence[t.Term],
    ) -> str:
        bounds = [(name, str(low), str(high)) for name, (low, high) in ranges.items()]
        question = repr((_solver_fingerprint(), self.rlimit, tuple(variables), bounds, tuple(terms)))
        return hashlib.sha256(question.encode()).hexdigest()


@cache
def _solver_fingerprint() -> str:
    """Hash the solver's version and the code that gives terms their meaning."""
    digest = hashlib.sha256(z3_version().encode())
    for folder in ("backends", "expr"):
        for path in sorted((_SPEC_FOLDER / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()
