"""A robot that is not the expected one is not opened, and the reason says why."""

from __future__ import annotations

import ast
from dataclasses import replace
from typing import Any

import pytest

from aeros.wired_arm.process import ProcessError
from tests.repo.tree import ROOT
from tests.unit.ros2_control.foreign.stub import JOINTS
from tests.unit.ros2_control.test_plant import SETTINGS, opened
from tests.unit.runtime.bus.ros2.foreign.environments import Domain


@pytest.mark.deep
@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"joints": [*JOINTS[:6], "elbow"]}, "moves the joints .*elbow, and not exactly fr3_joint1"),
        ({"busy": 60}, "executes a goal of another client: wait until it has ended, or cancel it"),
        ({"no_speeds": True}, "nothing on /joint_states has stamp, positions and velocities of fr3_joint1"),
    ],
)
def test_another_robot_is_not_opened(
    monkeypatch: pytest.MonkeyPatch, domain: Domain, options: dict[str, Any], words: str
) -> None:
    with pytest.raises(ProcessError, match=words), opened(monkeypatch, domain, **options):
        pass


@pytest.mark.deep
def test_a_controller_that_is_not_there_is_not_opened(
    monkeypatch: pytest.MonkeyPatch, domain: Domain
) -> None:
    other = replace(SETTINGS, controller="/other")
    words = "nobody offers the action /other/follow_joint_trajectory"
    with pytest.raises(ProcessError, match=words), opened(monkeypatch, domain, other):
        pass


def test_nothing_is_destroyed_while_the_executor_takes_its_messages() -> None:
    tree = ast.parse((ROOT / "aeros" / "ros2_control" / "ros_controller.py").read_text())
    calls = [
        (function.name, call.func.attr, call.lineno)
        for function in ast.walk(tree)
        if isinstance(function, ast.FunctionDef)
        for call in ast.walk(function)
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute)
    ]
    destroyed = [(name, line) for name, method, line in calls if method.startswith("destroy_")]
    (joined,) = [line for name, method, line in calls if (name, method) == ("close", "join")]
    assert destroyed
    assert all(name == "close" and line > joined for name, line in destroyed)
