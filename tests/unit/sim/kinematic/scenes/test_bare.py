"""The empty table without physics."""

from __future__ import annotations

from typing import Any, cast

import pytest

from aeros.sim.geometry import Pose, yaw_orientation
from aeros.sim.kinematic.objects import Surface
from aeros.sim.kinematic.scenes.bare import TABLE, KinematicBareScene
from aeros.sim.randomness import RandomSource

NOBODY = cast("Any", None)


def test_the_table_is_under_the_robot_and_1_m_before_it() -> None:
    assert Surface(Pose((0.4, 0.0, 0.0), yaw_orientation(0.0)), (0.7, 0.8)) == TABLE
    assert TABLE.is_under((1.09, 0.79, 0.1))
    assert not TABLE.is_under((1.11, 0.0, 0.1))


def test_an_empty_table_supports_the_hand_and_holds_no_objects() -> None:
    scene = KinematicBareScene()
    things = scene.build(RandomSource(0))
    scene.tick()
    assert not things.is_holding
    # The pads reach 9 mm below the tool: 1 mm into the table, at 10 kN/m.
    things.tick(Pose((0.5, 0.0, 0.008), yaw_orientation(0.0)), 0.02)
    assert things.load == pytest.approx(10.0)
    assert scene.measure(NOBODY, 0.0) == {}


def test_an_empty_table_has_no_camera() -> None:
    with pytest.raises(KeyError, match="mast"):
        KinematicBareScene().detect("mast", NOBODY, 0.0, 0.0)
