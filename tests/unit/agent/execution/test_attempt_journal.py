"""Each attempt leaves entries that say what was chosen, how it did before, and how it came out."""

from __future__ import annotations

from math import inf

import pytest

from aeros.agent.execution.attempt import RunningAttempt
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
from tests.unit.agent.kitchen import Kitchen

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


# Steps that take much longer than before, which go on.

# In this kitchen a step takes one second.
SHORT = DurationStats(0.2, 0.2, 0.2, 8)


def _attempt(*usual: DurationStats) -> Kitchen:
    kitchen = Kitchen()
    kitchen.memory.usual = next(iter(usual), None)
    kitchen.attempt("prepare")
    return kitchen


def test_it_is_recorded_once_and_the_step_goes_on() -> None:
    kitchen = _attempt(SHORT)
    assert kitchen.memory.events.count("step-overdue") == 1
    recorded = kitchen.note("step-overdue")
    assert recorded["skill"] == "dumpling.prepare"
    assert recorded["seconds"] == pytest.approx(0.3)
    assert recorded["usual_seconds"] == 0.2
    assert recorded["timeout_seconds"] > 1.0
    (end,) = [end for _, end in kitchen.memory.ends]
    assert end.status == StepStatus.FINISHED.value


def test_a_wait_that_ends_a_little_early_is_no_endless_one() -> None:
    kitchen = Kitchen()
    kitchen.memory.usual = SHORT
    kitchen.runtime.early = 0.004
    kitchen.attempt("prepare")
    assert kitchen.memory.events.count("step-overdue") == 1


@pytest.mark.parametrize(
    "usual",
    [
        [],
        [DurationStats(0.2, 0.2, 0.2, 7)],  # too few to tell
        [DurationStats(0.2, 0.1, 0.5, 8)],  # 0.5 s + 3 * 0.4 s
        [DurationStats(0.7, 0.7, 0.7, 8)],  # half as long again
    ],
)
def test_nothing_is_recorded_of_what_is_usual(usual: list[DurationStats]) -> None:
    assert "step-overdue" not in _attempt(*usual).runtime.kinds()


def test_each_of_two_steps_is_recorded() -> None:
    kitchen = Kitchen()
    kitchen.memory.usual = SHORT
    started = [kitchen.runner.start(StepRole.STEP, "dumpling", skill, {}) for skill in ("prepare", "recover")]
    for _ in started:
        ended = kitchen.runner.wait(inf)
        assert ended is not None
        (one,) = [one for one in started if isinstance(one, RunningAttempt) and one.handle == ended.step]
        kitchen.runner.finish(one.pending, ended.result)
    recorded = [details["skill"] for kind, details in kitchen.runtime.notes if kind == "step-overdue"]
    assert sorted(recorded) == ["dumpling.prepare", "dumpling.recover"]


def test_nothing_is_recorded_in_a_cancelled_wait() -> None:
    kitchen = Kitchen()
    kitchen.memory.usual = SHORT
    started = kitchen.runner.start(StepRole.STEP, "dumpling", "prepare", {})
    assert isinstance(started, RunningAttempt)
    kitchen.runner.waiting.is_cancelled = lambda: True
    assert kitchen.runner.wait(inf) is None
    assert "step-overdue" not in kitchen.runtime.kinds()
