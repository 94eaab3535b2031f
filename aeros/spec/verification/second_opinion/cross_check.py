"""Cross-check of every query of a run by a second solver, so that verdicts do not rest on one solver alone.

The second solver gets the query as text that is written from the definition of the language, by code that the
translation to Z3 does not share.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from aeros.spec.backends.lemmas import relating_lemmas
from aeros.spec.backends.oracle import SolverQuery
from aeros.spec.backends.smtlib import question_script
from aeros.spec.backends.solver_results import Question, SatResult, SecondSolver, SolverAnswer
from aeros.spec.backends.violation_search import search
from aeros.spec.diagnostics.errors import DisagreementError
from aeros.spec.expr import terms as t


@dataclass(frozen=True)
class SecondSolverReport:
    """Result of a cross-check; wherever the second solver decided a query, it agreed.

    Attributes:
        solver: name and version of the second solver.
        query_count: number of different queries that Z3 decided.
        undecided_queries: description of each query that the second solver did not decide, and the reason.
    """

    solver: str
    query_count: int
    undecided_queries: tuple[tuple[str, str], ...]

    @property
    def agreed_count(self) -> int:
        """The number of queries that both solvers decided, in the same way."""
        return self.query_count - len(self.undecided_queries)


def cross_check_queries(
    queries: Iterable[SolverQuery], second: SecondSolver, progress: Callable[[str], None]
) -> SecondSolverReport:
    """Put each decided query to a second solver.

    Queries that Z3 did not decide are left out: no verdict rests on them.

    Args:
        queries: queries of a run with their answers.
        second: the second solver.
        progress: called with a line of text before each query.

    Returns:
        The result.

    Raises:
        DisagreementError: the second solver decides a query otherwise.
    """
    from aeros.spec.backends.z3_solver import solver_version

    decided = [one for one in queries if one.answer.result is not SatResult.UNKNOWN]
    seen: set[str] = set()
    undecided: list[tuple[str, str]] = []
    for number, one in enumerate(decided, 1):
        progress(f"{number} of {len(decided)} questions again with {second.name}")
        script = question_script(one.question)
        if script in seen:
            continue
        seen.add(script)
        script, second_answer = _ask(one.question, script, second)
        if second_answer.result is SatResult.UNKNOWN:
            undecided.append((one.description, second_answer.reason))
        elif second_answer.result is not one.answer.result:
            answers = (
                f"{who} says {answer.result.value}"
                for who, answer in ((solver_version(), one.answer), (second.name, second_answer))
            )
            raise DisagreementError(one.description, script, *answers)
    return SecondSolverReport(second.name, len(seen), tuple(undecided))


def _ask(question: Question, plain: str, second: SecondSolver) -> tuple[str, SolverAnswer]:
    """Ask a question, beside lemmas where products or counts call for some."""
    lemmas = relating_lemmas(question.terms, question.ranges)
    if not lemmas:
        return plain, second.solve_script(plain)
    script, answer = _answer_with_lemmas(question, lemmas, second)
    if answer.result is SatResult.UNKNOWN and (near := search(question).nearest):
        return _answer_with_lemmas(question, relating_lemmas(question.terms, question.ranges, near), second)
    return script, answer


def _answer_with_lemmas(
    question: Question, lemmas: Sequence[t.Term], second: SecondSolver
) -> tuple[str, SolverAnswer]:
    script = question_script(question._replace(terms=(*question.terms, *lemmas)))
    return script, second.solve_script(script)
