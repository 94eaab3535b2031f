"""A language model reads an instruction: every answer is checked, and a wrong one moves nothing."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import jsonschema
import pytest

from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import understand
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.proving import prove_configuration
from aeros.session.setup import declared_start
from aeros.spec.text.discovery import reference_site_path
from tests.unit.agent.instructions.lists.reference import REPOSITORY
from tests.unit.agent.reading.wrong_answers import WRONG_ANSWERS, Case, answer_of, modules_of, step
from tests.unit.agent.stub_llm import Stub, says, sends, stalls, stub

pytest.importorskip("httpx", reason="needs `pip install '.[llm]'`")

from aeros.agent.planning.llm_client import LlmEndpoint
from aeros.agent.reading.reader import MAX_TRIES, LlmReader, ModelReading, RejectedReadingError

MAKE = ["prepare", "recover", "wrap", "boil"]
GOOD: dict[str, Any] = {
    "requests": [
        {
            "task": "make_dumplings.make_dumplings",
            "arguments": {},
            "goal": "dumplings_cooked >= count",
            "condition": None,
            "plan": [step(f"make_dumplings.{skill}") for skill in MAKE],
        }
    ],
    "prohibited": [],
    "words": [{"phrase": "make dumplings", "accounts_for": "request 1"}],
}
POLITE = {**GOOD, "words": [*GOOD["words"], {"phrase": "please", "accounts_for": "courtesy"}]}


@pytest.fixture(autouse=True)
def _hardly_any_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("aeros.agent.reading.reader._RETRY_DELAY_S", 0.01)


@cache
def reference() -> Configuration:
    return prove_configuration([REPOSITORY / "ecms"], reference_site_path(), certified=True)[0]


def reader(server: Stub, case: Case | None = None, within: float = 30.0) -> LlmReader:
    site, modules = reference().site, reference().modules
    modules = modules if case is None else modules_of(case, modules, site)
    endpoint = LlmEndpoint(server.url, "stub")
    return LlmReader(
        site, modules, endpoint, within, lambda task: declared_start(site, task, modules.values())
    )


def grammar_of(instruction: str) -> Understanding | InstructionError:
    try:
        return understand(instruction, reference().modules)
    except InstructionError as refusal:
        return refusal


def refusal_of(case: Case) -> tuple[str, str]:
    """The stage at which an answer is refused or left to an operator, and the text that a person reads."""
    grammar = grammar_of(case["instruction"])
    with stub(says(answer_of(case))) as server:
        asked = reader(server, case)
        try:
            reading = asked.read(case["instruction"])
        except RejectedReadingError as refusal:
            return "reading", str(refusal)
        if isinstance(grammar, InstructionError):
            return "operator", "; ".join((str(grammar), *reading.lines))
        with pytest.raises(RejectedReadingError) as refusal_of_both:
            asked.agree(grammar, reading)
        return "agreement", str(refusal_of_both.value)


@pytest.mark.parametrize("name", WRONG_ANSWERS)
def test_a_wrong_answer_is_refused_or_left_to_an_operator_with_the_reason(name: str) -> None:
    case = WRONG_ANSWERS[name]
    stage, text = refusal_of(case)
    assert stage == case["refused_by"], text
    assert case["reason"] in text


def test_the_answers_are_wrong_in_at_least_twenty_ways_and_each_stage_refuses_some() -> None:
    assert len(WRONG_ANSWERS) >= 20
    assert {case["refused_by"] for case in WRONG_ANSWERS.values()} == {"reading", "agreement", "operator"}


def read(instruction: str, *replies: Any) -> tuple[ModelReading, LlmReader, Stub]:
    with stub(*map(says, replies)) as server:
        asked = reader(server)
        return asked.read(instruction), asked, server


def test_a_reading_that_agrees_has_the_meaning_of_the_grammar_and_the_plan_of_the_model() -> None:
    reading, asked, _ = read("please make dumplings", POLITE)
    grammar = grammar_of("please make dumplings")
    assert isinstance(grammar, Understanding)
    meaning = asked.agree(grammar, reading)
    assert meaning.formal_lines == grammar.formal_lines
    (errand,) = meaning.errands
    assert errand.proposed_plan is not None
    assert [step.skill for step in errand.proposed_plan.steps] == MAKE
    assert meaning.source == "grammar, and `stub` agrees"
    assert meaning.account == ("`make dumplings`: request 1", "`please`: courtesy")


def test_goals_need_the_same_meaning_and_not_the_same_text() -> None:
    goal = "not (make_dumplings.dumplings_cooked < count) and (dumplings_cooked > 0 or dumpling_wrapped)"
    answer = {**GOOD, "requests": [{**GOOD["requests"][0], "goal": goal}]}
    reading, asked, _ = read("make dumplings", answer)
    grammar = grammar_of("make dumplings")
    assert isinstance(grammar, Understanding)
    assert asked.agree(grammar, reading).first.task.goal_text == "dumplings_cooked >= count"


def test_the_model_gets_the_words_and_the_vocabulary_as_data_under_a_schema() -> None:
    *_, server = read("please make dumplings", POLITE)
    (asked,) = server.asked
    question = json.loads(asked["messages"][1]["content"])
    assert question["instruction"] == "please make dumplings"
    goals = {task["task"]: task["goal"] for task in question["tasks"]}
    assert goals["make_dumplings.make_dumplings"] == "dumplings_cooked >= count"
    assert question["predicates"]["make_dumplings.dumpling_cooked"] == "bool"
    assert question["start"]["make_dumplings.dumpling_cooked"] is False
    assert "make_dumplings.boil" in [skill["skill"] for skill in question["skills"]]
    schema = asked["response_format"]["json_schema"]["schema"]
    validator = jsonschema.Draft202012Validator(schema)
    assert validator.is_valid(POLITE)
    assert not validator.is_valid({**POLITE, "prohibited": ["kitchen.burn"]})
    assert not validator.is_valid({"requests": []})


def test_the_model_is_shown_its_error_and_the_next_answer_counts() -> None:
    wrong = answer_of(WRONG_ANSWERS["a goal over a name that nothing declares"])
    *_, server = read("make dumplings", wrong, GOOD)
    *_, why = server.asked[1]["messages"]
    assert "the goal of request 1 is not a condition" in json.loads(why["content"])["rejected_because"]


def test_words_without_account_are_asked_for_again_and_then_shown() -> None:
    reading, _, server = read("please make dumplings", GOOD)
    assert reading.unaccounted == ("please",)
    assert "not accounted for: `please`" in reading.lines
    assert len(server.asked) == MAX_TRIES
    assert not read("please make dumplings", GOOD, POLITE)[0].unaccounted


def test_a_goal_of_its_own_is_a_reading_that_names_its_source_after_confirmation() -> None:
    wrapped = {
        **GOOD["requests"][0],
        "goal": "dumpling_wrapped and not dumpling_cooked",
        "plan": [step(f"make_dumplings.{skill}") for skill in MAKE[:3]],
    }
    words = [{"phrase": "fold me a raw one", "accounts_for": "request 1"}]
    reading, asked, _ = read("fold me a raw one", {**GOOD, "requests": [wrapped], "words": words})
    meaning = asked.confirmed(reading, "the operator at the terminal")
    assert meaning.source == "`stub`, confirmed by the operator at the terminal"
    assert meaning.first.task.goal_text == (
        "make_dumplings.dumpling_wrapped and (not make_dumplings.dumpling_cooked)"
    )
    assert meaning.first.task.rules == ()


@pytest.mark.parametrize(
    ("reply", "reason", "tries"),
    [
        (sends(500), "its server answers with status 500", MAX_TRIES),
        (sends(401), "its server answers with status 401", 1),
        (stalls, "it has not answered in time", 1),
    ],
)
def test_without_an_answer_nothing_moves(reply: Any, reason: str, tries: int) -> None:
    with stub(reply) as server, pytest.raises(RejectedReadingError, match="so nothing moves") as refusal:
        reader(server, within=1.0 if reply is stalls else 30.0).read("make dumplings")
    assert reason in str(refusal.value)
    assert len(server.asked) == tries
