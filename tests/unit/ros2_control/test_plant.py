"""The plant on a controller in a foreign process, which behaves as joint_trajectory_controller does."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from aeros.ros2_control.plant import JointTrajectoryPlant
from aeros.ros2_control.settings import ControlSettings
from aeros.runtime.ports import MotionCompletion, MotionHandle
from aeros.sim.robot.robot_file import read_robot
from aeros.skill import Action
from tests.repo.tree import ROOT
from tests.unit.franka.stub.arms import READY
from tests.unit.franka.test_plant import Watch
from tests.unit.ros2_control.foreign.stub import JOINTS, VARIABLES, StubController, stub_controller
from tests.unit.runtime.bus.ros2.foreign.environments import Domain
from tests.unit.wired_arm.test_measurements import NAMES

MODEL = read_robot("franka_fr3")
SETTINGS = ControlSettings("/joint_trajectory_controller", JOINTS, "/joint_states", 0.3, 0.0024, (0.05,) * 7)


def move(by: float = 0.1, speed: float = 0.2) -> Action:
    joints = {f"q{number}": q + by for number, q in enumerate(READY, 1)}
    return Action("move_joints", {**joints, "speed": speed})


@contextmanager
def opened(
    monkeypatch: pytest.MonkeyPatch, domain: Domain, settings: ControlSettings = SETTINGS, **options: Any
) -> Iterator[tuple[JointTrajectoryPlant, StubController]]:
    for name, value in {**domain.variables, **VARIABLES}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "executable", str(domain.found.robot))
    with stub_controller(domain, **options) as stub:
        plant = JointTrajectoryPlant(settings, MODEL, (0.0, 0.0, 0.0), NAMES)
        try:
            yield plant, stub
        finally:
            plant.close()


def run(plant: JointTrajectoryPlant, action: Action, watch: Watch | None = None) -> MotionCompletion:
    motion = plant.begin(action)
    assert not isinstance(motion, MotionCompletion)
    return plant.advance(watch or Watch(), plant.now() + 30.0)[motion]


@pytest.mark.deep
def test_a_decided_motion_is_done_under_the_eyes_of_the_monitor(
    monkeypatch: pytest.MonkeyPatch, domain: Domain
) -> None:
    with opened(monkeypatch, domain) as (plant, stub):
        readings = plant.observe()
        assert readings["joint_position"].value == pytest.approx(READY)
        assert {"contact_force", "estop_pressed", "joint_torque", "joint_torque_rate"}.isdisjoint(readings)
        watch = Watch()
        assert run(plant, move(), watch) == MotionCompletion(True)
        assert plant.observe()["joint_position"].value == pytest.approx([q + 0.1 for q in READY], abs=1e-3)
        (accepted,) = stub.events("accepted")
        assert accepted["first"] == pytest.approx(READY, abs=1e-3)
        assert accepted["last"] == pytest.approx([q + 0.1 for q in READY], abs=1e-3)
        assert watch.ticks > 0.7 * 100.0 * accepted["lasts"]
        (ended,) = stub.events("ended")
        assert ended["code"] == 0
        # The next motion begins where the last one ended.
        assert run(plant, move(0.0)) == MotionCompletion(True)


@pytest.mark.deep
def test_a_broken_rule_brakes_the_motion_on_its_path(monkeypatch: pytest.MonkeyPatch, domain: Domain) -> None:
    with opened(monkeypatch, domain) as (plant, stub):
        watch = Watch(0.8, lambda: "some-rule")
        assert run(plant, move(0.4), watch) == MotionCompletion(False, "monitor:some-rule")
        rest = plant.observe()["joint_position"].value
        ways = [q - start for q, start in zip(rest, READY, strict=True)]
        assert 0.0 < ways[0] < 0.39
        assert ways == pytest.approx([ways[0]] * 7, abs=2e-3)
        assert len(stub.events("accepted")) == 2
        assert stub.events("cancelled") == []


@pytest.mark.deep
def test_one_motion_can_be_halted(monkeypatch: pytest.MonkeyPatch, domain: Domain) -> None:
    with opened(monkeypatch, domain) as (plant, _):
        motion = plant.begin(move(0.4))
        assert isinstance(motion, int)
        handle = MotionHandle(motion)
        assert plant.advance(Watch(), plant.now() + 0.8) == {}
        plant.halt(handle)
        assert plant.advance(Watch(), plant.now() + 5.0) == {handle: MotionCompletion(False, "halted")}


FAULTS: dict[str, tuple[dict[str, Any], str]] = {
    "inactive": ({"inactive": True}, "refused: the controller rejected the motion: it is not active"),
    "stalled": ({"stall_after": 0.8}, "controller: it ended the motion by itself: path tolerance violated"),
    "off its goal": ({"sag": 0.03}, "controller: it ended the motion by itself: goal tolerance violated"),
    "silent": ({"silent_after": 0.8}, "late: no joint states for 3"),
    "without a result": ({"mute_after": 0.5}, "late: the controller does not say how the motion has ended"),
}


@pytest.mark.deep
@pytest.mark.parametrize("fault", FAULTS)
def test_faults_of_the_controller_end_the_motion_with_a_reason(
    monkeypatch: pytest.MonkeyPatch, domain: Domain, fault: str
) -> None:
    options, words = FAULTS[fault]
    with opened(monkeypatch, domain, **options) as (plant, _):
        watch = Watch()
        end = run(plant, move(0.4), watch)
        assert words in str(end.reason)
        assert watch.own_stops


@pytest.mark.deep
def test_another_client_that_takes_the_controller_is_cancelled(
    monkeypatch: pytest.MonkeyPatch, domain: Domain
) -> None:
    with opened(monkeypatch, domain) as (plant, stub):
        away = [q + 0.2 for q in READY]
        other = domain.start_peer(
            {
                "do": "goal",
                "action": "/joint_trajectory_controller/follow_joint_trajectory",
                "type": "control_msgs/action/FollowJointTrajectory",
                "goal": {
                    "trajectory": {
                        "joint_names": list(JOINTS),
                        "points": [{"positions": away, "time_from_start": {"sec": 20}}],
                    }
                },
            }
        )
        end = run(plant, move(0.4, speed=0.05))
        assert str(end.reason).startswith("preempted: another client replaced the motion")
        other.communicate(timeout=30.0)
        assert stub.events("cancelled")
        rest = plant.observe()["joint_position"].value
        time.sleep(0.3)
        assert plant.observe()["joint_position"].value == pytest.approx(rest, abs=1e-4)


@pytest.mark.deep
@pytest.mark.parametrize("victim", ["controller", "loop"])
def test_a_process_that_dies_in_mid_motion_ends_the_motion(
    monkeypatch: pytest.MonkeyPatch, domain: Domain, victim: str
) -> None:
    with opened(monkeypatch, domain) as (plant, stub):
        pid = stub.process.pid if victim == "controller" else plant.arm_process

        def kill() -> None:
            os.kill(pid, signal.SIGKILL)

        end = run(plant, move(0.4), Watch(0.5, kill))
        assert str(end.reason).startswith(("gone: ", "late: no joint states"))
        with pytest.raises(ConnectionError):
            plant.advance(Watch(), plant.now() + 1.0)


@pytest.mark.deep
def test_a_monitor_that_hangs_is_not_waited_for(monkeypatch: pytest.MonkeyPatch, domain: Domain) -> None:
    with opened(monkeypatch, domain) as (plant, stub):
        hang: Callable[[], None] = lambda: time.sleep(1.2)  # noqa: E731
        end = run(plant, move(0.4), Watch(0.5, hang))
        assert str(end.reason).startswith("late: the monitor has judged nothing for 3")
        assert len(stub.events("accepted")) == 2


@pytest.mark.deep
def test_a_plant_that_is_killed_leaves_no_motion(monkeypatch: pytest.MonkeyPatch, domain: Domain) -> None:
    program = (
        "from tests.unit.ros2_control.test_plant import *\n"
        "plant = JointTrajectoryPlant(SETTINGS, MODEL, (0.0, 0.0, 0.0), NAMES)\n"
        "plant.begin(move(0.4))\n"
        "plant.advance(Watch(0.8, lambda: os.kill(os.getpid(), signal.SIGKILL)), plant.now() + 30.0)\n"
    )
    with stub_controller(domain) as stub:
        command = [str(domain.found.robot), "-c", program]
        done = subprocess.run(
            command, env={**domain.variables, **VARIABLES}, cwd=ROOT, timeout=60.0, check=False
        )
        assert done.returncode == -signal.SIGKILL
        time.sleep(2.0)
        assert len(stub.events("accepted")) == 2
        (ended,) = stub.events("ended")
        assert 0.0 < ended["q"][0] - READY[0] < 0.39
