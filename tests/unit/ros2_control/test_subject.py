"""The plant keeps the promises of its port, on the controller in a foreign process."""

from __future__ import annotations

import sys

import pytest

from aeros.ros2_control.subject import control_subject
from aeros.sim.conformance.suite import CHECKS, Check
from aeros.wired_arm.settings import SettingsError
from tests.unit.ros2_control.foreign.stub import VARIABLES, stub_controller
from tests.unit.ros2_control.test_settings import CELL
from tests.unit.runtime.bus.ros2.foreign.environments import Domain


def test_without_a_site_it_says_which_variable_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("AEROS_ROS2_CONTROL_SITE", raising=False)
    with pytest.raises(SettingsError, match="set AEROS_ROS2_CONTROL_SITE to the site file"):
        control_subject()


@pytest.mark.deep
@pytest.mark.parametrize("check", CHECKS, ids=lambda one: one.__name__)
def test_every_promise_is_kept(check: Check, monkeypatch: pytest.MonkeyPatch, domain: Domain) -> None:
    for name, value in {**domain.variables, **VARIABLES}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("AEROS_ROS2_CONTROL_SITE", str(CELL))
    monkeypatch.setattr(sys, "executable", str(domain.found.robot))
    with stub_controller(domain):
        check(control_subject())
