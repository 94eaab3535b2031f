"""A model's answer becomes a meaning only if every part of it passes the checks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from aeros.agent.reading.answer import AnsweredRequest, ModelAnswer
from aeros.agent.reading.formal_meaning import FormalMeaning, UnacceptableAnswerError
from aeros.spec.backends.oracle import Oracle
from aeros.spec.model.ecm import Task
from tests.unit.agent.dumplings import CLEAN, DUMPLING, PREDICATES, site
from tests.unit.agent.reading.wrong_answers import step

PLAN = [step(f"dumpling.{skill}") for skill in ("prepare", "recover", "wrap", "boil")]
MAKE = "dumpling.make_dumplings"


def start(_task: Task) -> Mapping[str, Any]:
    return {**dict.fromkeys(PREDICATES, False), "area": "pot"}


def meaning_of(*requests: AnsweredRequest, prohibited: tuple[str, ...] = ()) -> Any:
    formal = FormalMeaning(site(), {"dumpling": DUMPLING, "clean": CLEAN}, start, Oracle())
    return formal.meaning_of("words", ModelAnswer(requests, prohibited, ()))


def problem_of(*requests: AnsweredRequest, prohibited: tuple[str, ...] = ()) -> str:
    with pytest.raises(UnacceptableAnswerError) as refusal:
        meaning_of(*requests, prohibited=prohibited)
    return str(refusal.value)


def test_an_equivalent_goal_is_that_of_the_task_with_its_rules() -> None:
    request = AnsweredRequest(MAKE, (), "not not dumpling_cooked", "not wrapper_aligned", PLAN)
    meaning = meaning_of(request, prohibited=("clean.clean_table", "clean.clean_table"))
    (errand,) = meaning.errands
    assert errand.routed.task is DUMPLING.tasks["make_dumplings"]
    assert errand.condition_text == "not wrapper_aligned"
    assert [str(one) for one in meaning.prohibited] == ["clean.clean_table"]


def test_another_goal_is_shown_as_the_checker_reads_it_and_has_no_rules() -> None:
    meaning = meaning_of(AnsweredRequest(MAKE, (), "dumpling_wrapped   and true", None, PLAN[:3]))
    (errand,) = meaning.errands
    assert "   " not in errand.routed.task.goal_text
    assert errand.routed.task.rules == ()


@pytest.mark.parametrize(
    ("request_", "problem"),
    [
        (AnsweredRequest("dumpling.make", (), "dumpling_cooked", None, PLAN), "has the task `dumpling.make`"),
        (AnsweredRequest(MAKE, (), "once dumpling_cooked", None, PLAN), "the goal of request 1 is"),
        (AnsweredRequest(MAKE, (), "1 +", None, PLAN), "the goal of request 1 is not a condition"),
        (AnsweredRequest(MAKE, (), "fill_level", None, PLAN), "the goal of request 1 is not a condition"),
        (AnsweredRequest(MAKE, (), "fill_level <= 1", None, PLAN), "the goal of request 1 always holds"),
        (AnsweredRequest(MAKE, (), "fill_level > 1", None, PLAN), "the goal of request 1 never holds"),
        (AnsweredRequest(MAKE, (), "not dumpling_cooked", None, PLAN), "holds already at the declared start"),
        (
            AnsweredRequest(MAKE, (), "dumpling_cooked", "true", PLAN),
            "the condition of request 1 always holds",
        ),
        (AnsweredRequest(MAKE, (), "dumpling_cooked", "x", PLAN), "the condition of request 1 is not"),
        (AnsweredRequest(MAKE, (), "dumpling_cooked", None, {}), "`plan` is not a list of steps"),
        (AnsweredRequest(MAKE, (), "dumpling_cooked", None, []), "the plan of request 1: the plan is empty"),
        (AnsweredRequest(MAKE, (), "dumpling_cooked", None, PLAN[:3]), "it ends, and the goal does not hold"),
    ],
)
def test_each_check_refuses_with_its_reason(request_: AnsweredRequest, problem: str) -> None:
    assert problem in problem_of(request_)


def test_prohibitions_are_of_declared_tasks_and_bar_their_skills() -> None:
    request = AnsweredRequest(MAKE, (), "dumpling_cooked", None, PLAN)
    assert "has the task `clean.clean`" in problem_of(request, prohibited=("clean.clean",))
    assert "is asked for and prohibited" in problem_of(request, prohibited=(MAKE,))
    assert "reads no request" in problem_of(prohibited=(MAKE,))


def test_otherwise_is_the_opposite_of_the_condition_before() -> None:
    first = AnsweredRequest(MAKE, (), "dumpling_cooked", "not wrapper_aligned", PLAN)
    other = AnsweredRequest(MAKE, (), "dumpling_wrapped", "otherwise", PLAN[:3])
    errand = meaning_of(first, other).errands[1]
    assert (errand.condition_text, errand.is_otherwise) == ("not (not wrapper_aligned)", True)
    assert "request 1 has no request with a condition" in problem_of(other)
    assert "request 3 has no request with a condition" in problem_of(first, other, other)
