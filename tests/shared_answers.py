"""Solver answers that tests of one process share, where they are about something else than the solver.

Most of these tests plan with the same few modules, and each would ask Z3 the same hundreds of questions.
An answer depends on nothing but its key: the question, the solver's version and its budget. Answers that a
clock may have cut off are not shared.
"""

from __future__ import annotations

from typing import Any

from aeros.spec.backends.oracle import Oracle
from aeros.spec.backends.solver_results import SatResult, SolverAnswer

_MAX_ANSWERS = 100_000


class _DecidedAnswers(dict[str, SolverAnswer]):
    """Answers by the key of their question; keeps none that is undecided."""

    def __setitem__(self, key: str, answer: SolverAnswer) -> None:
        if answer.result is not SatResult.UNKNOWN and len(self) < _MAX_ANSWERS:
            super().__setitem__(key, answer)

    def __ior__(self, others: Any) -> _DecidedAnswers:  # type: ignore[override, misc]
        for key, answer in dict(others).items():
            self[key] = answer
        return self


class SharedAnswers:
    """Switch that gives all new oracles one memory, or each its own, as they have it outside of tests."""

    def __init__(self) -> None:
        self.is_on = False
        answers = _DecidedAnswers()
        initialize = Oracle.__init__

        def initialize_with_answers(oracle: Oracle, *arguments: Any, **options: Any) -> None:
            initialize(oracle, *arguments, **options)
            if self.is_on and oracle._store is None:  # else later processes would not find the answers there
                oracle._known = answers

        Oracle.__init__ = initialize_with_answers  # type: ignore[assignment, method-assign]
