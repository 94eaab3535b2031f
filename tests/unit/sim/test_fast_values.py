"""Speeds and forces given to the monitor equal an independent computation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import inf
from typing import Any

import numpy as np
import pytest

from aeros.runtime.ports import MotionCompletion, Plant
from aeros.sim.clock import TICK
from aeros.sim.kinematic.plant import make_plant as make_kinematic
from aeros.skill import Action
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import allow, execute
from tests.unit.sim.conformance.subjects import JOINTS, PRESSING, REACH, TOGETHER
from tests.unit.sim.referee import points_of


def physics(scene: str) -> Plant:
    from aeros.sim.physics import make_plant

    return make_plant(shipped_scene(scene), 0)


def kinematic(scene: str) -> Plant:
    return make_kinematic(shipped_scene(scene), 0)


BOTH = pytest.mark.parametrize("make", [kinematic, pytest.param(physics, marks=pytest.mark.physics)])


def followed(plant: Plant, *actions: Action) -> dict[str, np.ndarray[Any, Any]]:
    """Run actions at the same time and return the values that the monitor saw, tick by tick."""
    for action in actions:
        assert not isinstance(plant.begin(action), MotionCompletion)
    # By time: where one of them ends, the same tick is looked at again.
    log: dict[float, Mapping[str, Any]] = {}

    def monitor(now: float, values: Mapping[str, Any]) -> str | None:
        log[now] = dict(values)
        return None

    for _ in actions:
        assert all(one.completed for one in plant.advance(monitor, inf).values())
    names = ("joint_position", "base_position", "tool_position", "link_speed", "tool_speed", "base_speed")
    return {name: np.array([values[name] for values in log.values()]) for name in names}


@BOTH
@pytest.mark.parametrize(("scene", "actions"), [("bare", (REACH,)), ("bare", (JOINTS,)), ("fetch", TOGETHER)])
def test_speeds_match_the_change_of_positions(
    make: Callable[[str], Plant], scene: str, actions: tuple[Action, ...]
) -> None:
    plant = make(scene)
    seen = followed(plant, *actions)
    plant.close()
    base = seen["base_position"]
    points = points_of(seen["joint_position"]) + base[:, None, :]
    points = np.concatenate([points, seen["tool_position"][:, None, :]], axis=1)
    on_base = points - base[:, None, :]
    ways = {
        # What counts is the faster of a link in W and on the base, as a base that brakes is slow at once.
        "link_speed": np.maximum(
            *(np.linalg.norm(np.diff(one, axis=0), axis=2).max(axis=1) for one in (points, on_base))
        ),
        "tool_speed": np.linalg.norm(np.diff(seen["tool_position"], axis=0), axis=1),
        "base_speed": np.linalg.norm(np.diff(base, axis=0), axis=1),
    }
    for name, way in ways.items():
        between = (seen[name][:-1] + seen[name][1:]) / 2.0
        assert np.abs(way / TICK - between).max() < 0.01, name
    assert seen["link_speed"].max() > 0.3


@pytest.mark.physics
def test_the_contact_force_agrees_with_the_wrist_sensor() -> None:
    plant = physics("bare")
    *before, slide = PRESSING
    for action in before:
        assert execute(plant, action, allow, inf).completed
    tare = plant._robot.wrist_vertical_force()  # type: ignore[attr-defined]
    forces: list[tuple[float, float]] = []

    def monitor(now: float, values: Mapping[str, Any]) -> str | None:
        forces.append((values["contact_force"], plant._robot.wrist_vertical_force() - tare))  # type: ignore[attr-defined]
        return None

    assert execute(plant, slide, monitor, inf).completed
    plant.close()
    steady = np.array(forces)[-120:-60].mean(axis=0)
    assert steady[1] == pytest.approx(slide.parameters["force"], abs=1.0)
    # Friction along the way comes to it, at right angles.
    assert steady[1] - 0.5 < steady[0] < 1.5 * steady[1]
