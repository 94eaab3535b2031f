"""Questions asked together have the answers of each asked alone, and models that the definition confirms."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.backends.solver_results import Question, SatResult
from aeros.spec.backends.z3_group import answer_together
from aeros.spec.backends.z3_solver import IncrementalSolver
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.random_conditions import Ranges, conditions, vocabulary_ranges
from aeros.spec.expr.random_terms import VARIABLES
from aeros.spec.expr.semantics import is_true
from tests.hypothesis_profiles import examples

RLIMIT = 2_000_000


@examples(60)
@given(
    st.lists(
        st.tuples(st.lists(conditions(), min_size=1, max_size=3), vocabulary_ranges()), min_size=1, max_size=5
    )
)
def test_a_group_never_contradicts_the_solver_or_the_definition(
    drawn: list[tuple[list[t.Term], Ranges]],
) -> None:
    questions = [Question(list(VARIABLES.values()), ranges, terms) for terms, ranges in drawn]
    for question, answer in zip(questions, answer_together(questions, RLIMIT, 10.0), strict=True):
        alone = IncrementalSolver(question.variables, question.ranges, RLIMIT).check_sat(*question.terms)
        if answer is None:
            continue
        assert alone.result in (answer.result, SatResult.UNKNOWN)
        if answer.result is SatResult.SAT and all(
            is_true(lower(term), alone.model) for term in question.terms if alone.model
        ):
            assert all(is_true(lower(term), answer.model) for term in question.terms)
