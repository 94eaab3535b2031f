"""The table without physics: only a held sponge that is pressed on it wipes."""

from __future__ import annotations

from math import inf
from typing import Any, cast

import pytest

from aeros.runtime.ports import Plant
from aeros.sim.geometry import Pose, add, yaw_orientation
from aeros.sim.kinematic.objects import ObjectSet
from aeros.sim.kinematic.plant import make_plant
from aeros.sim.kinematic.scenes.declared_scene import DeclaredScene
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotState
from aeros.skill import Action, act
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import allow, execute
from tests.unit.sim.start_layouts import TableLayout, table_layout


def observed(plant: Plant) -> dict[str, Any]:
    return {name: reading.value for name, reading in plant.observe().items()}


def move(x: float, y: float, z: float, yaw: float = 0.0, speed: float = 0.25) -> Action:
    return act("move_tool", target=(x, y, z), yaw=yaw, speed=speed)


def test_wiping_without_a_sponge_in_the_hand_wipes_nothing() -> None:
    plant = make_plant(shipped_scene("table"), 0)
    for action in (
        act("grip", width=0.0, force=10.0),
        move(0.5, 0.1, 0.02),
        act("slide", target=(0.5, -0.1, 0.0), force=4.0, speed=0.1),
    ):
        assert execute(plant, action, allow, inf).completed
    assert observed(plant)["wiped_fraction"] == 0.0


SEED = 3
NOBODY = cast("Any", None)
SOMEWHERE = RobotState((0.0,) * 7, (0.0,) * 7, (0.0,) * 7, (9.0,) * 3, 0.0, 0.08, 0.0, (0.0,) * 3, (0.0,) * 3)


def _table() -> tuple[DeclaredScene, ObjectSet, TableLayout]:
    scene = DeclaredScene(shipped_scene("table"))
    return scene, scene.build(RandomSource(SEED)), table_layout(SEED)


def _look(scene: DeclaredScene) -> dict[str, Any]:
    return dict(scene.detect("overhead", SOMEWHERE, 0.0, 0.0))


def _carry(things: ObjectSet, thing: Pose, place: tuple[float, float, float], gap: float = 0.04) -> None:
    """Grip an object at its middle, carry the tool to a place, and let go."""
    things.grip(Pose(add(thing.position, (0.0, 0.0, 0.015)), thing.orientation))
    things.tick(Pose(place, thing.orientation), gap)
    things.release()


def test_a_table_shows_what_lies_on_it() -> None:
    scene, _, laid = _table()
    seen = _look(scene)
    assert seen["sponge_position"] == pytest.approx(laid.rest)
    assert seen["clutter_position"] == pytest.approx((*laid.cube.position[:2], 0.02))
    assert (seen["clutter_on_table"], seen["wiping_area_clear"], seen["table_organized"]) == (
        True,
        True,
        False,
    )
    assert dict(scene.measure(NOBODY, 0.0)) == {
        "sponge_rest_position": laid.rest,
        "bin_position": (0.45, -0.5, pytest.approx(0.085)),
        "wiped_fraction": 0.0,
        "table_wiped": False,
    }


def test_objects_are_as_wide_as_they_are() -> None:
    _, things, laid = _table()
    x, y, z = laid.rest
    # The block on the sponge is 50 mm by 40 mm, from 19 to 49 mm over the sponge's middle.
    for height, width in ((0.011, 0.04), (0.057, 0.04), (0.009, None), (0.059, None)):
        found = things.width_between(Pose((x, y, z + height), laid.sponge.orientation))
        assert found == (None if width is None else pytest.approx(width, abs=1e-6))
    assert things.width_between(laid.cube) == pytest.approx(0.04)
    assert things.width_between(Pose(laid.can.position, yaw_orientation(0.6))) == pytest.approx(0.04)
    cx, cy, cz = laid.can.position
    assert things.width_between(Pose((cx, cy, cz + 0.032), yaw_orientation(0.0))) == pytest.approx(0.04)
    assert things.width_between(Pose((cx, cy, cz + 0.036), yaw_orientation(0.0))) is None


def test_an_object_in_the_hand_is_not_detected() -> None:
    scene, things, laid = _table()
    things.grip(laid.cube)
    assert _look(scene)["clutter_position"] == pytest.approx((*laid.can.position[:2], 0.025))
    things.release()
    things.grip(Pose(add(laid.sponge.position, (0.0, 0.0, 0.03)), laid.sponge.orientation))
    seen = _look(scene)
    assert (seen["sponge_seen"], seen["sponge_position"]) == (False, None)


def test_a_table_is_organized_once_both_pieces_are_in_the_bin() -> None:
    scene, things, laid = _table()
    _carry(things, laid.cube, (0.42, -0.5, 0.2))
    assert _look(scene)["table_organized"] is False
    _carry(things, laid.can, (0.48, -0.5, 0.2))
    seen = _look(scene)
    assert (seen["table_organized"], seen["clutter_position"]) == (True, None)
    # It is organized, and still dirty.
    assert scene.detect("mast", SOMEWHERE, 0.0, 0.0) == {"table_verified": False}
    scene._coatings["dirt"].wiped[:] = True
    assert scene.detect("mast", SOMEWHERE, 0.0, 0.0) == {"table_verified": True}
    _carry(
        things, Pose(add(laid.sponge.position, (0.0, 0.0, 0.02)), laid.sponge.orientation), (0.5, 0.1, 0.1)
    )
    assert scene.detect("mast", SOMEWHERE, 0.0, 0.0) == {"table_verified": False}


@pytest.mark.parametrize(("depth", "wipes"), [(0.0002, True), (0.00005, False), (-0.001, False)])
def test_a_held_sponge_wipes_where_it_is_pressed_with_more_than_1_n(depth: float, wipes: bool) -> None:
    scene, things, laid = _table()
    x, y, z = laid.rest
    tool = Pose((x, y, z + 0.034), laid.sponge.orientation)
    things.grip(tool)
    # 10 kN/m: 0.2 mm too deep are 2 N.
    things.tick(Pose((0.5, 0.0, z + 0.034 - depth), tool.orientation), 0.04)
    scene.tick(SOMEWHERE)
    wiped = scene.measure(NOBODY, 0.0)["wiped_fraction"]
    # The foam covers 100 mm by 70 mm of 300 mm by 300 mm.
    assert wiped == (pytest.approx(70 / 900, abs=0.02) if wipes else 0.0)


def test_a_hand_without_the_sponge_wipes_nothing() -> None:
    scene, things, _ = _table()
    things.tick(Pose((0.5, 0.0, 0.005), yaw_orientation(0.0)), 0.04)
    assert things.load > 1.0
    scene.tick(SOMEWHERE)
    assert scene.measure(NOBODY, 0.0)["wiped_fraction"] == 0.0
