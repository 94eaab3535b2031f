"""Oracle for satisfiability questions: Z3 answers each once, alone or together with others.

An answer depends on the question alone, or on the questions that are asked together, and never on earlier
ones. Most questions of a run were asked in an earlier run.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Final, NamedTuple

from aeros.spec.backends.answer_store import AnswerStore
from aeros.spec.backends.package_versions import z3_version
from aeros.spec.backends.resource_limit import DEFAULT_RLIMIT, QUESTION_SECONDS
from aeros.spec.backends.solver_process import SOLVER_PROCESS
from aeros.spec.backends.solver_results import Question, SatResult, SolverAnswer, timeout_answer
from aeros.spec.expr import terms as t

_EXPLANATION: Final = "an explanation"
_SPEC_FOLDER = Path(__file__).parents[1]


@dataclass(frozen=True)
class SolverQuery:
    """Question with its answer, for a second solver.

    Attributes:
        description: purpose of the question, in words.
        question: the question.
        answer: the answer.
    """

    description: str
    question: Question
    answer: SolverAnswer


class PosedQuestion(NamedTuple):
    """Question that is asked together with others.

    Attributes:
        question: the question.
        description: its purpose, in words.
        is_shown: True if a person will read the model; then the model depends on the question alone.
    """

    question: Question
    description: str = _EXPLANATION
    is_shown: bool = False


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
        self._digests: dict[int, tuple[t.Term, str]] = {}

    def check_sat(
        self,
        variables: Sequence[t.Variable],
        ranges: Mapping[str, tuple[Fraction, Fraction]],
        terms: Sequence[t.Term],
        description: str = _EXPLANATION,
    ) -> SolverAnswer:
        """Check if all terms can hold together.

        Args:
            variables: every free variable of the terms.
            ranges: closed range (SI) of each real scalar variable.
            terms: boolean terms without past-time operators.
            description: purpose of the question, in words.

        Returns:
            SAT with a model, UNSAT, or UNKNOWN where the budget or the time limit ran out.
        """
        question = Question(variables, ranges, terms)
        key = self._key(question)
        answer = self._look_up(key)
        if answer is None:
            answer = self._new[key] = self._solve(question)
        self._known[key] = answer
        self._record(key, question, description, answer)
        return answer

    def check_together(self, posed: Sequence[PosedQuestion]) -> list[SolverAnswer]:
        """Check for several questions if all terms of each can hold together, which is much faster.

        Args:
            posed: the questions.

        Returns:
            The answers in order, as `check_sat` gives them. Which values a model has may depend on what is
            asked together, unless it is shown.
        """
        keyed = [(self._key(one.question), one) for one in posed]
        different = {key: one.question for key, one in keyed}
        shown = {key for key, one in keyed if one.is_shown}
        found = self._answer_together(different) if len(different) > 1 else {}
        settled = []
        for key, one in keyed:
            answer = found.get(key)
            if answer is None or (answer.result is SatResult.SAT and key in shown):
                answer = self.check_sat(*one.question, one.description)
            else:
                self._record(key, one.question, one.description, answer)
            settled.append(answer)
        return settled

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
        other._digests = self._digests
        other._known, other._new, other.asked = self._known, self._new, self.asked
        return other

    def save_answers(self) -> None:
        """Put the new answers into the store."""
        if self._store is not None and self._new:
            self._store.put(self._new)
            self._new.clear()  # it is shared with oracles of a smaller budget

    def _answer_together(self, questions: Mapping[str, Question]) -> Mapping[str, SolverAnswer]:
        """Answer different questions together; those that have to be asked alone are left out."""
        group = _hash("\n".join(questions))
        places = {key: f"{group}/{number}" for number, key in enumerate(questions)}
        answers = {key: self._look_up(place) for key, place in places.items()}
        if None in answers.values() and self._timeouts.used != self._max_timeouts:
            found = SOLVER_PROCESS.check_together(list(questions.values()), self.rlimit, self._seconds)
            answers = dict(zip(questions, found, strict=True))
            new = {places[key]: answer for key, answer in answers.items() if answer is not None}
            self._known |= new
            self._new |= new
        return {key: answer for key, answer in answers.items() if answer is not None}

    def _look_up(self, key: str) -> SolverAnswer | None:
        answer = self._known.get(key)
        return self._store.get(key) if answer is None and self._store is not None else answer

    def _record(self, key: str, question: Question, description: str, answer: SolverAnswer) -> None:
        if self._recording:
            self.asked.setdefault(key, SolverQuery(description, question, answer))

    def _solve(self, question: Question) -> SolverAnswer:
        if self._timeouts.used == self._max_timeouts:
            late = f"{self._timeouts.used} questions had no answer within {self._seconds:g} s"
            why = f"not asked, as {late}"
            return SolverAnswer(SatResult.UNKNOWN, {}, why)
        answer = SOLVER_PROCESS.check_sat(*question, self.rlimit, self._seconds)
        self._timeouts.used += answer == timeout_answer(self._seconds)
        return answer

    def _key(self, question: Question) -> str:
        parts = [
            _solver_fingerprint(),
            str(self.rlimit),
            *map(self._digest, question.variables),
            *(f"{name} in {low} to {high}" for name, (low, high) in question.ranges.items()),
            *map(self._digest, question.terms),
        ]
        return _hash("\n".join(parts))

    def _digest(self, term: t.Term) -> str:
        """Return a digest of a term; questions share large terms, so it is kept by the term's identity."""
        known = self._digests.get(id(term))
        if known is None:
            match term:
                case t.Not(operand=operand):
                    text = f"not {self._digest(operand)}"
                case t.And(operands=operands) | t.Or(operands=operands):
                    text = " ".join((type(term).__name__, *map(self._digest, operands)))
                case _:
                    text = repr(term)
            known = self._digests[id(term)] = term, _hash(text)
        return known[1]


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


@cache
def _solver_fingerprint() -> str:
    """Hash the solver's version and the code that gives terms their meaning."""
    digest = hashlib.sha256(z3_version().encode())
    for folder in ("backends", "expr"):
        for path in sorted((_SPEC_FOLDER / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()
