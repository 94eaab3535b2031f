from __future__ import annotations

import pytest

from aeros.spec.backends.oracle import Oracle
from aeros.spec.backends.solver_results import SatResult, SolverAnswer
from aeros.spec.diagnostics.errors import DisagreementError
from aeros.spec.verification.second_opinion.cross_check import cross_check_queries
from tests.unit.spec.verification.second_opinion.queries import RANGES, X, above, question


class Scripted:
    """Gives the next of its answers to each script it is asked."""

    name = "another"

    def __init__(self, *results: SatResult) -> None:
        self.results = list(results)
        self.asked: list[str] = []

    def solve_script(self, script: str) -> SolverAnswer:
        self.asked.append(script)
        return SolverAnswer(self.results.pop(0), {}, "why not")


def test_a_query_is_checked_once_and_an_undecided_one_never() -> None:
    second = Scripted(SatResult.SAT, SatResult.UNKNOWN)
    asked = [
        question(3, SatResult.SAT), question(3, SatResult.SAT), question(4, SatResult.UNKNOWN),
        question(11, SatResult.UNSAT),
    ]  # fmt: skip
    progress: list[str] = []
    found = cross_check_queries(asked, second, progress.append)
    assert len(second.asked) == 2
    assert (found.query_count, found.agreed_count) == (2, 1)
    assert found.undecided_queries == (("x > 11", "why not"),)
    assert progress[-1] == "3 of 3 questions again with another"


@pytest.mark.parametrize(
    ("bound", "first", "second"), [(3, SatResult.SAT, SatResult.UNSAT), (11, SatResult.UNSAT, SatResult.SAT)]
)
def test_a_disagreement_names_the_query_and_both_answers(
    bound: int, first: SatResult, second: SatResult
) -> None:
    with pytest.raises(DisagreementError) as raised:
        cross_check_queries([question(bound, first)], Scripted(second), lambda _: None)
    assert raised.value.about == f"x > {bound}"
    assert raised.value.script.endswith("(check-sat)\n")
    one, other = raised.value.answers
    assert one.endswith(f"says {first.value}")
    assert other == f"another says {second.value}"


def test_an_oracle_records_queries_on_request_with_a_reduced_budget_too() -> None:
    recording, silent = Oracle(recording=True), Oracle()
    for oracle in (recording, silent):
        oracle.check_sat([X], RANGES, [above(3)], "a claim")
        oracle.check_sat([X], RANGES, [above(3)], "the same again")
        oracle.with_reduced_budget(10).check_sat([X], RANGES, [above(11)])
    assert [(one.description, one.answer.result) for one in recording.asked.values()] == [
        ("a claim", SatResult.SAT), ("an explanation", SatResult.UNSAT)
    ]  # fmt: skip
    assert silent.asked == {}
