import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from aeros.franka.plant import FrankaPlant
from aeros.franka.settings import FrankaSettings
from aeros.runtime.ports import MotionCompletion, MotionHandle, NoMotion, PlantLostError, Trajectory
from aeros.sim.robot.robot_file import read_robot
from aeros.skill import Action
from aeros.wired_arm.arm_plant import ArmPlant
from aeros.wired_arm.process import ProcessError
from tests.unit.franka.stub.arms import READY, SETTINGS, STUB, use_stub
from tests.unit.wired_arm.test_measurements import NAMES

MODEL = read_robot("franka_fr3")
DECLARED = (*NAMES, "finger_gap", "holding")


CLOSE = Action("grip", {"width": 0.0, "force": 20.0})


def move(by: float = 0.05, speed: float = 0.2) -> Action:
    joints = {f"q{number}": q + by for number, q in enumerate(READY, 1)}
    return Action("move_joints", {**joints, "speed": speed})


@contextmanager
def opened(
    monkeypatch: pytest.MonkeyPatch, settings: FrankaSettings = SETTINGS, **stub: Any
) -> Iterator[FrankaPlant]:
    use_stub(monkeypatch, **stub)
    plant = FrankaPlant(settings, MODEL, (0.0, 0.0, 0.0), DECLARED)
    try:
        yield plant
    finally:
        plant.close()


class Watch:
    """A monitor that records stops, and does something once at a time after the first tick."""

    def __init__(self, after: float = 1e9, do: Callable[[], Any] = lambda: None) -> None:
        self.ticks = 0
        self.own_stops: list[str] = []
        self._after, self._do = after, do
        self._start: float | None = None

    def __call__(self, now: float, values: Mapping[str, Any]) -> str | None:
        self.ticks += 1
        if self._start is None:
            self._start = now
        if now - self._start >= self._after:
            self._after = 1e9
            answer: str | None = self._do()
            return answer
        return None

    def begin_stop(self, reason: str, now: float) -> None:
        self.own_stops.append(reason)


def run(plant: ArmPlant, action: Action, watch: Watch | None = None) -> MotionCompletion:
    motion = plant.begin(action)
    assert not isinstance(motion, MotionCompletion)
    return plant.advance(watch or Watch(), plant.now() + 20.0)[motion]


def test_a_motion_is_done_under_the_eyes_of_the_monitor(monkeypatch: pytest.MonkeyPatch) -> None:
    with opened(monkeypatch) as plant:
        readings = plant.observe()
        assert set(readings) == set(DECLARED)
        assert readings["joint_position"].value == READY
        watch, since = Watch(), plant.now()
        assert run(plant, move(), watch) == MotionCompletion(True)
        # Every state but those that libfranka reads itself, as it begins and ends the motion.
        assert watch.ticks >= 1000 * (plant.now() - since) - 15
        assert plant.observe()["joint_position"].value == pytest.approx([q + 0.05 for q in READY])
        assert plant.cycle_times["cycles"] > 90
        assert plant.arm_process > 0


def test_a_stop_of_the_monitor_brakes_and_ends_all_motions(monkeypatch: pytest.MonkeyPatch) -> None:
    with opened(monkeypatch) as plant:
        wait = plant.begin(Action("wait", {"duration": 5.0}))
        motion = plant.begin(move(0.2))
        watch = Watch(0.1, lambda: "some-rule")
        ended = plant.advance(watch, plant.now() + 20.0)
        assert ended == dict.fromkeys([wait, motion], MotionCompletion(False, "monitor:some-rule"))
        assert watch.own_stops == []
        joint = plant.observe()["joint_position"].value[0]
        assert 0.0 < joint < 0.2
        assert plant.plan(move(0.2)) == plant.plan(move(0.2))


def test_a_monitor_that_hangs_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    def hang() -> None:
        time.sleep(0.3)

    with opened(monkeypatch, replace(SETTINGS, patience=0.1)) as plant:
        watch = Watch(0.1, hang)
        end = run(plant, move(0.3), watch)
        assert str(end.reason).startswith("late: the monitor has judged nothing for 10")
        assert watch.own_stops == [end.reason]
        assert plant.observe()["joint_position"].value[0] < 0.3


def test_a_reflex_ends_the_motion_and_nothing_moves_until_a_person_has_looked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with opened(monkeypatch, fault={"after": 100, "errors": "joint_reflex"}) as plant:
        watch = Watch()
        end = run(plant, move(), watch)
        assert "the robot stopped by itself" in str(end.reason)
        assert "`joint_reflex`, the torque of a joint was not as expected" in str(end.reason)
        assert watch.own_stops == [end.reason]
        refusal = plant.plan(move())
        assert isinstance(refusal, MotionCompletion)
        assert str(refusal.reason).startswith(
            "reflex: the robot has stopped by itself and does not move until"
        )


def test_twenty_lost_cycles_end_the_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    with opened(monkeypatch, lose={"after": 60, "count": 20}) as plant:
        end = run(plant, move())
        assert "`communication_constraints_violation`, 20 commands in a row did not reach" in str(end.reason)


def test_a_few_lost_cycles_are_counted_and_the_motion_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    with opened(monkeypatch, lose={"after": 60, "count": 8}) as plant:
        assert run(plant, move()) == MotionCompletion(True)
        assert plant.cycle_times["lost"] == 8


def test_the_death_of_the_streaming_process_ends_the_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    with opened(monkeypatch) as plant:

        def kill() -> None:
            os.kill(plant.arm_process, signal.SIGKILL)

        end = run(plant, move(0.2), Watch(0.1, kill))
        assert str(end.reason).startswith("gone: ")
        with pytest.raises(ConnectionError):
            plant.advance(Watch(), plant.now() + 1.0)


def test_ctrl_c_to_the_whole_process_group_brakes_the_arm(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    log = tmp_path / "log"
    use_stub(monkeypatch, log=str(log))
    command = [sys.executable, str(STUB / "interrupted_motion.py")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(STUB), str(Path.cwd())]))
    # A group of its own, as a terminal gives it to a command.
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True) as program:
        assert program.stdout is not None
        assert program.stdout.readline() == "moving\n"
        os.killpg(program.pid, signal.SIGINT)
        assert program.wait(20.0) == 0
    # Set points up to a standstill, and then the robot's own stop.
    assert log.read_text().splitlines()[-2:] == ["finished", "stop"]


def test_one_motion_can_be_halted(monkeypatch: pytest.MonkeyPatch) -> None:
    with opened(monkeypatch) as plant:
        motion = plant.begin(move(0.2))
        assert isinstance(motion, int)
        handle = MotionHandle(motion)
        assert plant.advance(Watch(), plant.now() + 0.1) == {}
        plant.halt(handle)
        assert plant.advance(Watch(), plant.now() + 5.0) == {handle: MotionCompletion(False, "halted")}
        early = plant.begin(Action("wait", {"duration": 1.0}))
        assert isinstance(early, int)
        plant.halt(MotionHandle(early))
        assert plant.advance(Watch(), plant.now() + 5.0) == {early: MotionCompletion(False, "halted")}


def test_the_hand_grips_and_tells_what_it_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    with opened(monkeypatch, object=0.03) as plant:
        assert run(plant, Action("grip", {"width": 0.0, "force": 20.0})) == MotionCompletion(True)
        readings = plant.observe()
        assert readings["holding"].value is True
        assert readings["finger_gap"].value == 0.03
        assert readings["finger_gap"].time <= plant.now()


@pytest.mark.parametrize("how", ["stop", "monitor", "halt"])
def test_a_stop_waits_for_fingers_that_close(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, how: str
) -> None:
    log = tmp_path / "log"
    with opened(monkeypatch, closing=0.3, log=str(log)) as plant:
        grip = plant.begin(CLOSE)
        assert isinstance(grip, int)
        assert plant.advance(Watch(), plant.now() + 0.05) == {}
        if how == "stop":
            plant.stop()
        else:
            if how == "halt":
                plant.halt(MotionHandle(grip))
            watch = Watch(0.0, (lambda: "some-rule") if how == "monitor" else lambda: None)
            reason = "halted" if how == "halt" else "monitor:some-rule"
            assert plant.advance(watch, plant.now() + 5.0) == {grip: MotionCompletion(False, reason)}
        assert log.read_text().splitlines()[-1] == "closed"
        assert plant.observe()["finger_gap"].value == 0.0


def test_fingers_that_never_rest_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("aeros.wired_arm.motion_table.FINGER_TIME", 0.1)
    with opened(monkeypatch, closing=0.6) as plant:
        grip = plant.begin(CLOSE)
        assert isinstance(grip, int)
        plant.advance(Watch(), plant.now() + 0.05)
        with pytest.raises(PlantLostError, match=r"the fingers still move after 0\.1"):
            plant.stop()
        end = plant.advance(Watch(0.0, lambda: "some-rule"), plant.now() + 5.0)[MotionHandle(grip)]
        assert str(end.reason).startswith("moving: the fingers still move after 0.1")
        assert str(end.reason).endswith("told to stop by monitor:some-rule")


def test_an_arm_that_does_not_come_to_rest_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("aeros.wired_arm.motion_table.SETTLE_TIME", 0.1)
    with opened(monkeypatch, drift=0.2) as plant:
        end = run(plant, move(0.2), Watch(0.1, lambda: "some-rule"))
        assert str(end.reason).startswith("moving: a joint still moves at 0.200 rad/s or m/s after 0.1")
        assert str(end.reason).endswith("told to stop by monitor:some-rule")
        with pytest.raises(PlantLostError, match=r"a joint still moves at 0\.200 rad/s or m/s"):
            plant.stop()


def test_impossible_actions_are_refused_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    with opened(monkeypatch, replace(SETTINGS, has_hand=False)) as plant:
        refusals = {
            "unknown kind: `slide`": plant.plan(Action("slide", {})),
            "unknown kind: `grip` on an arm without a hand": plant.plan(
                Action("grip", {"width": 0.0, "force": 20.0})
            ),
            "stale: it is not the plan that was made last": plant.begin(move(), NoMotion("made elsewhere")),
        }
        for reason, answer in refusals.items():
            assert answer == MotionCompletion(False, reason)
        first = plant.plan(move())
        assert isinstance(plant.begin(move(), first), int)
        assert plant.begin(move()) == MotionCompletion(False, "busy: the arm moves already")


def test_lines_of_the_tool_are_planned_one_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    with opened(monkeypatch) as plant:
        x, y, z = plant.observe()["tool_position"].value
        lines = [
            Action("move_tool", {"target": (x, y + d, z), "yaw": 0.0, "speed": 0.1}) for d in (0.02, 0.04)
        ]
        plans = plant.plan_sequence(lines)
        assert plans is not None
        assert [type(one) for one in plans] == [Trajectory, Trajectory]
        assert plant.plan_sequence([move()]) is None


def test_a_robot_in_a_reflex_is_not_taken_over(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ProcessError, match=r"python -m aeros\.franka\.recover"), opened(monkeypatch, mode=4):
        pass
    with pytest.raises(ProcessError, match="the robot's mode is user-stopped"), opened(monkeypatch, mode=5):
        pass
