"""Plants that are not where their decided motions have them, and report no tracking error, are stopped."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import inf
from typing import Any

import pytest

from aeros.runtime.gate.compiled.rules import MonitorRules
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.monitor.history import HistoryTracker
from aeros.runtime.monitor.monitor import RuntimeMonitor
from aeros.sim.kinematic.plant import KinematicPlant
from aeros.sim.kinematic.scenes.declared_scene import DeclaredScene
from aeros.skill import Action, act
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import execute

MOVE = act("move_tool", target=(0.45, 0.1, 0.35), yaw=0.0, speed=0.25)
DRIVE = act("move_base", x=0.0, y=-0.8, speed=0.3)
Lie = Callable[[dict[str, Any], dict[str, Any]], None]


class LyingPlant(KinematicPlant):
    """A kinematic plant that shows other values than it has; `lie` gets its values and its first ones."""

    def __init__(self, lie: Lie, scene: str) -> None:
        self.lie: Lie | None = None
        super().__init__(DeclaredScene(shipped_scene(scene)), 0)
        self.lie, self.first = lie, super()._fast_values()

    def _fast_values(self) -> dict[str, Any]:
        values = super()._fast_values()
        if self.lie is not None and self._ticks > 12:
            self.lie(values, self.first)
        return values


def nothing(values: dict[str, Any], first: dict[str, Any]) -> None:
    """Return the measured values unchanged."""


def beside(values: dict[str, Any], first: dict[str, Any]) -> None:
    """Its first joint is 60 mrad beside its path."""
    q = values["joint_position"]
    values.update(joint_position=(q[0] + 0.06, *q[1:]), tracking_error=0.0)


def stuck(values: dict[str, Any], first: dict[str, Any]) -> None:
    """It does not move at all."""
    values.update(joint_position=first["joint_position"], tracking_error=0.0)


def silent(values: dict[str, Any], first: dict[str, Any]) -> None:
    """It does not show its joints any more."""
    del values["joint_position"]


def adrift(values: dict[str, Any], first: dict[str, Any]) -> None:
    """Its base slips 20 mm aside."""
    x, y, z = values["base_position"]
    values.update(base_position=(x, y + 0.02, z), tracking_error=0.0)


def honest(values: dict[str, Any], first: dict[str, Any]) -> None:
    """It says that it is 11 mm off, and is not."""
    values["tracking_error"] = 0.011


def buzzing(values: dict[str, Any], first: dict[str, Any]) -> None:
    """The torque of its wrist changes faster than the arm's limit."""
    values["joint_torque_rate"] = (0.0,) * 6 + (-1001.0,)


@pytest.fixture(scope="module")
def site() -> Site:
    found = load_site(reference_site_path(), Diagnostics())
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("lie", "action", "reason"),
    [
        (nothing, MOVE, None),
        (nothing, DRIVE, None),
        (beside, MOVE, "monitor:decided-path"),
        (beside, DRIVE, "monitor:decided-path"),
        (stuck, MOVE, "monitor:decided-path"),
        (silent, MOVE, "monitor:input:joint_position"),
        (adrift, MOVE, "monitor:decided-path"),
        (adrift, DRIVE, "monitor:decided-path"),
        (honest, MOVE, "monitor:tracking"),
        (buzzing, MOVE, "monitor:joint-torque-rates"),
        (buzzing, DRIVE, "monitor:joint-torque-rates"),
    ],
)
def test_a_plant_is_stopped_by_measurements_and_not_by_its_claims(
    lie: Lie, action: Action, reason: str | None, site: Site
) -> None:
    plant = LyingPlant(lie, "fetch")
    watch = RuntimeMonitor(MonitorRules(site), HistoryTracker(site))
    plan = plant.plan(action)
    watch.add(ActiveAction(action, plant.observe(), plant.now(), 0), plan)
    seen: list[Mapping[str, Any]] = []

    def monitor(now: float, values: Mapping[str, Any]) -> str | None:
        seen.append(values)
        return watch(now, values)

    ended = execute(plant, action, monitor, inf, plan)
    assert (ended.completed, ended.reason) == (reason is None, reason)
    assert len(seen) > 12
    plant.close()
