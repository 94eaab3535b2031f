"""Every question of a run, put again to a second solver as text: verdicts do not rest on one solver alone.

The text is Z3's own encoding of the question, so what is examined twice is the decision.  That terms
are encoded as they are meant, the conformance suite and the replay of witnesses show.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol

from aeros.spec.backends.oracle import SolverQuery
from aeros.spec.backends.solver_results import SatResult, SolverAnswer
from aeros.spec.diagnostics.errors import DisagreementError


class SecondSolver(Protocol):
    """Answers an SMT-LIB script that asks once; `name` is for people, with the version."""

    @property
    def name(self) -> str: ...  # noqa: D102

    def solve_script(self, script: str) -> SolverAnswer: ...  # noqa: D102


@dataclass(frozen=True)
class SecondSolverReport:
    """What a second solver said of the questions that were decided; wherever it decided, the same.

    questions: how many different ones there were.
    undecided: what each question that was beyond the second solver is about, and why it was.
    """

    solver: str
    query_count: int
    undecided_queries: tuple[tuple[str, str], ...]

    @property
    def agreed_count(self) -> int:
        """Of how many questions both solvers said the same."""
        return self.query_count - len(self.undecided_queries)


def cross_check_queries(
    questions: Iterable[SolverQuery], second: SecondSolver, progress: Callable[[str], None]
) -> SecondSolverReport:
    """What `second` says of `questions`; raises DisagreementError where it says otherwise than Z3 did.

    Questions that Z3 did not decide are left out: no verdict rests on them.
    """
    from aeros.spec.backends.z3_solver import IncrementalSolver, solver_version

    decided = [one for one in questions if one.answer.result is not SatResult.UNKNOWN]
    seen: set[str] = set()
    undecided: list[tuple[str, str]] = []
    for number, one in enumerate(decided, 1):
        progress(f"{number} of {len(decided)} questions again with {second.name}")
        script = IncrementalSolver(one.variables, one.ranges).to_smtlib(*one.terms)
        if script in seen:
            continue
        seen.add(script)
        said = second.solve_script(script)
        if said.result is SatResult.UNKNOWN:
            undecided.append((one.description, said.reason))
        elif said.result is not one.answer.result:
            first = "AEROS, by bounds alone," if one.by_intervals else solver_version()
            answers = (
                f"{who} says {answer.result.value}"
                for who, answer in ((first, one.answer), (second.name, said))
            )
            raise DisagreementError(one.description, script, *answers)
    return SecondSolverReport(second.name, len(seen), tuple(undecided))
