"""Each attempt leaves entries that say what was chosen, how it did before, and how it came out."""

from __future__ import annotations

import pytest

from aeros.agent.execution.attempt_journal import (
    record_end,
    record_not_started,
    record_provider_choice,
    record_start,
    record_unmet_definitions,
)
from aeros.agent.execution.dispatcher import Dispatch
from aeros.agent.execution.journal import AgentEvent, Journal
from aeros.agent.execution.provider_choice import ProviderChoice, ProviderOption
from aeros.agent.execution.report import StepRole
from aeros.agent.execution.supervisor import StepAssessment
from aeros.agent.memory.evidence import DurationStats
from aeros.agent.memory.posterior import RecentRecord, SuccessRecord
from aeros.runtime.ports import StepRequest, StepResult, StepStatus
from aeros.spec.model.cause import Cause
from tests.differential.real_loop import Forgetful
from tests.unit.agent.dumplings import outcome, skill
from tests.unit.agent.fake_runtime import FakeRuntime

_RECORD = SuccessRecord(3, 1)
_STEAM = skill("steam", outcome("hot", {}))


@pytest.fixture
def events() -> list[AgentEvent]:
    return []


@pytest.fixture
def journal(events: list[AgentEvent]) -> Journal:
    return Journal(FakeRuntime(), Forgetful(), events.append)


def _dispatch(*options: ProviderOption, usual: DurationStats | None = None) -> Dispatch:
    choice = ProviderChoice(options, 0, "it is best")
    return Dispatch(StepRequest("kitchen", "steam", {}), _STEAM, '{"lid": true}', _RECORD, usual, choice)


def test_a_choice_is_recorded_with_its_options_and_a_named_skill_is_no_choice(
    journal: Journal, events: list[AgentEvent]
) -> None:
    record_provider_choice(journal, "kitchen", "steam", _dispatch())
    assert events == []
    option = ProviderOption("steam", _RECORD, RecentRecord(2.5, 0.5), 8.0, "", 0.75, 30.0)
    record_provider_choice(journal, "kitchen", "heat", _dispatch(option))
    (chosen,) = events
    assert chosen.text.startswith("`steam` for kitchen.heat (it is best): `steam`")
    assert chosen.details["context"] == {"lid": True}
    (listed,) = chosen.details["options"]
    assert listed == {
        "skill": "steam",
        "record": {"successes": 3, "failures": 1},
        "recent": {"successes": 2.5, "failures": 0.5},
        "usual_seconds": 8.0,
        "expected_seconds": 30.0,
        "wear_seconds": 0.0,
        "drawn": 0.75,
        "why_not": "",
    }


def test_a_start_says_how_the_skill_did_before(journal: Journal, events: list[AgentEvent]) -> None:
    record_start(journal, StepRole.STEP, _dispatch(usual=DurationStats(8.0, 7.0, 9.0, 3)), {"level": 2})
    (began,) = events
    assert began.text == "step kitchen.steam (before: 3 of 4 succeeded in about 8 s)"
    assert (began.details["inputs"], began.details["usual_seconds"]) == ({"level": 2}, 8.0)


def test_an_end_says_the_outcome_or_why_it_failed(journal: Journal, events: list[AgentEvent]) -> None:
    finished = StepResult(StepStatus.FINISHED, "")
    record_end(journal, StepRole.RETRY, _dispatch(), finished, StepAssessment("hot", False, False, ""))
    record_end(journal, StepRole.RETRY, _dispatch(), finished, StepAssessment(None, True, True, "it is cold"))
    assert [one.text for one in events] == [
        "retry kitchen.steam: outcome `hot`",
        "retry kitchen.steam: it is cold",
    ]


def test_a_step_that_did_not_start_is_recorded_with_its_causes(
    journal: Journal, events: list[AgentEvent]
) -> None:
    record_not_started(
        journal, StepRole.STEP, "kitchen.steam", "no water", (Cause("input", "water", "no water"),)
    )
    (refused,) = events
    assert refused.text == "step kitchen.steam: no water"
    assert [cause["kind"] for cause in refused.details["causes"]] == ["input"]


def test_a_goal_by_definition_is_recorded_with_its_values_and_another_is_not(
    journal: Journal, events: list[AgentEvent]
) -> None:
    record_unmet_definitions(journal, "kitchen.cook", ())
    assert events == []
    record_unmet_definitions(journal, "kitchen.cook", (Cause("definition", "hot", "heat > 3"),))
    (noted,) = events
    assert (noted.kind, noted.details["task"]) == ("goal-unmet", "kitchen.cook")
    assert noted.text == "kitchen.cook: by definition of hot: heat > 3"
    assert noted.details["causes"][0]["kind"] == "definition"
