"""A step that takes much longer than before is told of once, while it runs, and goes on."""

from __future__ import annotations

from math import inf

import pytest

from aeros.agent.execution.attempt import RunningAttempt
from aeros.agent.execution.report import StepRole
from aeros.agent.memory.evidence import DurationStats
from aeros.runtime.ports import EndedStep, StepStatus
from tests.unit.agent.kitchen import Kitchen

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
    notes = kitchen.note("step-overdue")
    assert notes["skill"] == "dumpling.prepare"
    assert notes["seconds"] == pytest.approx(0.3)
    assert notes["usual_seconds"] == 0.2
    assert notes["timeout_seconds"] > 1.0
    (end,) = [end for _, end in kitchen.memory.ends]
    assert end.status == StepStatus.FINISHED.value


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
    notes = [details["skill"] for kind, details in kitchen.runtime.notes if kind == "step-overdue"]
    assert sorted(notes) == ["dumpling.prepare", "dumpling.recover"]


def test_a_wait_that_is_cancelled_tells_nothing_more() -> None:
    kitchen = Kitchen()
    kitchen.memory.usual = SHORT
    started = kitchen.runner.start(StepRole.STEP, "dumpling", "prepare", {})
    assert isinstance(started, RunningAttempt)
    kitchen.runner.waiting.is_cancelled = lambda: True
    assert kitchen.runner.wait(inf) is None
    assert "step-overdue" not in kitchen.runtime.kinds()


def test_a_wait_that_ends_a_tick_early_is_not_repeated() -> None:
    kitchen = Kitchen()
    kitchen.memory.usual = SHORT
    wait, waits = kitchen.runtime.wait, []

    def wait_in_ticks(until: float = inf) -> EndedStep | None:
        waits.append(until)
        assert len(waits) < 10
        ended = wait(until)
        kitchen.runtime.clock -= 0.002 if ended is None else 0.0
        return ended

    kitchen.runtime.wait = wait_in_ticks  # type: ignore[method-assign]
    kitchen.attempt("prepare")
    assert kitchen.memory.events.count("step-overdue") == 1
