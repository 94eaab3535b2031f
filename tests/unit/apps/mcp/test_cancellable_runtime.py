"""A runtime whose plan another thread can cancel, while steps run, while none runs, and before any."""

from __future__ import annotations

from math import inf

import pytest

from aeros.apps.mcp.cancellable_runtime import CancellableRuntime
from aeros.runtime.ports import EndedStep, StepHandle, StepRequest, StepResult, StepStatus
from aeros.spec.diagnostics.errors import MisuseError
from tests.unit.agent.fake_runtime import FakeRuntime

REQUEST = StepRequest("dumpling", "prepare", {})


class SlowRuntime(FakeRuntime):
    """Steps take two seconds; a cancelled step ends at once."""

    def __init__(self) -> None:
        super().__init__()
        self.ends: dict[StepHandle, float] = {}
        self.turns: list[float] = []

    def start(self, request: StepRequest) -> StepHandle | StepResult:
        step = StepHandle(len(self.ends))
        self.ends[step] = self.now() + 2.0
        return step

    def advance_once(self, until: float) -> EndedStep | None:
        for step, reason in self.cancelled.items():
            if step in self.ends:
                del self.ends[step]
                return EndedStep(step, StepResult(StepStatus.CANCELLED, reason))
        step, end = min(self.ends.items(), key=lambda one: one[1])
        self.turns.append(until - self.now())
        self.clock = min(until, end)
        if end <= until:
            del self.ends[step]
            return EndedStep(step, StepResult(StepStatus.FINISHED, ""))
        return None

    def wait(self, until: float = inf) -> EndedStep | None:
        if until == inf:
            raise MisuseError("no step was started, so none can end")
        self.turns.append(until - self.now())
        self.clock = until
        return None

    def now(self) -> float:
        return self.clock

    def cancel(self, step: StepHandle, reason: str) -> None:
        self.cancelled[step] = reason


class Reason:
    """The reason of a cancellation from some plant time on."""

    def __init__(self, runtime: SlowRuntime, since: float) -> None:
        self.runtime, self.since = runtime, since

    def __call__(self) -> str | None:
        return "by c" if self.runtime.now() >= self.since else None


def test_a_step_that_nobody_cancels_ends_as_ever() -> None:
    slow = SlowRuntime()
    runtime = CancellableRuntime(slow, lambda: None)
    step = runtime.start(REQUEST)
    assert runtime.wait(101.0) is None
    assert runtime.wait() == EndedStep(step, StepResult(StepStatus.FINISHED, ""))  # type: ignore[arg-type]
    assert runtime.now() == pytest.approx(102.0)
    assert max(slow.turns) <= 0.05 + 1e-9
    assert not runtime.is_stopped


def test_a_cancellation_ends_every_step_within_a_turn_and_lets_none_begin() -> None:
    slow = SlowRuntime()
    runtime = CancellableRuntime(slow, Reason(slow, 100.5))
    steps = [runtime.start(REQUEST), runtime.start(REQUEST)]
    ended = [one for one in (runtime.wait(), runtime.wait()) if one is not None]
    assert sorted(one.step for one in ended) == steps
    assert [one.result for one in ended] == [StepResult(StepStatus.CANCELLED, "by c")] * 2
    assert runtime.now() <= 100.6
    assert runtime.start(REQUEST) == StepResult(StepStatus.CANCELLED, "by c")
    assert runtime.is_stopped


def test_waiting_without_steps_ends_with_a_cancellation() -> None:
    slow = SlowRuntime()
    runtime = CancellableRuntime(slow, Reason(slow, 105.0))
    assert runtime.wait(103.5) is None
    assert runtime.now() == 103.5
    assert runtime.wait(200.0) is None
    assert runtime.now() <= 106.0
    assert max(slow.turns) <= 1.0


def test_waiting_without_steps_or_an_end_is_misuse() -> None:
    with pytest.raises(MisuseError, match="no step was started"):
        CancellableRuntime(SlowRuntime(), lambda: None).wait()


def test_all_else_is_the_wrapped_runtimes() -> None:
    slow = SlowRuntime()
    runtime = CancellableRuntime(slow, lambda: None)
    runtime.note("x", {"y": 1})
    assert slow.notes == [("x", {"y": 1})]
    assert runtime.site is slow.site
    assert runtime.active_modules() == slow.active_modules()
    assert runtime.log_head() == slow.log_head()
    assert runtime.observe() == slow.observe()
