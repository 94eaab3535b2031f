"""Every question of a run, put again to a second solver as text: verdicts do not rest on one solver alone.

The text is Z3's own encoding of the question, so what is examined twice is the decision.  That terms
are encoded as they are meant, the conformance suite and the replay of witnesses show.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol

from aeros.spec.backends.oracle import Question
from aeros.spec.backends.solver_results import Answer, Result
from aeros.spec.diagnostics.errors import DisagreementError


class SecondSolver(Protocol):
    """Answers an SMT-LIB script that asks once; `name` is for people, with the version."""

    @property
    def name(self) -> str: ...  # noqa: D102

    def answer(self, script: str) -> Answer: ...  # noqa: D102


@dataclass(frozen=True)
class Agreement:
    """What a second solver said of the questions that were decided; wherever it decided, the same.

    questions: how many different ones there were.
    undecided: what each question that was beyond the second solver is about, and why it was.
    """

    solver: str
    questions: int
    undecided: tuple[tuple[str, str], ...]

    @property
    def agreed(self) -> int:
        """Of how many questions both solvers said the same."""
        return self.questions - len(self.undecided)


def agreement_on(
    questions: Iterable[Question], second: SecondSolver, progress: Callable[[str], None]
) -> Agreement:
    """What `second` says of `questions`; raises DisagreementError where it says otherwise than Z3 did.

    Questions that Z3 did not decide are left out: no verdict rests on them.
    """
    from aeros.spec.backends.z3_solver import Session, solver_version

    decided = [one for one in questions if one.answer.result is not Result.UNKNOWN]
    seen: set[str] = set()
    undecided: list[tuple[str, str]] = []
    for number, one in enumerate(decided, 1):
        progress(f"{number} of {len(decided)} questions again with {second.name}")
        script = Session(one.variables, one.ranges).script(*one.terms)
        if script in seen:
            continue
        seen.add(script)
        said = second.answer(script)
        if said.result is Result.UNKNOWN:
            undecided.append((one.about, said.reason))
        elif said.result is not one.answer.result:
            first = "AEROS, by bounds alone," if one.by_bounds else solver_version()
            answers = (
                f"{who} says {answer.result.value}"
                for who, answer in ((first, one.answer), (second.name, said))
            )
            raise DisagreementError(one.about, script, *answers)
    return Agreement(second.name, len(seen), tuple(undecided))
