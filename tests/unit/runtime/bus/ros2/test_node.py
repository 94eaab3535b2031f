"""The node is managed: its states are the agent's, and its parameters say what runs."""

from __future__ import annotations

import signal
import time
from typing import Any

import pytest

from tests.unit.runtime.bus.ros2.foreign.environments import Domain

pytestmark = pytest.mark.deep

_SERVE = ("serve", "fetch the object", "--plant", "kinematic", "--state", "state", "--out", "out")
_CONFIGURE, _CLEANUP, _ACTIVATE, _DEACTIVATE, _ACTIVE_SHUTDOWN = 1, 2, 3, 4, 7


def change(transition: int) -> dict[str, Any]:
    return {
        "do": "call",
        "service": "/aeros/change_state",
        "type": "lifecycle_msgs/srv/ChangeState",
        "request": {"transition": {"id": transition}},
    }


GET_STATE = {"do": "call", "service": "/aeros/get_state", "type": "lifecycle_msgs/srv/GetState"}
SETTLE = {"do": "listen", "seconds": 0.5}
PURSUE = {
    "do": "goal",
    "action": "/aeros/pursue",
    "type": "aeros_msgs/action/Pursue",
    "goal": {"instruction": "fetch the object"},
}


def trigger(name: str) -> dict[str, Any]:
    return {"do": "call", "service": f"/aeros/{name}", "type": "std_srvs/srv/Trigger"}


def test_transitions_are_commands_and_commands_are_transitions(domain: Domain) -> None:
    with domain.robot(*_SERVE) as robot:
        answers = domain.ask(
            trigger("resume"),
            SETTLE,
            GET_STATE,
            change(_DEACTIVATE),
            GET_STATE,
            PURSUE,
            change(_CLEANUP),
            GET_STATE,
            change(_ACTIVATE),
            GET_STATE,
            trigger("pause"),
            SETTLE,
            GET_STATE,
            change(_ACTIVATE),
            change(_ACTIVE_SHUTDOWN),
        )
        assert robot.wait(timeout=30.0) == 0
    states = [one["answer"]["current_state"]["label"] for one in answers if "current_state" in str(one)]
    assert states == ["active", "inactive", "inactive", "active", "inactive"]
    changes = [one["answer"]["success"] for one in answers if set(one.get("answer", ())) == {"success"}]
    assert changes == [True, False, True, True, True]
    assert [one for one in answers if "accepted" in one] == [{"accepted": False}]
    commands = [one["details"]["command"] for one in domain.events() if one["event"] == "operator-request"]
    assert commands == ["run", "pause", "run", "pause", "run", "stop"]


def test_parameters_say_what_runs_and_cannot_be_set(domain: Domain) -> None:
    parameters = "rcl_interfaces/srv/GetParameters", "rcl_interfaces/srv/SetParameters"
    other = {"name": "site", "value": {"type": 4, "string_value": "other"}}
    with domain.robot(*_SERVE):
        got, refused = domain.ask(
            {
                "do": "call",
                "service": "/aeros/get_parameters",
                "type": parameters[0],
                "request": {"names": ["site", "plant", "modules"]},
            },
            {
                "do": "call",
                "service": "/aeros/set_parameters",
                "type": parameters[1],
                "request": {"parameters": [other]},
            },
        )
    site, plant, modules = got["answer"]["values"]
    assert (site["string_value"], plant["string_value"]) == ("panda_cell", "kinematic")
    assert "fetch_object" in modules["string_array_value"]
    assert [one["successful"] for one in refused["answer"]["results"]] == [False]


def test_each_robot_can_have_a_namespace(domain: Domain) -> None:
    with domain.robot(*_SERVE, "--ros-args", "-r", "__ns:=/robot7") as robot:
        topics, services, stopped = domain.ask(
            {"do": "wait_for", "service": "/robot7/aeros/stop", "type": "std_srvs/srv/Trigger"},
            {"do": "topics"},
            {"do": "services"},
            {**trigger("stop"), "service": "/robot7/aeros/stop"},
        )[1:]
        assert robot.wait(timeout=30.0) == 0
    assert stopped["answer"]["success"]
    assert {"/tf", "/diagnostics", "/robot7/joint_states", "/robot7/aeros/decisions"} <= set(topics)
    assert not [name for name in services if name.startswith("/aeros/")]
    requests = [one["details"] for one in domain.events() if one["event"] == "operator-request"]
    assert requests[0]["clients"][0]["node"] == "/peer"


def test_ctrl_c_ends_robot_and_node_in_order(domain: Domain) -> None:
    with domain.robot("run", "fetch the object", *_SERVE[2:]) as robot:
        domain.ask({"do": "wait_for", "service": "/aeros/stop", "type": "std_srvs/srv/Trigger"})
        time.sleep(1.0)
        robot.send_signal(signal.SIGINT)
        assert robot.wait(timeout=60.0) == 130
    assert "chain sound, signed and anchored" in domain.output
    assert "terminate called" not in domain.output
    assert "Traceback" not in domain.output


@pytest.mark.parametrize(
    ("given", "variables"),
    [(("-r", "nonsense"), {}), ((), {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_STRATEGY": "Enforce"})],
)
def test_a_node_that_cannot_start_moves_nothing(
    given: tuple[str, ...], variables: dict[str, str], domain: Domain
) -> None:
    domain.variables |= variables
    with domain.robot(*_SERVE, "--ros-args", *given) as robot:
        out, _ = robot.communicate(timeout=60.0)
        assert robot.returncode == 1
    assert "aeros: ROS 2 does not start: " in out
    assert not (domain.folder / "out" / "audit.jsonl").exists()
