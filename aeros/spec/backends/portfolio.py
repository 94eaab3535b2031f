"""Ways to have Z3 decide one question, tried in order until one decides it.

Each has the same budget, in Z3's resource units, so the answer is the same on every machine. Z3 decides in
all of them: lemmas are true everywhere, and a point that a search finds is put to Z3 with its values.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Final

from aeros.spec.backends.lemmas import lemmas_for
from aeros.spec.backends.solver_results import Question, SatResult, SolverAnswer, timeout_answer
from aeros.spec.backends.violation_search import search
from aeros.spec.backends.z3_solver import IncrementalSolver
from aeros.spec.expr import terms as t

_SHARE: Final = 0.4  # of the time limit, that one way may use: some work of Z3 counts on no budget

_Way = Callable[[IncrementalSolver, Question], SolverAnswer | None]


def decide(question: Question, rlimit: int, seconds: float) -> SolverAnswer:
    """Decide a question.

    Args:
        question: the question.
        rlimit: budget of each way, in Z3's resource units.
        seconds: time limit of all ways together, s.

    Returns:
        The answer of the first way that decides it; UNKNOWN with the reason of the first way if none does, or
        if the time is up.
    """
    started = time.monotonic()
    first: SolverAnswer | None = None
    for way in _WAYS:
        left = min(_SHARE * seconds, seconds - (time.monotonic() - started))
        if left <= 0:
            break
        # A solver of its own, so that no way depends on the work of those before.
        solver = IncrementalSolver(question.variables, question.ranges, rlimit, seconds=left)
        answer = way(solver, question)
        if answer is not None and answer.result is not SatResult.UNKNOWN:
            return answer
        if first is None:
            first = timeout_answer(seconds) if answer == timeout_answer(left) else answer
    return first or timeout_answer(seconds)


def _directly(solver: IncrementalSolver, question: Question) -> SolverAnswer | None:
    """Decide as Z3 does by default."""
    return solver.check_sat(*question.terms)


def _from_a_point(solver: IncrementalSolver, question: Question) -> SolverAnswer | None:
    """Search for a point, and have it decided; without one, decide with lemmas, some from the nearest point.

    Products are multiplied out so that they meet those of the lemmas.
    """
    result = search(question)
    if result.found is not None:
        answer = solver.check_at_values(result.found, t.And(tuple(question.terms)))
        return SolverAnswer(SatResult.SAT, result.found) if answer.result is SatResult.SAT else None
    lemmas = lemmas_for(question.terms, question.ranges, result.nearest)
    return solver.check_simplified((*question.terms, *lemmas)) if lemmas else None


def _by_cells(solver: IncrementalSolver, question: Question) -> SolverAnswer | None:
    """Decide by cylindrical cells alone (nlsat), which is complete for polynomials."""
    return solver.check_simplified(question.terms, "qfnra-nlsat")


_WAYS: Sequence[_Way] = (_directly, _from_a_point, _by_cells)
