"""The carriage stops within its limit, whatever stops it, and does not push on at what is in its way."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from aeros.runtime.ports import MotionCompletion
from aeros.sim.clock import TICK
from aeros.sim.physics import PhysicsPlant, make_plant
from aeros.sim.robot.robot import BASE_ACCELERATION_MAX
from aeros.skill import act
from aeros.spec.scenes.load import add_scene
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import allow, recording

DIAGONAL = act("move_base", x=-0.4, y=0.3, speed=0.48)

WALL = """
schema: aeros/scene/2
description: a low wall behind the robot
bodies:
  wall:
    box: [100 mm, 1000 mm, 250 mm]
    at: [-500 mm, 0 mm, -174 mm]
"""

pytestmark = pytest.mark.physics

SCENE = "fetch"
"""Of the fixture `plant`."""


def held_back(plant: PhysicsPlant) -> dict[Any, MotionCompletion]:
    plant._robot.q_command = plant._robot.q_command + 0.1
    return dict(plant.advance(allow, inf))


def halted(plant: PhysicsPlant) -> dict[Any, MotionCompletion]:
    (drive,) = plant._under_way
    plant.halt(drive)
    return dict(plant.advance(allow, inf))


def forbidden(plant: PhysicsPlant) -> dict[Any, MotionCompletion]:
    return dict(plant.advance(lambda now, _: "near", inf))


@pytest.mark.parametrize(
    ("stopped", "why"),
    [(held_back, "blocked: the arm"), (halted, "halted"), (forbidden, "monitor:near")],
)
def test_a_drive_that_is_stopped_brakes_within_the_limit_on_the_way_that_it_was_on(
    plant: PhysicsPlant, stopped: Callable[[PhysicsPlant], dict[Any, MotionCompletion]], why: str
) -> None:
    assert not isinstance(plant.begin(DIAGONAL), MotionCompletion)
    assert plant.advance(allow, 0.8) == {}
    before = plant._robot.base_speed_command
    assert np.linalg.norm(before) > 0.4
    sent = [before]
    command = plant._robot.command_base

    def spy(xy: Any, speed: Any) -> None:
        sent.append(speed)
        command(xy, speed)

    plant._robot.command_base = spy  # type: ignore[method-assign]
    ((_, completion),) = stopped(plant).items()
    assert str(completion.reason).startswith(why)
    changes = np.linalg.norm(np.diff(sent, axis=0), axis=1) / TICK
    assert changes.max() <= 1.01 * BASE_ACCELERATION_MAX
    assert not sent[-1].any()


def test_a_wall_stops_the_carriage_which_then_stops_pushing_and_drives_away(tmp_path: Path) -> None:
    (tmp_path / "wall.yaml").write_text(WALL)
    plant = make_plant(add_scene(shipped_scene("fetch"), str(tmp_path / "wall.yaml")), 0)
    try:
        drive = plant.begin(act("move_base", x=-0.4, y=0.0, speed=0.48))
        assert not isinstance(drive, MotionCompletion)
        log: list[Mapping[str, Any]] = []
        completion = plant.advance(recording(log), inf)[drive]
        assert str(completion.reason).startswith("blocked: the carriage is held back at (-0.20")
        # Motors that had gone on would press with the 600 N that they have.
        assert max(one["contact_force"] for one in log) > 300.0
        assert plant.observe()["contact_force"].value < 65.0
        back = plant.begin(act("move_base", x=0.0, y=0.0, speed=0.3))
        assert not isinstance(back, MotionCompletion)
        assert plant.advance(allow, inf) == {back: MotionCompletion(True)}
        assert plant.observe()["contact_force"].value < 0.5  # the observer's own error
    finally:
        plant.close()
