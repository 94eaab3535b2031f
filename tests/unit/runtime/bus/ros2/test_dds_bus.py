"""A process without AEROS hears a run on ROS 2: types, hashes, quality of service, and every decision."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.unit.runtime.bus.ros2.foreign.environments import Domain, cyclone_environment

pytestmark = pytest.mark.deep

_RUN = ("run", "fetch the object", "--plant", "kinematic", "--state", "state", "--out", "out")
_SCENE = "foxglove_msgs/msg/SceneUpdate"
_TF_HASH = "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"
"""Hash of tf2_msgs/msg/TFMessage in every distribution since Iron."""

_LISTENING: list[dict[str, Any]] = [
    {"do": "subscribe", "topic": "/aeros/decisions", "type": "aeros_msgs/msg/Decision"},
    {"do": "subscribe", "topic": "/aeros/events", "type": "aeros_msgs/msg/Event"},
    {"do": "subscribe", "topic": "/joint_states", "type": "sensor_msgs/msg/JointState", "depth": 10},
    {"do": "subscribe", "topic": "/tf", "type": "tf2_msgs/msg/TFMessage", "depth": 100},
    {"do": "subscribe", "topic": "/clock", "type": "rosgraph_msgs/msg/Clock", "reliable": False},
    {"do": "subscribe", "topic": "/diagnostics", "type": "diagnostic_msgs/msg/DiagnosticArray"},
    {"do": "wait_for", "service": "/aeros/stop", "type": "std_srvs/srv/Trigger"},
]


def test_a_peer_hears_a_whole_run(domain: Domain) -> None:
    peer = domain.start_peer(
        *_LISTENING,
        {"do": "topics"},
        {"do": "services"},
        {"do": "listen", "seconds": 120.0, "until": '"skill": "deliver"'},
        # Whoever comes late gets what is said once.
        {"do": "subscribe", "topic": "/robot_description", "type": "std_msgs/msg/String", "latched": True},
        {"do": "subscribe", "topic": "/tf_static", "type": "tf2_msgs/msg/TFMessage", "latched": True},
        {"do": "subscribe", "topic": "/aeros/scene", "type": _SCENE, "latched": True},
        {"do": "listen", "seconds": 120.0, "until": "gate-closed"},
    )
    with domain.robot(*_RUN) as robot:
        out, err = peer.communicate(timeout=200.0)
        assert robot.wait(timeout=60.0) == 0
    assert peer.returncode == 0, err
    *_, topics, services, _, _, _, _, heard = (json.loads(line) for line in out.splitlines())

    assert topics["/tf"]["hash"] == topics["/tf_static"]["hash"] == _TF_HASH
    assert all(one["hash"].startswith("RIHS01_") for one in topics.values())
    latched = {name for name, one in topics.items() if one["durability"] == "TRANSIENT_LOCAL"}
    pictures = {name for name in topics if name.startswith("/aeros/camera/")}
    shown = {f"/aeros/{name}" for name in ("people", "robot", "scene")}
    assert latched == {*pictures, *shown, "/robot_description", "/rosout", "/tf_static"} > pictures != set()
    assert topics["/clock"]["reliability"] == "BEST_EFFORT"
    assert services["/aeros/pause"] == "std_srvs/srv/Trigger"
    assert services["/aeros/change_state"] == "lifecycle_msgs/srv/ChangeState"
    assert "/aeros/execute_skill/_action/send_goal" not in services

    decided = sum(record.get("event") == "decision" for record in domain.events())
    assert decided > 20
    assert heard["/aeros/decisions"]["count"] == decided
    assert heard["/aeros/decisions"]["last"]["verdict"] == "ALLOW"
    assert len(heard["/joint_states"]["last"]["position"]) == 7
    assert heard["/joint_states"]["count"] > 1_000
    assert heard["/clock"]["last"]["clock"]["sec"] > 20
    assert heard["/diagnostics"]["last"]["status"][0]["name"] == "aeros: agent"
    moving = {one["child_frame_id"] for one in heard["/tf"]["last"]["transforms"]}
    assert "tool" not in moving
    assert heard["/tf_static"]["last"]["transforms"][0]["child_frame_id"] == "tool"
    assert "<robot name=" in heard["/robot_description"]["last"]["data"]
    assert "workspace" in {one["id"] for one in heard["/aeros/scene"]["last"]["entities"]}


def test_without_aeros_msgs_decisions_are_json_text(domain: Domain) -> None:
    peer = domain.start_peer(
        {"do": "subscribe", "topic": "/aeros/decisions/json", "type": "std_msgs/msg/String"},
        {"do": "subscribe", "topic": "/aeros/events/json", "type": "std_msgs/msg/String"},
        {"do": "listen", "seconds": 120.0, "until": "gate-closed"},
    )
    with domain.robot(
        "run", "clean the table", "--plant", "symbolic", "--state", "state", "--out", "out", is_plain=True
    ) as robot:
        out, err = peer.communicate(timeout=200.0)
        assert robot.wait(timeout=60.0) == 0
    assert peer.returncode == 0, err
    heard = json.loads(out.splitlines()[-1])
    assert json.loads(heard["/aeros/decisions/json"]["last"]["data"])["verdict"] == "ALLOW"
    assert "aeros_msgs: not installed: topics TOPIC/json have JSON text, no actions" in domain.output
    assert "tf2_msgs: not installed: topics of its types are left out" in domain.output


def test_a_reader_of_another_vendor_gets_every_decision(domain: Domain) -> None:
    folder = Path(__file__).parent / "foreign"
    reader = subprocess.Popen(
        [cyclone_environment(), "-I", folder / "cyclone_reader.py", domain.variables["ROS_DOMAIN_ID"], "180"],
        env={**os.environ, "CYCLONEDDS_URI": (folder / "cyclone_on_this_machine.xml").as_uri()},
        text=True,
        stdout=subprocess.PIPE,
    )
    assert reader.stdout is not None
    assert reader.stdout.readline() == "ready\n"
    with domain.robot(*_RUN) as robot:
        robot.communicate(timeout=150.0)
    out, _ = reader.communicate(timeout=90.0)
    decided = sum(record.get("event") == "decision" for record in domain.events())
    assert json.loads(out) == {"count": decided, "verdict": "ALLOW"}


def test_a_person_on_a_topic_stops_the_arm(domain: Domain) -> None:
    """A peer's distance is far, then near, then silent: the arm moves, and is then denied all."""
    reading = {"do": "publish_range", "topic": "/nearest", "rate": 100.0}
    peer = domain.start_peer(
        {**reading, "value": 8.0, "seconds": 16.0},
        {**reading, "value": 0.2, "seconds": 8.0},
        {"do": "listen", "seconds": 4.0},
    )
    sensor = ("--topic-sensor", "human_distance=/nearest")
    with domain.robot(*_RUN, *sensor):
        peer.communicate(timeout=100.0)
    events = domain.events()
    (named,) = (one["details"]["sensors"] for one in events if one["event"] == "topic-sensors")
    assert named == [{"variable": "human_distance", "topic": "/nearest", "type": "sensor_msgs/msg/Range"}]
    decisions = [one["details"] for one in events if one["event"] == "decision"]
    codes = [{reason[0] for reason in one["reasons"]} for one in decisions]
    # The person comes while the arm moves, which is a stop, or between two actions.
    near = next(at for at, found in enumerate(codes) if "AE750" in found)
    assert "ALLOW" in [one["verdict"] for one in decisions[:near]]
    assert {one["verdict"] for one in decisions[near:]} == {"DENY"}
    # At last the reading is too old.
    assert codes[-1] == {"AE706"}
