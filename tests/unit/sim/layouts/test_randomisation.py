"""Randomised scenes: within the declared ranges, each number drawn by itself, the same for the same seed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from aeros.sim.layouts.randomisation import has_ranges, randomise_scene
from aeros.spec.model.scene import Compound, Scene, UrdfModel
from aeros.spec.scenes.load import load_scene

_SCENE = """\
schema: aeros/scene/2
description: a can, a vase and a toy
randomise: {light: [0.5, 0.9], sensors: [2, 3]}
bodies:
  can:
    cylinder: [3 cm, 10 cm]
    at: [50 cm, 0 m, 5 cm]
    spread: [1 cm, 0 m, 0 m]
    mass: 200 g
    friction: 0.5
    colour: [0.5, 0.4, 1]
    randomise:
      {mass: [0.5, 2], friction: [0.8, 1.2], colour: 0.1, spread: [2 cm, 3 cm, 0 m], yaw_spread: 0.3 rad}
  toy:
    compound:
      - {at: [0 m, 0 m, 0 m], sphere: 2 cm}
    at: [0 m, 50 cm, 5 cm]
    mass: 100 g
    randomise: {colour: 0.2}
  wall: {box: [1 m, 1 cm, 1 m], at: [0 m, 1 m, 0 m], colour: [1, 1, 1]}
"""


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    path = tmp_path / "scene.yaml"
    path.write_text(_SCENE, encoding="utf-8")
    return load_scene(str(path))


def test_each_number_is_within_its_range_and_kept(scene: Scene) -> None:
    for seed in range(30):
        drawn_scene, drawn = randomise_scene(scene, seed)
        can, before = drawn_scene.bodies["can"], scene.bodies["can"]
        factors = {name: value for name, value in drawn.items() if isinstance(value, float)}
        assert drawn.keys() == {
            "light",
            "sensors",
            "can.mass",
            "can.friction",
            "can.colour",
            "toy.colour",
        }
        assert 0.5 <= factors["light"] <= 0.9
        assert 2.0 <= factors["sensors"] <= 3.0
        assert 0.5 <= factors["can.mass"] <= 2.0
        assert can.mass == factors["can.mass"] * before.mass
        assert can.friction == factors["can.friction"] * before.friction
        assert drawn_scene.sensor_factor == factors["sensors"]
        assert can.placement.spread == pytest.approx((0.03, 0.03, 0.0))
        assert can.placement.yaw_spread == pytest.approx(0.3)
        red, _, blue = can.colour
        change = drawn["can.colour"]
        assert isinstance(change, tuple)
        assert max(map(abs, change)) <= 0.1
        assert red == pytest.approx(factors["light"] * (0.5 + change[0]))
        assert blue == pytest.approx(factors["light"] * min(1.0, 1.0 + change[2]))
        assert drawn_scene.bodies["wall"].colour == pytest.approx((factors["light"],) * 3)


def test_parts_of_a_compound_change_together(scene: Scene) -> None:
    drawn_scene, drawn = randomise_scene(scene, 1)
    shape, change, light = drawn_scene.bodies["toy"].shape, drawn["toy.colour"], drawn["light"]
    assert isinstance(shape, Compound)
    assert isinstance(change, tuple)
    assert isinstance(light, float)
    assert shape.parts[0].colour == pytest.approx([light * (0.7 + one) for one in change])


def test_the_seed_alone_decides(scene: Scene) -> None:
    first, again, other = (randomise_scene(scene, seed) for seed in (3, 3, 4))
    assert first == again
    assert first.drawn != other.drawn


def test_another_body_changes_nothing_that_is_drawn_for_the_others(scene: Scene) -> None:
    alone = replace(scene, bodies={"can": scene.bodies["can"]})
    whole = randomise_scene(scene, 5).drawn
    assert randomise_scene(alone, 5).drawn == {name: one for name, one in whole.items() if "toy" not in name}


def test_links_of_a_model_get_the_factor_of_its_friction(scene: Scene) -> None:
    model = UrdfModel("vase.urdf", ("a", "lid"), {}, {"lid": 0.2})
    vase = replace(scene.bodies["can"], shape=model)
    drawn_scene, drawn = randomise_scene(replace(scene, bodies={"can": vase}), 2)
    shape, factor = drawn_scene.bodies["can"].shape, drawn["can.friction"]
    assert isinstance(shape, UrdfModel)
    assert isinstance(factor, float)
    assert shape.link_friction == {"lid": pytest.approx(0.2 * factor)}


def test_a_scene_without_ranges_has_nothing_to_draw(scene: Scene) -> None:
    assert has_ranges(scene)
    plain = replace(scene, variation=None, bodies={"wall": scene.bodies["wall"]})
    assert not has_ranges(plain)
    drawn_scene, drawn = randomise_scene(plain, 1)
    assert (drawn_scene, drawn) == (plain, {})
