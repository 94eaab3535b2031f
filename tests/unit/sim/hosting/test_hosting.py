"""A hosted plant stops whenever nobody commands it, and is there for whoever comes next."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from typing import Any

import pytest

from aeros.runtime.ports import Plant, Trajectory
from aeros.sim.hosting.wire import ConnectionLostError
from aeros.sim.kinematic.plant import make_plant
from aeros.skill import act
from tests.unit.sim.hosting.hosted import Hosting

REACH = act("move_tool", target=(0.5, -0.35, 0.25), yaw=0.5, speed=0.5)

MOVING = """
import sys, time
from pathlib import Path
from aeros.sim.hosting.remote import RemotePlant
from aeros.skill import act
plant = RemotePlant(Path(sys.argv[1]))
action = act("move_tool", target=(0.5, -0.35, 0.25), yaw=0.5, speed=0.5)
ticks = 0
def monitor(now, measured):
    global ticks
    ticks += 1
    if ticks == 60:
        print("moving", max(map(abs, measured["joint_velocity"])), flush=True)
        time.sleep(float(sys.argv[2]))
    return None
plant.skill_began("module.skill")
plant.begin(action, plant.plan(action))
plant.advance(monitor, 100.0)
print("ended", flush=True)
"""


def kinematic() -> Plant:
    return make_plant("bare", 0)


def mover(hosting: Hosting, sleeps: float) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", MOVING, str(hosting.path), str(sleeps)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)


def speed(measured: Mapping[str, Any]) -> float:
    return float(max(map(abs, measured["joint_velocity"])))


def test_kill_9_amid_a_motion_brings_it_to_rest_within_its_limits() -> None:
    hosting = Hosting(kinematic())
    with mover(hosting, 60.0) as agent:
        assert agent.stdout is not None
        word, moving_at = agent.stdout.readline().split()
        assert (word, float(moving_at) > 0.05) == ("moving", True)
        os.kill(agent.pid, signal.SIGKILL)
        let_go = hosting.until("let-go")
    assert let_go["amid_motion"]
    assert speed(let_go["measured"]) == 0.0
    # Whoever comes next finds it as it was left, and nothing has moved since.
    plant = hosting.join()
    assert plant.now() == let_go["time"]
    assert plant.observe()["joint_position"].value == tuple(let_go["measured"]["joint_position"])
    moved = plant.begin(REACH, plant.plan(REACH))
    assert isinstance(moved, int)
    assert plant.advance(lambda now, measured: None, 100.0)[moved].completed
    plant.shut_down_host()
    hosting.thread.join(20.0)
    assert hosting.events() == ["connected", "skill-began", "let-go", "connected", "ended"]


def test_an_agent_that_hangs_is_given_up_and_cannot_go_on() -> None:
    hosting = Hosting(kinematic(), patience=0.3)
    with mover(hosting, 2.0) as agent:
        assert agent.stdout is not None
        assert agent.stdout.readline().startswith("moving")
        let_go = hosting.until("let-go")
        assert speed(let_go["measured"]) == 0.0
        rest = agent.stdout.read()
    assert "ended" not in rest
    assert agent.returncode == 1
    plant = hosting.join()
    assert plant.now() == let_go["time"]
    plant.shut_down_host()


def test_between_two_actions_an_agent_may_think() -> None:
    hosting = Hosting(kinematic(), patience=0.05)
    plant = hosting.join()
    time.sleep(0.3)
    before = plant.now()
    time.sleep(0.3)
    assert plant.now() == before
    plant.shut_down_host()


def test_a_malformed_message_ends_the_connection_and_not_the_plant() -> None:
    hosting = Hosting(kinematic())
    for message in ({"do": "explode"}, {"do": "plan"}, {"do": "halt", "motion": 99}, {"no": "thing"}):
        plant = hosting.join()
        plant._channel.send(message)
        with pytest.raises(ConnectionLostError):
            plant.now()
        plant.close()
    plant = hosting.join()
    assert max(map(abs, plant.observe()["joint_velocity"].value)) == 0.0
    plant.shut_down_host()
    hosting.thread.join(20.0)
    assert hosting.events().count("let-go") == 4


def test_a_host_without_clients_ends() -> None:
    hosting = Hosting(kinematic(), linger=0.1)
    hosting.thread.join(20.0)
    assert not hosting.thread.is_alive()
    assert not hosting.path.exists()


def test_a_monitor_that_fails_has_stopped_the_plant_first() -> None:
    hosting = Hosting(kinematic())
    plant = hosting.join()
    plant.begin(REACH, plant.plan(REACH))

    def monitor(now: float, measured: Mapping[str, Any]) -> None:
        if now > 0.2:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        plant.advance(monitor, 100.0)
    assert max(map(abs, plant.observe()["joint_velocity"].value)) == 0.0
    plant.shut_down_host()


def test_a_plan_arrives_as_it_was_stated() -> None:
    hosting, beside = Hosting(kinematic()), kinematic()
    plant = hosting.join()
    stated, told = beside.plan(REACH), plant.plan(REACH)
    assert isinstance(told, Trajectory)
    assert told == stated
    assert plant.plan(REACH) == stated
    plant.shut_down_host()
