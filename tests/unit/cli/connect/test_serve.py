"""`aeros serve` waits for instructions of other processes, and says if nobody could ask."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.unit.runtime.bus.ros2.foreign.environments import Domain, environments

_SERVE = ("serve", "fetch the object", "--plant", "kinematic", "--state", "state", "--out", "out")
_SUCCEEDED, _CANCELED, _ABORTED = 4, 5, 6
STOP = {"do": "call", "service": "/aeros/stop", "type": "std_srvs/srv/Trigger"}


def pursue(instruction: str, **more: Any) -> dict[str, Any]:
    return {
        "do": "goal",
        "action": "/aeros/pursue",
        "type": "aeros_msgs/action/Pursue",
        "goal": {"instruction": instruction},
        **more,
    }


def test_without_ros_2_nobody_could_ask(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["serve", "make dumplings", "--state", str(tmp_path / "state")]) == Exit.USAGE
    assert "give --ros2" in capsys.readouterr().err
    assert not (tmp_path / "state").exists()


@pytest.mark.deep
def test_instructions_are_pursued_refused_and_cancelled(tmp_path: Path) -> None:
    domain = Domain(environments(), tmp_path)
    with domain.robot(*_SERVE) as robot:
        refused, cancelled, reached, _ = domain.ask(
            pursue("fly to the moon"),
            pursue("fetch the object", cancel_after=3.0),
            pursue("fetch the object"),
            STOP,
        )
        assert robot.wait(timeout=30.0) == 0
    assert refused["status"] == _ABORTED
    assert "no installed module provides `fly to the moon`" in refused["result"]["reason"]
    assert (cancelled["status"], cancelled["result"]["reason"]) == (_CANCELED, "cancelled by the client")
    assert (reached["status"], reached["result"]["reached"]) == (_SUCCEEDED, True)
    assert reached["feedback"][-1]["event"] == "run-ended"
    assert reached["result"]["allowed"] > 20
    asked = [one["details"]["instruction"] for one in domain.events() if one["event"] == "goal-requested"]
    assert asked == ["fly to the moon", "fetch the object", "fetch the object"]


@pytest.mark.deep
def test_a_robot_that_waits_for_its_first_goal_can_be_seen(tmp_path: Path) -> None:
    domain = Domain(environments(), tmp_path)
    picture, latched = "/aeros/camera/table_top/compressed", {"do": "subscribe", "latched": True}
    with domain.robot("serve", "clean the table", *_SERVE[2:]) as robot:
        *_, heard, _ = domain.ask(
            {"do": "subscribe", "topic": "/joint_states", "type": "sensor_msgs/msg/JointState"},
            {"do": "wait_for", **{name: STOP[name] for name in ("service", "type")}},
            {**latched, "topic": "/robot_description", "type": "std_msgs/msg/String"},
            {**latched, "topic": picture, "type": "sensor_msgs/msg/CompressedImage"},
            {"do": "listen", "seconds": 30.0, "until": "<robot name="},
            STOP,
        )
        assert robot.wait(timeout=30.0) == 0
    assert len(heard["/joint_states"]["last"]["position"]) == 7
    assert heard["/robot_description"]["count"] == heard[picture]["count"] == 1


@pytest.mark.deep
def test_without_aeros_msgs_it_says_how_to_build_them(tmp_path: Path) -> None:
    domain = Domain(environments(), tmp_path)
    with domain.robot(*_SERVE, is_plain=True) as robot:
        robot.wait(timeout=60.0)
    assert robot.returncode == Exit.REJECTED.value
    assert "`aeros ros2-messages`" in domain.output
