"""Several steps under way: who acts when, and what an end leaves alone."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from math import nan
from typing import Any

import pytest

from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.ports import EndedStep, StepRequest, StepResult, StepStatus
from aeros.skill import Inputs, Observation, SkillBody, act
from aeros.spec.diagnostics.errors import MisuseError
from tests.unit.runtime.together import Asking, MakeCart, asking, configuration, move, roll

FINISHED = StepStatus.FINISHED


class Operator:
    """A governor in the test's hands."""

    def __init__(self) -> None:
        self.generation = 0
        self.command = OperatorCommand.RUN
        self.revoked: set[str] = set()
        self.in_force = configuration()
        self.held = 0

    def configuration(self) -> tuple[int, Configuration]:
        return self.generation, self.in_force

    def hold_generation(self, generation: int) -> AbstractContextManager[bool]:
        return nullcontext(generation == self.generation)

    def revocation_reason(self, module: str, skill: str, kind: str) -> str | None:
        return "the test says so" if skill in self.revoked else None


# Who acts when.


def test_two_skills_act_in_turn_as_their_motions_end(cart: MakeCart) -> None:
    one = cart(reach=asking(move(), move(), move()), drive=asking(roll(), roll()))
    one.plant.durations = [1.0, 1.75, 1.0, 1.75, 1.0]
    reach, drive = one.start("reach"), one.start("drive")
    assert one.executor.wait() == EndedStep(reach, StepResult(FINISHED, "", allowed=3))
    assert one.plant.time == 3.0
    assert one.executor.wait() == EndedStep(drive, StepResult(FINISHED, "", allowed=2))
    assert one.begun() == ["move", "roll", "move", "roll", "move"]
    assert one.plant.call_count("stop") == 0
    assert one.calls("skill_ended") == [("cart.reach", True), ("cart.drive", True)]


def test_a_decision_names_the_decisions_on_what_was_under_way(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll()), look=asking(act("wait", duration=1.0)))
    for skill in ("reach", "drive"):
        one.start(skill)
    one.ends(2)
    first, second = one.records("decision")
    assert "beside" not in first
    assert second["beside"] == [first["sequence"]]


def test_who_needs_what_another_holds_waits_its_turn(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll()))
    first, second, third = one.start("reach"), one.start("reach"), one.start("drive")
    assert [one.executor.wait(), one.executor.wait(), one.executor.wait()] == [
        EndedStep(step, StepResult(FINISHED, "", allowed=1)) for step in (first, second, third)
    ]
    # The third would have had all it needs at once, and one thing that the second waited for.
    assert one.calls("skill_began") == ["cart.reach", "cart.reach", "cart.drive"]
    one.assert_nothing_is_held()


def test_a_time_out_runs_from_when_a_step_begins_and_not_from_when_it_was_asked_for(cart: MakeCart) -> None:
    one = cart(reach=asking(move()))
    one.plant.duration = 8.0
    one.start("reach")
    one.start("reach")
    assert [result.status for result in one.ends(2).values()] == [FINISHED, FINISHED]


def test_what_is_waited_for_may_not_come_in_time(cart: MakeCart) -> None:
    one = cart(reach=asking(move()))
    one.plant.duration = 4.0
    reach = one.start("reach")
    assert one.executor.wait(3.0) is None
    assert one.plant.time == 3.0
    assert one.executor.wait(3.0) is None
    assert one.executor.wait(5.0) == EndedStep(reach, StepResult(FINISHED, "", allowed=1))


def test_waiting_for_nothing_is_a_mistake(cart: MakeCart) -> None:
    with pytest.raises(MisuseError):
        cart().executor.wait()


def test_waiting_for_a_time_lets_it_come_where_nothing_was_started(cart: MakeCart) -> None:
    one = cart()
    assert one.executor.wait(2.5) is None
    assert one.plant.time == 2.5


def test_one_step_can_be_waited_for_while_another_goes_on(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll(), roll()))
    drive = one.start("drive")
    assert one.executor.run_step(StepRequest("cart", "reach", {})).status is FINISHED
    assert one.executor.wait() == EndedStep(drive, StepResult(FINISHED, "", allowed=2))


# What happens while both are under way.


def test_what_both_obeyed_and_break_at_a_tick_is_a_protective_stop_of_both(cart: MakeCart) -> None:
    ends: list[str] = []
    one = cart(
        reach=asking(move(), ends=ends, name="reach"),
        drive=asking(roll(), ends=ends, name="drive"),
        look=asking(act("wait", duration=1.0)),
    )
    reach, drive = one.start("reach"), one.start("drive")
    one.plant.during = [{"charge": 0.3}, {"charge": 0.1}]
    said = "monitor:charge-for-both: charge is 0.1 (at least 0.2)"
    expected = StepResult(StepStatus.STOPPED, said, allowed=1)
    ended = one.ends(2)
    assert {who: replace(result, causes=()) for who, result in ended.items()} == {
        reach: expected,
        drive: expected,
    }
    assert [str(cause) for cause in ended[reach].causes] == ["charge-for-both: charge is 0.1 (at least 0.2)"]
    assert ends == ["reach", "drive"]
    assert one.calls("skill_ended") == [("cart.reach", False), ("cart.drive", False)]
    one.assert_nothing_is_held()
    one.plant.during = [{"charge": 0.1}]
    assert one.executor.run_step(StepRequest("cart", "reach", {})).status is FINISHED


@pytest.mark.parametrize("measured", [{"charge": nan}, {"charge": "full"}, {"unheard_of": 1.0}])
def test_what_cannot_be_read_at_a_tick_is_one_too(cart: MakeCart, measured: dict[str, Any]) -> None:
    one = cart(reach=asking(move()), drive=asking(roll()))
    one.start("reach")
    one.start("drive")
    one.plant.during = [measured]
    (name,) = measured
    assert {result.reason for result in one.ends(2).values()} == {f"monitor:input:{name}"}


def test_a_step_that_is_cancelled_comes_to_rest_and_the_other_goes_on(cart: MakeCart) -> None:
    ends: list[str] = []
    one = cart(reach=asking(move(), move(), ends=ends, name="reach"), drive=asking(roll(), roll()))
    reach, drive = one.start("reach"), one.start("drive")
    assert one.executor.wait(0.05) is None
    one.executor.cancel(reach, "not wanted")
    one.executor.cancel(reach, "not wanted at all")
    assert one.executor.wait() == EndedStep(reach, StepResult(StepStatus.CANCELLED, "not wanted", allowed=1))
    assert ends == ["reach"]
    assert one.calls("halt") == [1]
    assert one.plant.call_count("stop") == 0
    assert one.executor.wait() == EndedStep(drive, StepResult(FINISHED, "", allowed=2))
    one.executor.cancel(reach, "it has ended")
    one.assert_nothing_is_held()


def test_a_step_that_never_began_is_cancelled_without_a_trace_on_the_plant(cart: MakeCart) -> None:
    one = cart(reach=asking(move()))
    first, second = one.start("reach"), one.start("reach")
    assert one.executor.wait(0.05) is None
    one.executor.cancel(second, "not wanted")
    assert one.ends(1) == {second: StepResult(StepStatus.CANCELLED, "not wanted")}
    assert one.ends(1)[first].status is FINISHED
    assert one.calls("skill_began") == ["cart.reach"]
    assert [one["reason"] for one in one.records("step-refused")] == ["not wanted"]


def test_one_that_is_late_is_halted_and_the_other_goes_on(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll(), roll()))
    one.plant.durations = [20.0, 6.0, 6.0]
    reach, drive = one.start("reach"), one.start("drive")
    results = one.ends(2)
    assert results[reach] == StepResult(
        StepStatus.TIMED_OUT, "the skill's timeout passed during a motion", allowed=1
    )
    assert results[drive].status is StepStatus.TIMED_OUT  # at 10 s, amid its second
    assert one.plant.time == 10.0


def test_a_denied_step_leaves_what_the_other_moves_alone(cart: MakeCart) -> None:
    one = cart(reach=asking(move(), move(5.0)), drive=asking(roll()))
    one.plant.durations = [0.5, 5.0]
    reach, drive = one.start("reach"), one.start("drive")
    results = one.ends(2)
    assert (results[reach].status, results[drive].status) == (StepStatus.DENIED, FINISHED)
    assert one.plant.call_count("stop") == 0
    assert one.plant.call_count("halt") == 0


def test_a_protective_stop_that_a_skill_asks_for_ends_what_the_others_move(cart: MakeCart) -> None:
    one = cart(reach=asking(move()), drive=asking(roll()), look=asking(act("stop")))
    reach, drive = one.start("reach"), one.start("drive")
    assert one.executor.wait(0.05) is None
    assert one.executor.run_step(StepRequest("cart", "look", {})).status is FINISHED
    results = one.ends(2)
    assert "beside" not in one.records("decision")[-1]
    for step in (reach, drive):
        assert results[step].status is StepStatus.STOPPED
        assert "which asked for a protective stop" in results[step].reason
    one.assert_nothing_is_held()


def test_what_the_operator_revokes_is_halted_and_the_other_goes_on(cart: MakeCart) -> None:
    operator = Operator()
    one = cart(governor=operator, reach=asking(move()), drive=asking(roll(), roll()))
    reach, drive = one.start("reach"), one.start("drive")
    assert one.executor.wait(0.05) is None
    operator.generation, operator.revoked = 1, {"reach"}
    results = one.ends(2)
    assert results[reach] == StepResult(StepStatus.STOPPED, "revoked: the test says so", allowed=1)
    assert results[drive].status is FINISHED
    one.assert_nothing_is_held()


def test_under_another_configuration_nothing_begins_before_what_moves_has_ended(cart: MakeCart) -> None:
    operator = Operator()
    one = cart(governor=operator, reach=asking(move(), move()), drive=asking(roll(), roll()))
    one.plant.durations = [1.0, 3.0]
    one.start("reach")
    one.start("drive")
    assert one.executor.wait(0.5) is None
    operator.generation = 1
    operator.in_force = Configuration(configuration().site, configuration().modules, {}, "d" * 64)
    one.ends(2)
    seen = [record["configuration"][0] for record in one.records("decision")]
    times = [record["time"] for record in one.records("decision")]
    assert list(zip(seen, times, strict=True))[:4] == [("c", 0.0), ("c", 0.0), ("d", 3.0), ("d", 3.0)]


def test_while_the_operator_pauses_what_moves_ends_and_nothing_begins(cart: MakeCart) -> None:
    operator = Operator()
    one = cart(governor=operator, reach=asking(move(), move()), drive=asking(roll(), roll()))
    one.plant.durations = [1.0, 3.0]
    one.start("reach")
    one.start("drive")
    assert one.executor.wait(0.5) is None
    operator.command = OperatorCommand.PAUSE
    assert one.executor.wait(3.0) is None
    assert one.begun() == ["move", "roll"]
    operator.command = OperatorCommand.RUN
    assert {result.status for result in one.ends(2).values()} == {FINISHED}
    assert [len(one.records(event)) for event in ("paused", "resumed")] == [1, 1]


def test_a_stop_by_the_operator_ends_everything(cart: MakeCart) -> None:
    operator = Operator()
    one = cart(governor=operator, reach=asking(move()), drive=asking(roll()))
    one.start("reach")
    one.start("drive")
    assert one.executor.wait(0.05) is None
    operator.command = OperatorCommand.STOP
    assert one.executor.is_stopped
    ended = one.ends(2).values()
    assert {(one.status, one.reason) for one in ended} == {(StepStatus.HALTED, "stopped by the operator")}
    one.assert_nothing_is_held()


# However it ends.


def _raising(observed: Observation, inputs: Inputs) -> SkillBody:
    yield move()
    raise ValueError("no")


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (asking(move()), FINISHED),
        (asking(move(), roll()), StepStatus.DENIED),
        (_raising, StepStatus.RAISED),
        (asking(*[move()] * 500), StepStatus.TIMED_OUT),
        (asking(act("fly")), StepStatus.DENIED),
    ],
)
def test_what_a_step_held_is_there_for_the_next(cart: MakeCart, body: Asking, status: StepStatus) -> None:
    one = cart(reach=body)
    first, second = one.start("reach"), one.start("reach")
    results = one.ends(2)
    assert (results[first].status, results[second].status) == (status, status)
    one.assert_nothing_is_held()
    assert one.calls("skill_ended") == [("cart.reach", status is FINISHED)] * 2


@pytest.mark.parametrize(
    ("returned", "status", "said"),
    [
        (None, FINISHED, {}),
        ({"amount": 0.5}, FINISHED, {"amount": 0.5}),
        ({"amount": 1}, FINISHED, {"amount": 1.0}),
        ({}, StepStatus.RAISED, "the output `amount` is missing"),
        ({"amount": 1.5}, StepStatus.RAISED, "the output `amount` is outside its range [0, 1]"),
        ({"amount": nan}, StepStatus.RAISED, "the output `amount` is not a finite number"),
        ({"amount": True}, StepStatus.RAISED, "the output `amount` is not a finite number"),
        ({"amount": 0.5, "more": 1}, StepStatus.RAISED, "the skill has no output `more`"),
        ([0.5], StepStatus.RAISED, "the skill returned a `list`"),
        ({1: 0.5}, StepStatus.RAISED, "the skill returned an output whose name is not a string"),
    ],
)
def test_what_a_skill_gives_is_what_it_declares(
    cart: MakeCart, returned: Any, status: StepStatus, said: Any
) -> None:
    def giving(observed: Observation, inputs: Inputs) -> SkillBody:
        yield act("wait", duration=1.0)
        return returned

    one = cart(look=giving)
    result = one.executor.run_step(StepRequest("cart", "look", {}))
    assert result.status is status
    if status is FINISHED:
        assert result.outputs == said
        assert [end.get("outputs", {}) for end in one.records("step-ended")] == [said]
    else:
        assert said in result.reason
        assert result.outputs == {}


@pytest.mark.parametrize("failure", [OSError("link lost"), KeyboardInterrupt()])
@pytest.mark.parametrize("method", ["advance", "begin", "observe"])
def test_where_something_breaks_every_step_is_cleaned_up_once(
    cart: MakeCart, method: str, failure: BaseException
) -> None:
    ends: list[str] = []
    one = cart(
        reach=asking(move(), move(), ends=ends, name="reach"),
        drive=asking(roll(), roll(), ends=ends, name="drive"),
    )
    one.plant.durations = [1.0, 2.0]
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


def test_a_resource_that_the_site_does_not_have_is_refused(cart: MakeCart) -> None:
    one = cart(reach=asking(move()))
    one.executor._resources.set_capacities({"arm": 1, "camera": 0, "actuator arm": 1})
    refused = one.executor.start(StepRequest("cart", "reach", {}))
    assert refused == StepResult(StepStatus.REFUSED, "this site has no `camera`")
