"""Bodies of every shape can be held by default, and none that cannot move."""

from __future__ import annotations

from aeros.spec.model.scene import Grip
from tests.shipped_scenes import shipped_scene


def test_a_movable_shape_is_held_by_all_of_it_unless_it_says_otherwise() -> None:
    fetch, table = shipped_scene("fetch").bodies, shipped_scene("table").bodies
    assert fetch["can"].grip == Grip((-0.022, -0.022, -0.04), (0.022, 0.022, 0.04))
    assert fetch["decoy"].grip == Grip((-0.02, -0.02, -0.025), (0.02, 0.02, 0.025))
    assert fetch["stand"].grip is None
    assert table["sponge"].grip == Grip((-0.025, -0.020, 0.019), (0.025, 0.020, 0.049))


def test_friction_has_defaults() -> None:
    can, wrapper = shipped_scene("fetch").bodies["can"], shipped_scene("dumpling_bench").bodies["wrapper"]
    assert (can.friction, can.spinning, can.rolling_resistance) == (0.6, 0.02, 0.001)
    assert (wrapper.friction, wrapper.rolling_resistance) == (0.8, 0.0)
