"""Detections in pictures of the table and the bench, compared with the truth, which only tests may read."""

from __future__ import annotations

from math import dist, pi
from typing import Any

import numpy as np
import pytest

from aeros.perception.rectangles import min_area_rectangle
from aeros.sim.bullet.renderer import Image
from aeros.sim.geometry import Pose, yaw_of
from aeros.sim.layouts import dumpling_bench as bench
from aeros.sim.perception.bench_detection import detect_bench, is_filling_visible
from aeros.sim.perception.table_detection import detect_table
from aeros.sim.physics import NoDisturbance, PhysicsPlant, PlantParts, make_plant
from aeros.skill import act
from tests.shipped_scenes import overhead, shipped_scene
from tests.unit.sim.acting import allow, execute

pytestmark = pytest.mark.physics


class Onlooker(NoDisturbance):
    """Knows the stage."""

    def attach(self, stage: PlantParts) -> None:
        self.stage = stage

    def pose(self, thing: str) -> Pose:
        return self.stage.world.pose(self.stage.scene.body(thing))

    def push(self, thing: str, newtons: float) -> None:
        self.stage.world.push(self.stage.scene.body(thing), (0.0, newtons, 0.0))


def made(scene: str, seed: int) -> tuple[PhysicsPlant, Onlooker]:
    onlooker = Onlooker()
    return make_plant(shipped_scene(scene), seed, disturbance=onlooker), onlooker


def apart(a: float, b: float, period: float) -> float:
    """Between two headings of what looks alike when turned by `period`."""
    return abs((a - b + period / 2.0) % period - period / 2.0)


@pytest.mark.parametrize("seed", range(6))
def test_sponge_and_clutter_are_seen_where_they_are(seed: int) -> None:
    plant, onlooker = made("table", seed)
    view = detect_table(onlooker.stage.world.renderer.render(overhead("table")), overhead("table"))
    assert view.sponge is not None
    assert dist(view.sponge.position, onlooker.pose("sponge").position) < 0.003
    assert apart(view.sponge.grip_yaw or 0.0, yaw_of(onlooker.pose("sponge").orientation), pi) < 0.08
    for seen, thing in zip(view.pieces, ("cube", "can"), strict=True):
        assert dist(seen.position, onlooker.pose(thing).position) < 0.003
    assert apart(view.pieces[0].grip_yaw or 0.0, yaw_of(onlooker.pose("cube").orientation), pi / 2.0) < 0.1
    plant.close()


@pytest.mark.parametrize("seed", range(6))
def test_wrapper_and_filling_are_seen_where_they_are(seed: int) -> None:
    plant, onlooker = made("dumpling_bench", seed)
    view = detect_bench(
        onlooker.stage.world.renderer.render(overhead("dumpling_bench")), overhead("dumpling_bench")
    )
    plate = onlooker.pose("wrapper")
    assert view.wrapper is not None
    assert view.filling is not None
    assert dist(view.wrapper.middle, plate.position) < 0.003
    assert apart(view.wrapper.yaw, yaw_of(plate.orientation), 2.0 * pi) < 0.05
    assert view.wrapper.fold == pytest.approx(0.0, abs=0.02)
    assert dist(view.filling, onlooker.pose("filling").position) < 0.003
    plant.close()


@pytest.mark.parametrize("scene", ["table", "dumpling_bench"])
def test_an_empty_picture_shows_nothing(scene: str) -> None:
    plant, onlooker = made(scene, 0)
    camera = overhead(scene)
    picture = onlooker.stage.world.renderer.render(camera)
    grey = Image(np.full_like(picture.rgb, 128), picture.depth)
    assert detect_table(grey, camera) == (None, ())
    assert detect_bench(grey, camera) == (None, None)
    wrapper = bench.WrapperDetection(bench.ALIGNED_POSITION, 0.0, pi)
    assert not is_filling_visible(grey, camera, wrapper)
    plant.close()


def test_a_rectangle_is_found_at_any_heading() -> None:
    grid = np.stack(np.meshgrid(np.linspace(-0.05, 0.05, 21), np.linspace(-0.02, 0.02, 9)), -1).reshape(-1, 2)
    for heading in np.arange(0.0, pi / 2.0, 0.1):
        c, s = np.cos(heading), np.sin(heading)
        found = min_area_rectangle(grid @ np.array(((c, s), (-s, c))) + (0.3, -0.2))
        assert (found.x, found.y) == pytest.approx((0.3, -0.2), abs=1e-3)
        assert sorted((found.length, found.width)) == pytest.approx([0.04, 0.1], abs=2e-3)
        assert apart(found.heading, float(heading), pi / 2.0) < 0.01


MOVED = (
    ("table", "sponge", "sponge_position", 15.0),
    ("dumpling_bench", "wrapper", "wrapper_position", 15.0),
    ("dumpling_bench", "filling", "filling_position", 4.0),
)
"""A scene, a thing to push, the variable of its place, and a force for one tick, N."""


@pytest.mark.parametrize(("scene", "thing", "name", "force"), MOVED)
def test_a_moved_object_is_not_noticed_before_the_next_picture(
    scene: str, thing: str, name: str, force: float
) -> None:
    """Skills and planner know the world by cameras, contacts and encoders alone."""
    plant, onlooker = made(scene, 0)
    before, was = readings_of(plant), onlooker.pose(thing).position
    onlooker.push(thing, force)
    assert execute(plant, act("wait", duration=0.5), allow, 9.0).completed
    assert dist(onlooker.pose(thing).position, was) > 0.02
    unmoved = {key: value for key, value in readings_of(plant).items() if key.split("_")[0] not in ROBOT}
    assert unmoved == {key: before[key] for key in unmoved}
    assert execute(plant, act("look", camera="overhead"), allow, 9.0).completed
    assert dist(readings_of(plant)[name], before[name]) > 0.02
    plant.close()


ROBOT = {
    "joint",
    "tool",
    "link",
    "tracking",
    "contact",
    "finger",
    "grip",
    "base",
    "holding",
    "human",
    "estop",
}
"""First words of what is measured of the robot itself and of people."""


def readings_of(plant: PhysicsPlant) -> dict[str, Any]:
    return {name: reading.value for name, reading in plant.observe().items()}
