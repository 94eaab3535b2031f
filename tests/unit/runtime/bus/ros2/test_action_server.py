"""A process without AEROS runs single skills where that is allowed, follows them and cancels them."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.unit.runtime.bus.ros2.foreign.environments import Domain

pytestmark = pytest.mark.deep

_SERVE = ("serve", "fetch the object", "--plant", "kinematic", "--state", "state", "--out", "out")
_SUCCEEDED, _CANCELED, _ABORTED = 4, 5, 6


def skill(name: str, **more: Any) -> dict[str, Any]:
    return {
        "do": "goal",
        "action": "/aeros/execute_skill",
        "type": "aeros_msgs/action/ExecuteSkill",
        "goal": {"module": "fetch_object", "skill": name},
        **more,
    }


def test_skills_run_fail_and_are_cancelled(domain: Domain) -> None:
    blocked = ("--id", "no", "--module", "fetch_object", "--skill", "deliver", "--reason", "not today")
    assert main(["block", "--state", str(domain.folder / "state"), *blocked]) == Exit.SUCCESS
    with domain.robot(*_SERVE, "--execute-skill"):
        cancelled, finished, unknown, malformed, denied = domain.ask(
            skill("navigate", cancel_after=1.5),
            skill("navigate"),
            skill("nosuch"),
            {**skill("navigate"), "goal": {"module": "fetch_object", "skill": "navigate", "inputs": "[]"}},
            skill("deliver"),
        )
    assert cancelled["status"] == _CANCELED
    assert cancelled["result"]["status"] == "cancelled"
    assert finished["status"] == _SUCCEEDED
    assert finished["result"]["allowed"] > 0
    assert finished["feedback"][-1]["allowed"] <= finished["result"]["allowed"]
    assert unknown["status"] == _ABORTED
    assert unknown["result"]["reason"] == "module `fetch_object` has no skill `nosuch`"
    assert malformed["result"]["reason"] == "the inputs are not a JSON object"
    assert denied["status"] == _ABORTED
    assert denied["result"]["status"] == "denied"
    assert "not today" in denied["result"]["reason"]
    events = domain.events()
    assert len([one for one in events if one["event"] == "decision"]) >= finished["result"]["allowed"]
    asked = [one["details"] for one in events if one["event"] == "goal-requested"]
    assert [one["skill"] for one in asked][:3] == ["navigate", "navigate", "nosuch"]
    assert {client["node"] for one in asked for client in one["clients"]} == {"/peer"}


def test_without_the_option_no_skill_can_be_asked_for(domain: Domain) -> None:
    with domain.robot(*_SERVE):
        _, services = domain.ask(
            {"do": "wait_for", "service": "/aeros/stop", "type": "std_srvs/srv/Trigger"},
            {"do": "services"},
        )
    assert not [name for name in services if "execute_skill" in name]
    assert "/aeros/pursue/_action/send_goal" in services
