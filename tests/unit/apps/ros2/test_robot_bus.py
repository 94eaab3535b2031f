"""A peer that only listens, dies or floods changes nothing of a run; and a stop always goes through."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from aeros.apps.ros2.robot_bus import open_robot_bus
from aeros.session.plant_factory import PlantSetupError
from tests.unit.runtime.bus.ros2.foreign.environments import Domain

_TASK = ("fetch the object", "--plant", "kinematic", "--seed", "5")
_WALL_CLOCK = {"written", "hash", "previous", "head", "key", "log", "signature", "nonce"}
"""What differs between any two runs: wall-clock times, identities, and what is hashed or signed over them."""

STOP = {"do": "call", "service": "/aeros/stop", "type": "std_srvs/srv/Trigger"}
READY = {"do": "wait_for", "service": "/aeros/stop", "type": "std_srvs/srv/Trigger"}


def without_wall_clock(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: without_wall_clock(one) for key, one in value.items() if key not in _WALL_CLOCK}
    if isinstance(value, list):
        return [without_wall_clock(one) for one in value]
    return value


def record(domain: Domain, out: str) -> list[Any]:
    return [without_wall_clock(one) for one in domain.events(out) if one["event"] != "checkpoint"]


@pytest.mark.deep
def test_a_listener_that_is_killed_changes_nothing_in_the_record(domain: Domain) -> None:
    with domain.robot("run", *_TASK, "--out", "alone", "--state", "state-a", is_on_ros2=False) as robot:
        robot.communicate(timeout=120.0)
    peer = domain.start_peer(
        {"do": "subscribe", "topic": "/aeros/decisions", "type": "aeros_msgs/msg/Decision"},
        {"do": "subscribe", "topic": "/joint_states", "type": "sensor_msgs/msg/JointState"},
        READY,
        {"do": "listen", "seconds": 100.0},
    )
    with domain.robot("run", *_TASK, "--out", "heard", "--state", "state-b") as robot:
        assert peer.stdout is not None
        for _ in range(3):
            peer.stdout.readline()  # until the peer is ready
        time.sleep(3.0)
        peer.kill()
        robot.communicate(timeout=120.0)
    peer.communicate()
    assert record(domain, "alone") == record(domain, "heard")


@pytest.mark.deep
def test_a_stop_goes_through_a_flood_of_other_requests(domain: Domain) -> None:
    with domain.robot("serve", *_TASK, "--out", "out", "--state", "state") as robot:
        domain.ask(READY)
        flooder: subprocess.Popen[str] = domain.start_peer(
            {"do": "flood", "service": "/aeros/resume", "type": "std_srvs/srv/Trigger", "count": 20_000}
        )
        time.sleep(1.5)
        began = time.monotonic()
        (stopped,) = domain.ask(STOP)
        took = time.monotonic() - began
        assert robot.wait(timeout=30.0) == 0
        flooder.kill()
        flooder.communicate()
    assert stopped["answer"]["success"]
    # A peer takes half a second to start and to find the robot.
    assert took < 10.0


def test_without_rclpy_it_says_how_to_get_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "aeros.runtime.bus.ros2.dds_bus", None)
    monkeypatch.setattr("os.environ", dict(os.environ))
    site: Any = SimpleNamespace(id="cell")
    opened = open_robot_bus(tmp_path, site, {}, [])
    with pytest.raises(PlantSetupError, match="source your ROS 2 distribution"):
        opened.__enter__()
