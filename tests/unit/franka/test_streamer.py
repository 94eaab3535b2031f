from itertools import pairwise

import pytest

from aeros.franka.streamer import CycleTimes, Streamer
from aeros.wired_arm.arm import CYCLE, ArmError
from aeros.wired_arm.link import (
    JudgedMessage,
    LinkClosedError,
    ProcessLink,
    StartMessage,
    StateMessage,
    event,
)
from aeros.wired_arm.streamed_motion import StreamedMotion
from tests.unit.franka.stub.arms import ACCELERATION, JERK, READY, Ends, ScriptedArm, line

START = StartMessage(line(READY, 0.2), 0.6)
PATIENCE = 0.02


def drive(arm: ScriptedArm, ends: Ends) -> list[object]:
    """Run the loop until the arm is gone; return what it reported, without states."""
    here, there = ends
    Streamer(arm, there, ACCELERATION, JERK, PATIENCE, 0.003).run()
    return [one for one in received(here) if not isinstance(one, StateMessage)]


def received(link: ProcessLink) -> list[object]:
    messages: list[object] = []
    try:
        while (message := link.receive()) is not None:
            messages.append(message)
    except LinkClosedError:
        pass
    return messages


def judging(ends: Ends, until: int = 10_000) -> ScriptedArm:
    """An arm of which the monitor judges each state, up to a cycle of control."""

    def judge(cycle: int) -> None:
        for message in received(ends[0]):
            if isinstance(message, StateMessage):
                if message.is_controlled and cycle < until:
                    ends[0].send(JudgedMessage(message.state.time))
            else:
                kept.append(message)

    kept: list[object] = []
    return ScriptedArm(judge)


def ending(reported: list[object]) -> dict[str, object]:
    (one,) = [message for message in reported if isinstance(message, dict) and message["is"] == "ended"]
    return one


def test_a_decided_motion_is_streamed_to_its_end(ends: Ends) -> None:
    arm = judging(ends)
    ends[0].send(START)
    end = ending(drive(arm, ends))
    assert (end["reason"], end["braked"], end["cycles"], end["lost"]) == (None, False, 600, 0)
    assert arm.commands[-1] == pytest.approx([q + 0.2 for q in READY])
    assert arm.stops == 0


def test_the_plant_can_brake_it(ends: Ends) -> None:
    arm = judging(ends)
    judge = arm.at_cycle

    def brake(cycle: int) -> None:
        judge(cycle)
        if cycle == 250:
            ends[0].send(event("brake"))

    arm.at_cycle = brake
    ends[0].send(START)
    end = ending(drive(arm, ends))
    assert (end["reason"], end["braked"]) == (None, True)
    assert 250 < len(arm.commands) < 400
    assert arm.stops == 1


def test_it_brakes_by_itself_when_the_monitor_is_late(ends: Ends) -> None:
    arm = judging(ends, until=200)
    ends[0].send(START)
    reported = drive(arm, ends)
    assert ending(reported)["reason"] == "late: the monitor has judged nothing for 21 ms of the robot's clock"
    # What was judged last is the state of cycle 199; braking begins with the state that is too old.
    assert 219 < len(arm.commands) < 400
    assert arm.commands[-1][0] < READY[0] + 0.2
    assert arm.stops == 1


def test_it_reports_at_once_that_it_brakes(ends: Ends) -> None:
    arm = ScriptedArm()
    ends[0].send(START)
    reported = drive(arm, ends)
    assert [message["is"] for message in reported if isinstance(message, dict)] == [
        "braking",
        "ended",
        "gone",
    ]


def test_it_brakes_by_itself_when_the_plant_is_gone(ends: Ends) -> None:
    arm = judging(ends)
    judge = arm.at_cycle

    def leave(cycle: int) -> None:
        if cycle < 300:
            judge(cycle)
        elif cycle == 300:
            ends[0].close()

    arm.at_cycle = leave
    ends[0].send(START)
    Streamer(arm, ends[1], ACCELERATION, JERK, PATIENCE, 0.003).run()
    assert 300 < len(arm.commands) < 450
    assert arm.commands[-1][0] < READY[0] + 0.2
    assert arm.stops == 1


def test_it_brakes_when_the_plant_does_not_read(ends: Ends) -> None:
    arm = ScriptedArm()
    here, there = ends
    here.send(StartMessage(line(READY, 0.2), 2.0))
    Streamer(arm, there, ACCELERATION, JERK, 10.0, 0.003).run()
    assert sum(isinstance(one, StateMessage) for one in received(here)) < len(arm.commands) < 2000


def test_a_motion_that_does_not_begin_where_the_arm_is_commanded_is_refused(ends: Ends) -> None:
    arm = ScriptedArm()
    ends[0].send(StartMessage(line(tuple(q + 0.004 for q in READY), 0.2), 0.6))
    end = ending(drive(arm, ends))
    assert str(end["reason"]).startswith("stale: the motion begins 0.004000 rad from")
    assert arm.commands == [READY]


def test_a_reflex_of_the_robot_is_reported(ends: Ends) -> None:
    arm = judging(ends)
    arm.failures[120] = ArmError("the robot stopped by itself: joint_reflex")
    ends[0].send(START)
    end = ending(drive(arm, ends))
    assert (end["reason"], end["braked"]) == ("the robot stopped by itself: joint_reflex", False)
    assert arm.stops == 1


def test_a_robot_that_is_gone_in_mid_motion_ends_the_process(ends: Ends) -> None:
    arm = judging(ends)
    arm.failures[120] = ArmError("the robot cannot be reached", is_connected=False)
    ends[0].send(START)
    assert drive(arm, ends) == [{"is": "gone", "reason": "the robot cannot be reached"}]


@pytest.mark.parametrize("failure", [RuntimeError("a fault"), KeyboardInterrupt()])
def test_a_program_that_fails_in_mid_motion_brakes_first(ends: Ends, failure: BaseException) -> None:
    arm = judging(ends)
    judge = arm.at_cycle

    def fail(cycle: int) -> None:
        judge(cycle)
        if cycle == 300 and pending:
            raise pending.pop()

    pending = [failure]
    arm.at_cycle = fail
    ends[0].send(START)
    with pytest.raises(type(failure)):
        Streamer(arm, ends[1], ACCELERATION, JERK, PATIENCE, 0.003).run()
    assert arm.stops == 1
    assert 310 < len(arm.commands) < 450
    assert arm.commands[-1][0] < READY[0] + 0.2
    first = [one[0] for one in arm.commands]
    steps = [b - a for a, b in pairwise(first)]
    assert max(abs(b - a) for a, b in pairwise(steps)) < 1e-5  # 10 rad/s² in cycles of 1 ms
    assert abs(steps[-1]) < 1e-6
    gone = [one for one in received(ends[0]) if isinstance(one, dict) and one["is"] == "gone"]
    reason = "the streaming process failed and has stopped the arm: RuntimeError: a fault"
    assert gone == ([event("gone", reason=reason)] if isinstance(failure, RuntimeError) else [])


def test_a_program_that_cannot_even_brake_calls_the_robots_own_stop(
    ends: Ends, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(motion: StreamedMotion, elapsed: float) -> None:
        raise RuntimeError("a fault")

    monkeypatch.setattr(StreamedMotion, "step", fail)
    arm = judging(ends)
    ends[0].send(START)
    with pytest.raises(RuntimeError, match="a fault"):
        Streamer(arm, ends[1], ACCELERATION, JERK, PATIENCE, 0.003).run()
    assert (arm.stops, arm.commands) == (1, [])


def test_lost_cycles_are_counted_and_the_motion_follows_the_robots_clock(ends: Ends) -> None:
    arm = judging(ends)
    arm.skipped = {100: 7, 200: 3}
    ends[0].send(START)
    end = ending(drive(arm, ends))
    assert (end["reason"], end["lost"], end["cycles"]) == (None, 10, 590)


def test_while_nothing_moves_states_are_sent_as_asked_for(ends: Ends) -> None:
    arm = ScriptedArm(idle_cycles=8)
    times = []
    read = arm.read

    def ask() -> object:
        number = round(arm.time / CYCLE)
        if number == 1:
            ends[0].send(event("read"))
        if number == 4:
            ends[0].send(event("watch", on=True))
        return read()

    arm.read = ask  # type: ignore[method-assign,assignment]
    Streamer(arm, ends[1], ACCELERATION, JERK, PATIENCE, 0.003).run()
    times = [round(one.state.time / CYCLE) for one in received(ends[0]) if isinstance(one, StateMessage)]
    assert times == [3, 6, 7, 8]


def test_it_ends_when_the_plant_closes_the_link(ends: Ends) -> None:
    arm = ScriptedArm(idle_cycles=100)
    ends[0].send(event("close"))
    assert drive(arm, ends) == []


def test_cycle_times_are_summarised() -> None:
    times = CycleTimes()
    for elapsed in (0.001, 0.001, 0.004):
        times.note_answer(times.note_state(elapsed))
    summary = times.summary()
    assert (summary["cycles"], summary["lost"]) == (3, 3)
    assert 0.0 <= summary["answer_p50"] <= summary["answer_max"] < 0.1
    assert 0.0 <= summary["gap_p50"] <= summary["gap_max"] < 0.1
    assert CycleTimes().summary() == {"cycles": 0, "lost": 0}
