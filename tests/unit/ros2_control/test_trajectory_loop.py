"""The loop hands motions over whole, and brakes or cancels whatever it cannot look after."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest

from aeros.ros2_control.controller import ControllerError, GoalEvent, GoalState
from aeros.wired_arm.link import (
    JudgedMessage,
    LinkClosedError,
    Message,
    ProcessLink,
    StartMessage,
    StateMessage,
    event,
)
from tests.unit.franka.stub.arms import READY, Ends, line
from tests.unit.ros2_control.controllers import LIMITS, OFFSET, PERIOD, Bench, bench

START = StartMessage(line(READY, 0.4), 2.0)
TURNS = round((0.1 + 2.0 + 0.1) / PERIOD)
"""Turns in which the whole motion is over."""


def judge(plant: ProcessLink) -> Callable[[Message], None]:
    """Answer each state at once, as a monitor that is in time."""

    def answer(message: Message) -> None:
        if isinstance(message, StateMessage):
            plant.send(JudgedMessage(message.state.time))

    return answer


def states(heard: list[Message]) -> list[StateMessage]:
    return [one for one in heard if isinstance(one, StateMessage)]


def the_end(heard: list[Message]) -> dict[str, Any]:
    (end,) = [one for one in heard if isinstance(one, dict) and one["is"] == "ended"]
    return end


def begun(ends: Ends, turns: int = 60) -> Bench:
    """A motion under way, half a second after its start."""
    made = bench(ends)
    made.plant.send(START)
    made.turn(turns, judge(made.plant))
    return made


def test_a_motion_is_one_goal_from_rest_to_rest(ends: Ends) -> None:
    made = bench(ends)
    made.plant.send(START)
    heard = made.turn(TURNS, judge(made.plant))
    (goal,) = made.controller.goals
    assert goal.points[0].q == pytest.approx(READY)
    assert goal.points[-1].q == pytest.approx([q + 0.4 for q in READY])
    assert goal.points[-1].time == 2.0
    assert goal.path_tolerance == LIMITS.path_tolerance
    assert the_end(heard) == event("ended", reason=None, braked=False)
    assert made.controller.cancellations == 0


def test_the_plants_clock_stands_until_the_trajectory_starts(ends: Ends) -> None:
    made = bench(ends)
    made.plant.send(event("read"))
    (before,) = states(made.turn(2))
    made.plant.send(START)
    seen = states(made.turn(40, judge(made.plant)))
    (goal,) = made.controller.goals
    first = made.controller.time + OFFSET - PERIOD * (len(seen) - 1)
    assert goal.start <= first < goal.start + PERIOD
    assert seen[0].state.time - before.state.time == pytest.approx(first - goal.start, abs=1e-6)
    assert all(later.state.time > one.state.time for one, later in pairwise(seen))


def test_the_commanded_joints_are_those_of_the_decided_motion(ends: Ends) -> None:
    made = bench(ends)
    made.plant.send(START)
    for one in states(made.turn(TURNS - 20, judge(made.plant))):
        assert one.state.q_d == pytest.approx(one.state.q, abs=0.01)


def test_a_brake_leaves_the_path_nowhere_and_ends_at_rest(ends: Ends) -> None:
    made = begun(ends)
    made.plant.send(event("brake"))
    heard = made.turn(100, judge(made.plant))
    whole, brake = made.controller.goals
    assert brake.start == whole.start
    assert brake.points[0].time + brake.start > OFFSET
    rest = brake.points[-1]
    assert rest.dq == rest.ddq == (0.0,) * 7
    assert READY[0] < rest.q[0] < READY[0] + 0.4
    # All joints move in step, so a point is on the path if all have gone the same way.
    for point in brake.points:
        assert [q - start for q, start in zip(point.q, READY, strict=True)] == pytest.approx(
            [point.q[0] - READY[0]] * 7
        )
    assert the_end(heard) == event("ended", reason=None, braked=True)


@pytest.mark.parametrize(
    ("state", "words"),
    [
        (GoalState.REJECTED, "refused: the controller rejected the motion: not active"),
        (GoalState.FAILED, "controller: it ended the motion by itself: not active"),
    ],
)
def test_a_goal_that_is_refused_or_fails_ends_the_motion(ends: Ends, state: GoalState, words: str) -> None:
    made = bench(ends)
    made.controller.answers[1] = GoalEvent(1, state, "not active")
    made.plant.send(START)
    assert the_end(made.turn(10)) == event("ended", reason=words, braked=False)


def test_another_client_that_replaces_the_motion_is_cancelled_too(ends: Ends) -> None:
    made = begun(ends)
    made.controller.events.append(GoalEvent(1, GoalState.PREEMPTED, "invalid goal: preempted"))
    end = the_end(made.turn(5, judge(made.plant)))
    assert str(end["reason"]).startswith("preempted: another client replaced the motion")
    assert made.controller.cancellations == 1


def test_joint_states_that_stop_brake_the_motion(ends: Ends) -> None:
    made = begun(ends)
    made.controller.is_silent = True
    heard = made.turn(150, judge(made.plant))
    assert len(made.controller.goals) == 2
    assert str(the_end(heard)["reason"]).startswith("late: no joint states for 1")


def test_a_monitor_that_judges_nothing_brakes_the_motion(ends: Ends) -> None:
    made = begun(ends)
    heard = made.turn(150)
    assert len(made.controller.goals) == 2
    assert str(the_end(heard)["reason"]).startswith("late: the monitor has judged nothing for 1")


def test_a_plant_that_is_gone_brakes_the_motion_and_ends_the_loop(ends: Ends) -> None:
    made = begun(ends)
    made.plant.close()
    for _ in range(100):
        try:
            made.loop.turn()
        except LinkClosedError:
            break
    assert len(made.controller.goals) == 2
    assert made.controller.active is None
    assert made.controller.cancellations == 0


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (GoalEvent(2, GoalState.REJECTED, "no"), "held: the brake goal was refused, no"),
        (None, "held: the brake goal was not answered"),
    ],
)
def test_a_brake_that_is_not_accepted_cancels_all(ends: Ends, answer: GoalEvent | None, words: str) -> None:
    made = begun(ends)
    made.controller.answers[2] = answer
    made.plant.send(event("brake"))
    heard = made.turn(30, judge(made.plant))
    assert made.controller.cancellations == 1
    assert the_end(heard) == event("ended", reason=words, braked=True)


def test_a_controller_that_does_not_even_cancel_is_gone(ends: Ends) -> None:
    made = begun(ends)
    made.controller.is_deaf = True
    made.controller.answers[2] = None
    made.controller.active = None
    made.plant.send(event("brake"))
    with pytest.raises(ControllerError, match="does not answer"):
        made.turn(300, judge(made.plant))


def test_a_motion_without_a_result_is_cancelled(ends: Ends) -> None:
    made = begun(ends)
    made.controller.active = None
    end = the_end(made.turn(400, judge(made.plant)))
    assert end["reason"] == "late: the controller does not say how the motion has ended"


def test_a_motion_that_begins_elsewhere_is_refused(ends: Ends) -> None:
    made = bench(ends)
    away = tuple(q + 0.01 for q in READY)
    made.plant.send(StartMessage(line(away, 0.1), 1.0))
    end = the_end(made.turn(1))
    assert str(end["reason"]).startswith("stale: the motion begins 0.01")
    assert made.controller.goals == []


def test_nothing_begins_while_joint_states_are_old(ends: Ends) -> None:
    made = bench(ends)
    made.controller.is_silent = True
    made.turn(20)
    made.plant.send(START)
    assert str(the_end(made.turn(1))["reason"]).startswith("late: no joint states for")
    assert made.controller.goals == []


def test_a_brake_before_the_start_cancels_and_nothing_moves(ends: Ends) -> None:
    made = bench(ends)
    made.plant.send(START)
    made.turn(2)
    made.plant.send(event("brake"))
    assert the_end(made.turn(5)) == event("ended", reason=None, braked=True)
    assert made.controller.q == READY


def test_a_goal_that_is_accepted_after_its_cancellation_is_cancelled_again(ends: Ends) -> None:
    made = bench(ends)
    made.controller.answers[1] = None
    made.controller.is_deaf = True
    made.plant.send(START)
    made.turn(2)
    made.plant.send(event("brake"))
    assert made.turn(2) == []
    made.controller.is_deaf = False
    made.controller.active = 1
    made.controller.events.append(GoalEvent(1, GoalState.ACCEPTED))
    assert the_end(made.turn(3)) == event("ended", reason=None, braked=True)
    assert made.controller.cancellations == 2
    made.turn(TURNS)
    assert made.controller.q == READY


def test_a_brake_goal_that_is_accepted_after_the_end_is_cancelled(ends: Ends) -> None:
    made = begun(ends)
    made.controller.answers[2] = None
    made.plant.send(event("brake"))
    assert the_end(made.turn(40, judge(made.plant)))["reason"] == "held: the brake goal was not answered"
    assert made.controller.cancellations == 1
    made.controller.events.append(GoalEvent(2, GoalState.ACCEPTED))
    made.turn(1)
    assert made.controller.cancellations == 2


def test_a_motion_whose_goal_is_not_accepted_is_cancelled_and_not_braked(ends: Ends) -> None:
    made = bench(ends)
    made.controller.answers[1] = None
    made.plant.send(START)
    made.turn(60, judge(made.plant))
    made.plant.send(event("brake"))
    assert the_end(made.turn(5, judge(made.plant)))["braked"] is True
    assert len(made.controller.goals) == 1
    assert made.controller.cancellations == 1


def test_a_success_before_the_end_of_the_motion_is_a_failure(ends: Ends) -> None:
    made = begun(ends)
    made.controller.events.append(GoalEvent(1, GoalState.SUCCEEDED))
    end = the_end(made.turn(5, judge(made.plant)))
    assert end["reason"] == "controller: it reports a success before the end of the motion"
    assert made.controller.cancellations == 1
    assert made.controller.active is None


def test_a_motion_whose_end_is_not_known_is_cancelled(ends: Ends) -> None:
    made = begun(ends)
    made.controller.events.append(GoalEvent(1, GoalState.FAILED, "no result"))
    made.turn(5, judge(made.plant))
    assert made.controller.cancellations == 1
    assert made.controller.active is None


def test_a_plant_that_closes_while_the_loop_brakes_by_itself_ends_the_loop(
    ends: Ends, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = begun(ends)
    made.turn(15)
    made.plant.send(event("close"))
    turns = iter([made.loop.turn] * 150)
    monkeypatch.setattr(made.loop, "turn", lambda: next(turns)())
    made.loop.run()
    heard: list[Message] = []
    while (message := made.plant.receive()) is not None:
        heard.append(message)
    assert [one["is"] for one in heard if isinstance(one, dict)] == ["ended"]
