"""A mirror shows what a world shows, and moves only with it."""

from __future__ import annotations

from math import dist
from pathlib import Path

import numpy as np
import pytest

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.engine import BulletEngine
from aeros.sim.bullet.mirror import BASE_LINK, SceneMirror, bodies_of, poses_of, shapes_of
from aeros.sim.bullet.robot import BulletRobot
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.engine.people import People, Person, Waypoint
from aeros.sim.geometry import UPRIGHT, Camera, Pose, yaw_orientation
from aeros.sim.randomness import RandomSource
from aeros.sim.scenes.physics_scene import PhysicsScene
from tests.shipped_scenes import SHIPPED, shipped_scene

pytestmark = pytest.mark.physics

VIEW = Camera(eye=(1.15, 0.55, 0.62), target=(0.42, 0.03, 0.1), field_of_view=40.0)


OFF_CENTRE = """<robot name="club"><link name="club">
<inertial><origin xyz="0.1 0 0.05" rpy="0 0.4 0"/><mass value="1"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
<visual><origin xyz="0.02 0.1 0"/><geometry><sphere radius="0.07"/></geometry></visual></link></robot>"""


@pytest.mark.parametrize("name", SHIPPED)
def test_a_mirrored_scene_looks_the_same_to_the_pixel(name: str) -> None:
    scene, world, other = PhysicsScene(shipped_scene(name)), PhysicsWorld(), PhysicsWorld()
    robot = BulletRobot(world, scene.robot)
    engine = BulletEngine(world)
    scene.build(engine, robot, RandomSource(0))
    People(engine, robot.body, [Person("guest", (Waypoint((0.5, 0.45)),))], RandomSource(0))
    mirror = SceneMirror(other.client)
    for body in bodies_of(world):
        if not shapes_of(world, [body]):  # what is painted on it is not mirrored
            bullet.removeBody(body, physicsClientId=world.client)
    shapes = shapes_of(world, bodies_of(world))
    mirror.add(shapes)
    for _ in range(2):
        for _ in range(120):
            world.step()
        mirror.place(poses_of(world, shapes))
        seen = world.renderer.render(scene.view).rgb
        assert len(np.unique(seen)) > 30
        assert np.array_equal(seen, other.renderer.render(scene.view).rgb)
    world.close()
    other.close()


def test_parts_are_where_they_are_on_a_body_that_is_heavier_at_one_end(tmp_path: Path) -> None:
    (tmp_path / "club.urdf").write_text(OFF_CENTRE)
    world, other = PhysicsWorld(), PhysicsWorld()
    world.bodies.add_urdf(str(tmp_path / "club.urdf"), (0.4, 0.0, 0.2), (0.0, 0.0, 0.6, 0.8))
    mirror = SceneMirror(other.client)
    shapes = shapes_of(world, bodies_of(world))
    mirror.add(shapes)
    mirror.place(poses_of(world, shapes))
    seen = world.renderer.render(VIEW).rgb
    assert len(np.unique(seen)) > 10
    assert np.array_equal(seen, other.renderer.render(VIEW).rgb)
    world.close()
    other.close()


def test_every_kind_of_shape_is_listed_with_its_size_and_place(tmp_path: Path) -> None:
    (tmp_path / "club.urdf").write_text(OFF_CENTRE)
    world = PhysicsWorld()
    box = world.bodies.add_box((0.1, 0.2, 0.3), (1.0, 0.0, 0.0), colour=(0.1, 0.2, 0.3, 1.0))
    can = world.bodies.add_cylinder(0.05, 0.4, (2.0, 0.0, 0.0))
    club = world.bodies.add_urdf(str(tmp_path / "club.urdf"), (0.4, 0.0, 0.2))
    world.bodies.add_textured_rectangle((0.0, 0.0), (1.0, 1.0), 0.0)
    bodies = bodies_of(world)
    assert bodies[:3] == [box, can, club]
    assert len(bodies) == 4
    shapes = shapes_of(world, bodies)
    assert [(one.body, one.link, one.mesh) for one in shapes] == [
        (box, BASE_LINK, ""), (can, BASE_LINK, ""), (club, BASE_LINK, ""),
    ]  # fmt: skip
    assert shapes[0].size == pytest.approx((0.1, 0.2, 0.3))
    assert shapes[0].colour == pytest.approx((0.1, 0.2, 0.3, 1.0))
    assert shapes[1].size[:2] == pytest.approx((0.4, 0.05))
    assert shapes_of(world, [can]) == [shapes[1]]
    assert shapes_of(world, []) == []
    world.close()


def test_poses_are_those_of_the_frames_that_shapes_are_placed_in(tmp_path: Path) -> None:
    (tmp_path / "club.urdf").write_text(OFF_CENTRE)
    world = PhysicsWorld()
    turned = yaw_orientation(0.5)
    box = world.bodies.add_box((0.1, 0.2, 0.3), (1.0, 2.0, 3.0), turned, mass=1.0)
    club = world.bodies.add_urdf(str(tmp_path / "club.urdf"), (0.4, 0.0, 0.2), turned)
    shapes = shapes_of(world, [club, box])
    by_body = {shape.body: pose for shape, pose in zip(shapes, poses_of(world, shapes), strict=True)}
    assert by_body[box].position == pytest.approx((1.0, 2.0, 3.0))
    assert by_body[box].orientation == pytest.approx(turned)
    # Not its centre of mass, which is off its frame.
    assert by_body[club].position == pytest.approx((0.4, 0.0, 0.2), abs=1e-6)
    assert by_body[club].orientation == pytest.approx(turned, abs=1e-6)
    assert dist(world.pose(club).position, (0.4, 0.0, 0.2)) > 0.1
    world.close()


def test_a_mirror_places_each_of_its_shapes_and_they_weigh_nothing() -> None:
    world, other = PhysicsWorld(), PhysicsWorld()
    for x in (0.0, 1.0):
        world.bodies.add_box((0.1, 0.1, 0.1), (x, 0.0, 0.5))
    mirror = SceneMirror(other.client)
    shapes = shapes_of(world, bodies_of(world))
    mirror.add(shapes[:1])
    mirror.add(shapes[1:])
    mirror.place([Pose((3.0, 0.0, 1.0), UPRIGHT), Pose((4.0, 0.0, 2.0), UPRIGHT)])
    for _ in range(10):
        other.step()
    assert [other.pose(body).position for body in bodies_of(other)] == [(3.0, 0.0, 1.0), (4.0, 0.0, 2.0)]
    with pytest.raises(ValueError, match="shorter"):
        mirror.place([])
    world.close()
    other.close()
