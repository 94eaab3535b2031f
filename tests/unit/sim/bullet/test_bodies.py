"""Declared bodies in a world."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Any

import pytest

from aeros.sim.bullet.bodies import add_body
from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.engine.engine import PlacedBody
from aeros.sim.geometry import Pose, yaw_of, yaw_orientation
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.scene import (
    Basin,
    Box,
    Compound,
    Cylinder,
    Joint,
    Part,
    SceneBody,
    Sphere,
    UrdfModel,
)
from tests.unit.sim.engine.declared_bodies import body

pytestmark = pytest.mark.physics

MODEL = """<robot name="vase"><link name="a">
<inertial><mass value="0.8"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry><cylinder radius="0.05" length="0.2"/></geometry></collision></link></robot>
"""


def put(world: PhysicsWorld, declared: SceneBody) -> PlacedBody:
    """Add a body where it is declared."""
    placement = declared.placement
    return add_body(world, declared, Pose(placement.position, yaw_orientation(placement.yaw)))


def dynamics(world: PhysicsWorld, number: int) -> tuple[float, float]:
    """Mass and friction."""
    mass, friction = bullet.getDynamicsInfo(number, -1, physicsClientId=world.client)[:2]
    return mass, friction


@pytest.fixture
def world() -> Any:
    made = PhysicsWorld()
    yield made
    made.close()


@pytest.mark.parametrize(
    ("shape", "kind", "size"),
    [
        (Box((0.1, 0.2, 0.3)), bullet.GEOM_BOX, (0.1, 0.2, 0.3)),
        (Cylinder(0.05, 0.4), bullet.GEOM_CYLINDER, (0.4, 0.05)),
    ],
)
def test_a_body_is_as_declared(shape: Any, kind: int, size: tuple[float, ...], world: PhysicsWorld) -> None:
    declared = body(
        shape=shape,
        position=(1.0, 2.0, 3.0),
        yaw=pi / 3,
        mass=2.5,
        friction=0.25,
        colour=(0.1, 0.2, 0.3),
    )
    number = put(world, declared).number
    (visual,) = bullet.getVisualShapeData(number, physicsClientId=world.client)
    assert (visual[2], visual[7]) == (kind, pytest.approx((0.1, 0.2, 0.3, 1.0)))
    assert visual[3][: len(size)] == pytest.approx(size)
    assert dynamics(world, number) == (2.5, 0.25)
    pose = world.pose(number)
    assert pose.position == (1.0, 2.0, 3.0)
    assert yaw_of(pose.orientation) == pytest.approx(pi / 3)


@pytest.mark.parametrize(("mass", "falls"), [(0.0, False), (1.0, True)])
def test_a_model_is_fixed_or_has_its_own_mass(
    mass: float, falls: bool, tmp_path: Path, world: PhysicsWorld
) -> None:
    (tmp_path / "vase.urdf").write_text(MODEL)
    shape = UrdfModel(str(tmp_path / "vase.urdf"), ("a",), {})
    number = put(world, body(shape=shape, position=(0.0, 0.0, 5.0), mass=mass, yaw=0.5)).number
    assert dynamics(world, number)[1] == 0.5
    for _ in range(24):
        world.step()
    assert (world.pose(number).position[2] < 4.99) is falls
    assert yaw_of(world.pose(number).orientation) == pytest.approx(0.5, abs=1e-3)


def test_a_model_that_cannot_be_loaded_is_refused(tmp_path: Path, world: PhysicsWorld) -> None:
    with pytest.raises(UserError):
        put(world, body(shape=UrdfModel(str(tmp_path / "absent.urdf"), ("a",), {})))


def height_at(world: PhysicsWorld, x: float, y: float) -> float | None:
    """Height of what is first hit from above."""
    ((number, _, _, place, _),) = bullet.rayTest((x, y, 1.0), (x, y, -1.0), physicsClientId=world.client)
    return None if number < 0 else float(place[2])


def test_a_basin_has_a_floor_and_four_walls_of_5_mm(world: PhysicsWorld) -> None:
    """Inner 200 mm by 100 mm, 50 mm deep, around (1, 2) with its floor's top at 0.3 m."""
    put(world, body(shape=Basin((0.2, 0.1, 0.05)), position=(1.0, 2.0, 0.3)))
    assert bullet.getNumBodies(physicsClientId=world.client) == 1
    for off, height in (
        ((0.0, 0.0), 0.3),
        ((0.099, 0.049), 0.3),
        ((-0.099, -0.049), 0.3),
        ((0.101, 0.0), 0.35),
        ((-0.104, 0.054), 0.35),
        ((0.0, 0.051), 0.35),
        ((0.0, -0.054), 0.35),
        ((0.106, 0.0), None),
        ((0.0, -0.056), None),
    ):
        found = height_at(world, 1.0 + off[0], 2.0 + off[1])
        assert found == (None if height is None else pytest.approx(height, abs=1e-6)), off
    ((number, _, _, place, _),) = bullet.rayTest(
        (1.0, 2.0, -1.0), (1.0, 2.0, 1.0), physicsClientId=world.client
    )
    assert number >= 0
    assert place[2] == pytest.approx(0.295, abs=1e-6)


def test_a_compound_is_one_body_of_its_parts_in_their_colours(world: PhysicsWorld) -> None:
    red, green = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    parts = (
        Part(Box((0.2, 0.2, 0.02)), (0.0, 0.0, 0.0), red),
        Part(Cylinder(0.05, 0.2), (0.0, 0.0, 0.11), green),
        Part(Sphere(0.03), (0.08, 0.0, 0.04), green),
    )
    placed = put(world, body(shape=Compound(parts), position=(1.0, 0.0, 0.5), mass=0.7))
    assert dynamics(world, placed.number) == (0.7, 0.5)
    shapes = bullet.getVisualShapeData(placed.number, physicsClientId=world.client)
    assert [shape[7][:3] for shape in shapes] == [red, green, green]
    for x, height in ((1.0, 0.71), (1.049, 0.71), (1.08, 0.57), (0.92, 0.51), (0.89, None)):
        assert height_at(world, x, 0.0) == (None if height is None else pytest.approx(height, abs=1e-3)), x


def test_a_ball_rolls_until_its_resistance_stops_it(world: PhysicsWorld) -> None:
    world.bodies.add_box((4.0, 4.0, 0.1), (0.0, 0.0, -0.05), friction=1.0)
    free, slowed = (
        put(world, body(shape=Sphere(0.05), position=(0.0, y, 0.05), mass=0.2, rolling_resistance=lever))
        for y, lever in ((0.5, 0.0), (-0.5, 0.005))
    )
    for ball in (free, slowed):
        bullet.resetBaseVelocity(ball.number, (0.3, 0.0, 0.0), physicsClientId=world.client)
    for _ in range(240):
        world.step()
    rolled = [world.pose(ball.number).position[0] for ball in (free, slowed)]
    assert rolled[0] > 0.18
    assert rolled[1] < 0.6 * rolled[0]


def test_links_and_joints_of_a_model_are_set_by_their_names(tmp_path: Path, world: PhysicsWorld) -> None:
    joint = (
        '<link name="lid"><inertial><mass value="0.1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0"'
        ' izz="1"/></inertial></link>'
        '<joint name="hinge" type="revolute"><parent link="a"/><child link="lid"/>'
        '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    (tmp_path / "vase.urdf").write_text(MODEL.replace("</robot>", joint))
    model = UrdfModel(
        str(tmp_path / "vase.urdf"),
        ("a", "lid"),
        {"hinge": "revolute"},
        {"lid": 0.9},
        {"hinge": Joint(0.5, (-0.25, 0.25))},
    )
    placed = put(world, body(shape=model))
    assert (dict(placed.links), dict(placed.joints)) == ({"a": -1, "lid": 0}, {"hinge": 0})
    frictions = [
        bullet.getDynamicsInfo(placed.number, link, physicsClientId=world.client)[1] for link in (-1, 0)
    ]
    assert frictions == [0.5, 0.9]
    bullet.setJointMotorControl2(
        placed.number, 0, bullet.POSITION_CONTROL, targetPosition=0.9, physicsClientId=world.client
    )
    for _ in range(240):
        world.step()
    assert 0.2 < world.joint_position(placed.number, 0) < 0.3
