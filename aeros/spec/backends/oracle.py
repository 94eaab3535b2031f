"""Questions about terms, each answered once: by bounds alone, or by the solver in a context of its own.

So an answer depends on the question alone, and on nothing that was asked before.  Modules repeat
themselves: skills share envelopes, and most of a run asks what another run has asked.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path

from aeros.spec.backends.answer_store import Store
from aeros.spec.backends.interval_solver import Boxes
from aeros.spec.backends.package_versions import solver_release
from aeros.spec.backends.resource_limit import DEFAULT_RLIMIT
from aeros.spec.backends.solver_results import Answer, Result
from aeros.spec.expr import terms as t

_SPEC = Path(__file__).parents[1]


@dataclass(frozen=True)
class Question:
    """A question as it was asked, and its answer, for a second solver.

    about: what it was asked for, in words.
    by_bounds: whether bounds alone answered it, and not Z3.
    """

    about: str
    variables: Sequence[t.Variable]
    ranges: Mapping[str, tuple[Fraction, Fraction]]
    terms: Sequence[t.Term]
    answer: Answer
    by_bounds: bool = False


class Oracle:
    """Answers questions under one budget, from memory, from a store, or by asking Z3.

    rlimit: the solver's budget for one question.
    store: answers of earlier runs; None to ask everything.
    asked: what was asked, by key, wherever the answer was found; empty unless the oracle is `recording`.
    """

    def __init__(
        self, rlimit: int = DEFAULT_RLIMIT, store: Store | None = None, *, recording: bool = False
    ) -> None:
        self.rlimit = rlimit
        self.asked: dict[str, Question] = {}
        self._recording = recording
        self._store = store
        self._known: dict[str, Answer] = {}
        self._new: dict[str, Answer] = {}
        self._boxes = Boxes()

    def ask(
        self,
        variables: Sequence[t.Variable],
        ranges: Mapping[str, tuple[Fraction, Fraction]],
        terms: Sequence[t.Term],
        about: str = "an explanation",
        *,
        shown: bool = False,
    ) -> Answer:
        """Whether all `terms` can hold together.

        variables: every free variable of the terms.
        ranges: closed range in SI of each real scalar variable.
        shown: whether a person will read the model, which then is the solver's.
        about: what is asked for, in words.
        """
        bounded = self._boxes.decide(variables, ranges, terms)
        if bounded is not None and not (shown and bounded.result is Result.SAT):
            if self._recording:
                key = self._key(variables, ranges, terms)
                self.asked.setdefault(key, Question(about, variables, ranges, terms, bounded, by_bounds=True))
            return bounded
        key = self._key(variables, ranges, terms)
        answer = self._known.get(key)
        if answer is None and self._store is not None:
            answer = self._store.get(key)
        if answer is None:
            answer = self._new[key] = self._solve(variables, ranges, terms)
        self._known[key] = answer
        if self._recording:
            self.asked.setdefault(key, Question(about, variables, ranges, terms, answer))
        return answer

    def hurried(self, times: int) -> Oracle:
        """One with the same memory and store, which gives up after a part of the budget."""
        other = Oracle(max(self.rlimit // times, 1), self._store, recording=self._recording)
        other._known, other._new, other.asked = self._known, self._new, self.asked
        other._boxes = self._boxes
        return other

    def keep(self) -> None:
        """Put what had to be asked into the store."""
        if self._store is not None and self._new:
            self._store.put(self._new)
            self._new = {}

    def _solve(
        self,
        variables: Sequence[t.Variable],
        ranges: Mapping[str, tuple[Fraction, Fraction]],
        terms: Sequence[t.Term],
    ) -> Answer:
        # z3 takes 80 ms to import, which a run that finds every answer need not pay.
        from aeros.spec.backends.z3_solver import Session

        return Session(variables, ranges, self.rlimit).ask(*terms)

    def _key(
        self,
        variables: Sequence[t.Variable],
        ranges: Mapping[str, tuple[Fraction, Fraction]],
        terms: Sequence[t.Term],
    ) -> str:
        bounds = [(name, str(low), str(high)) for name, (low, high) in ranges.items()]
        question = repr((_asked_by(), self.rlimit, tuple(variables), bounds, tuple(terms)))
        return hashlib.sha256(question.encode()).hexdigest()


@cache
def _asked_by() -> str:
    """Digest of the solver's version and of the code that gives terms their meaning."""
    digest = hashlib.sha256(solver_release().encode())
    for folder in ("backends", "expr"):
        for path in sorted((_SPEC / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()
