"""A step is cleaned up exactly once, for every way in which it ends."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import Any

import pytest

from aeros.runtime.audit.log import AuditError
from aeros.runtime.ports import EndedStep, StepRequest, StepResult, StepStatus
from aeros.skill import Inputs, Observation, SkillBody, act
from aeros.spec.diagnostics.errors import MisuseError
from tests.unit.runtime.one_step import DENIAL, MakeBench, watched
from tests.unit.runtime.together import Asking, MakeCart, asking, move, roll


def test_clean_up_that_raises_is_reported_and_stops_nothing_else(make_bench: MakeBench) -> None:
    def stubborn(observed: Observation, inputs: Inputs) -> SkillBody:
        try:
            yield act("move")
        finally:
            raise ValueError("mine")

    bench = make_bench(stubborn)
    bench.gate.answers = [DENIAL]
    result = bench.submit()
    assert result.status is StepStatus.DENIED
    assert result.reason.endswith("and then its code raised test_clean_up.py:24: ValueError: mine")
    bench.assert_cleaned_up(finished=False)


def test_a_step_that_is_cancelled_comes_to_rest_and_the_other_goes_on(
    cart: MakeCart, monkeypatch: pytest.MonkeyPatch
) -> None:
    ends: list[str] = []
    one = cart(reach=asking(move(), move(), ends=ends, name="reach"), drive=asking(roll(), roll()))
    reach, drive = one.start("reach"), one.start("drive")
    assert one.executor.wait(0.05) is None
    halted: list[int] = []
    monkeypatch.setattr(one.executor._pipeline.monitors.tracker, "halt", halted.append)
    one.executor.cancel(reach, "not wanted")
    one.executor.cancel(reach, "not wanted at all")
    assert one.executor.wait() == EndedStep(reach, StepResult(StepStatus.CANCELLED, "not wanted", allowed=1))
    assert ends == ["reach"]
    assert one.calls("halt") == [1]
    assert halted == [one.records("decision")[0]["sequence"]]  # its path is not compared while it brakes
    assert [(stop["reason"], stop["skill"]) for stop in one.records("stopped")] == [("not wanted", "reach")]
    assert one.plant.call_count("stop") == 0
    assert one.executor.wait() == EndedStep(drive, StepResult(StepStatus.FINISHED, "", allowed=2))
    one.executor.cancel(reach, "it has ended")
    one.assert_nothing_is_held()


def test_a_step_that_never_began_is_cancelled_without_a_trace_on_the_plant(cart: MakeCart) -> None:
    one = cart(reach=asking(move()))
    first, second = one.start("reach"), one.start("reach")
    assert one.executor.wait(0.05) is None
    one.executor.cancel(second, "not wanted")
    assert one.ends(1) == {second: StepResult(StepStatus.CANCELLED, "not wanted")}
    assert one.ends(1)[first].status is StepStatus.FINISHED
    assert one.calls("skill_began") == ["cart.reach"]
    assert [one["reason"] for one in one.records("step-refused")] == ["not wanted"]


def test_a_protective_stop_that_a_skill_asks_for_ends_what_the_others_move(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll()), look=asking(act("stop")))
    reach, drive = one.start("reach"), one.start("drive")
    assert one.executor.wait(0.05) is None
    assert one.executor.run_step(StepRequest("cart", "look", {})).status is StepStatus.FINISHED
    results = one.ends(2)
    assert "beside" not in one.records("decision")[-1]
    assert inf in one.calls("advance")  # until the robot is at rest
    (stop,) = one.records("stopped")
    assert stop["reason"] == "stopped for `cart.look`, which asked for a protective stop"
    for step in (reach, drive):
        assert results[step].status is StepStatus.STOPPED
        assert "which asked for a protective stop" in results[step].reason
    assert one.plant.call_count("halt") == 0
    one.assert_nothing_is_held()


def _raising(observed: Observation, inputs: Inputs) -> SkillBody:
    yield move()
    raise ValueError("no")


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (asking(move()), StepStatus.FINISHED),
        (asking(move(), roll()), StepStatus.DENIED),
        (_raising, StepStatus.RAISED),
        (asking(*[move()] * 500), StepStatus.TIMED_OUT),
        (asking(act("fly")), StepStatus.DENIED),
    ],
)
def test_resources_of_an_ended_step_are_free_for_the_next(
    cart: MakeCart, body: Asking, status: StepStatus
) -> None:
    one = cart(reach=body)
    first, second = one.start("reach"), one.start("reach")
    results = one.ends(2)
    assert (results[first].status, results[second].status) == (status, status)
    one.assert_nothing_is_held()
    assert one.calls("skill_ended") == [("cart.reach", status is StepStatus.FINISHED)] * 2


@pytest.mark.parametrize("failure", [OSError("link lost"), KeyboardInterrupt()])
@pytest.mark.parametrize("method", ["advance", "begin", "observe"])
def test_where_something_breaks_every_step_is_cleaned_up_once(
    cart: MakeCart, monkeypatch: pytest.MonkeyPatch, method: str, failure: BaseException
) -> None:
    ends: list[str] = []
    one = cart(
        reach=asking(move(), move(), ends=ends, name="reach"),
        drive=asking(roll(), roll(), ends=ends, name="drive"),
    )
    one.plant.durations = [1.0, 2.0]
    stop = one.plant.stop

    def stop_and_move() -> None:
        stop()
        one.plant.values["hand"] = 0.25

    monkeypatch.setattr(one.plant, "stop", stop_and_move)
    one.start("reach")
    one.start("drive")
    waiting = one.start("reach")
    assert one.executor.wait(0.5) is None
    one.plant.failing[method] = failure
    with pytest.raises(type(failure)):
        one.executor.wait()
    assert sorted(ends) == ["drive", "reach"]
    assert one.plant.call_count("stop") == 1
    assert one.calls("skill_ended") == [("cart.reach", False), ("cart.drive", False)]
    assert len(one.records("step-broken")) == 3
    if method != "observe":  # it is measured before and after the plant is told to stop
        (stopped,) = one.records("stopped")
        hand = {"least": 0.0, "greatest": 0.25, "unit": "m"}
        assert (stopped["ticks"], stopped["quantities"]["hand"]) == (2, hand)
    one.assert_nothing_is_held()
    one.executor.cancel(waiting, "it is gone")
    with pytest.raises(MisuseError):
        one.executor.wait()


def test_steps_that_are_left_behind_are_cleaned_up(cart: MakeCart) -> None:
    ends: list[str] = []
    one = cart(reach=asking(move(), ends=ends), drive=asking(roll(), ends=ends))
    with one.executor:
        one.start("reach")
        one.start("drive")
        assert one.executor.wait(0.05) is None
    assert len(ends) == 2
    assert one.plant.call_count("stop") == 1
    one.assert_nothing_is_held()


def test_without_a_record_nothing_moves(make_bench: MakeBench, monkeypatch: pytest.MonkeyPatch) -> None:
    ends: list[str] = []
    bench = make_bench(watched(ends))
    append = bench.audit.append

    def broken(event: str, details: Mapping[str, Any]) -> int:
        if event == "step-began":
            return append(event, details)
        raise AuditError("disk full")

    monkeypatch.setattr(bench.audit, "append", broken)
    with pytest.raises(AuditError, match="disk full") as caught:
        bench.submit()
    assert caught.value.__notes__ == ["the end of the step is not in the record: disk full"]
    assert (bench.plant.executed, ends) == ([], ["closed"])
    bench.assert_cleaned_up(finished=False)


def test_a_stop_that_cannot_be_recorded_hides_no_failure(
    cart: MakeCart, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = cart(reach=asking(move()))
    one.start("reach")
    assert one.executor.wait(0.05) is None
    append = one.audit.append

    def full(event: str, details: Mapping[str, Any]) -> int:
        if event == "stopped":
            raise AuditError("disk full")
        return append(event, details)

    monkeypatch.setattr(one.audit, "append", full)
    one.plant.failing["advance"] = OSError("link lost")
    with pytest.raises(OSError, match="link lost"):
        one.executor.wait()
    assert [broken["reason"] for broken in one.records("step-broken")] == ["OSError: link lost"]


def test_a_step_leaves_whole_records_of_its_beginning_and_its_end(cart: MakeCart) -> None:
    one = cart(reach=asking(move()))
    one.plant.time = 2.5
    one.start("reach")
    one.ends(1)
    caller = {"module": "cart", "skill": "reach", "inputs": {}}
    (began,), (ended,) = one.records("step-began"), one.records("step-ended")
    assert began == {"time": 2.5, "deadline": 12.5, **caller, "sequence": began["sequence"]}
    end = {"time": 2.6, "status": "finished", "reason": "", **caller}
    assert ended == {**end, "sequence": ended["sequence"]}
