"""Sections of every kind of shape in a MuJoCo world."""

from __future__ import annotations

import numpy as np
import pytest

from aeros.sim.geometry import UPRIGHT, Pose
from aeros.sim.mujoco.cut_bodies import bounds_of
from aeros.sim.mujoco.engine import MujocoEngine
from aeros.sim.mujoco.plans import ShapePlan
from aeros.sim.scanners.sections import Disc
from aeros.spec.model.scene import Box, Cylinder, Sphere
from tests.unit.sim.engine.declared_bodies import body

pytestmark = pytest.mark.physics


def test_boxes_cylinders_spheres_and_hulls_are_cut() -> None:
    engine = MujocoEngine()
    for x, shape in enumerate((Box((0.2, 0.4, 1.0)), Cylinder(0.1, 1.0), Sphere(0.5))):
        engine.add_body(body(shape=shape), Pose((2.0 * x, 0.0, 0.0), UPRIGHT))
    corners = tuple((x, y, z) for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.5, 0.5))
    hull = engine.world.bodies.add_moved(ShapePlan("hull", (0.0, 0.0, 0.0), corners=corners), ())
    engine.world.bodies.move(hull, (6.0, 0.0, 0.0))
    engine.world.step()
    found = engine.cut_bodies(0.3, list).sections()
    assert [round(one.x, 6) for one in found] == [0.0, 2.0, 4.0, 6.0]
    ball = found[2]
    assert isinstance(ball, Disc)
    assert ball.radius == pytest.approx(0.4)


def test_bounds_of_a_turned_box_enclose_its_corners() -> None:
    engine = MujocoEngine()
    half = 0.5**0.5
    engine.add_body(body(shape=Box((0.2, 0.4, 0.6))), Pose((1.0, 2.0, 3.0), (0.0, 0.0, half, half)))
    low, high = bounds_of(engine.world.bodies.built())
    assert np.allclose(low, [[0.8, 1.9, 2.7]])
    assert np.allclose(high, [[1.2, 2.1, 3.3]])
