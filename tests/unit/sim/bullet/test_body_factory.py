"""Bodies stand where they were put, rest by their own size, and slide as far as friction lets them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pybullet
import pytest

from aeros.sim.bullet.world import PhysicsWorld
from aeros.spec.diagnostics.errors import UserError


@pytest.fixture
def world() -> Iterator[PhysicsWorld]:
    made = PhysicsWorld()
    yield made
    made.close()


def _pass_time(world: PhysicsWorld, ticks: int) -> None:
    for _ in range(ticks):
        world.step()


def test_a_fixed_box_stays_and_what_falls_on_it_rests_on_top(world: PhysicsWorld) -> None:
    floor = world.bodies.add_box((1.0, 1.0, 0.1), (0.0, 0.0, -0.05))
    cube = world.bodies.add_box((0.1, 0.1, 0.1), (0.0, 0.0, 0.06), mass=0.1)
    can = world.bodies.add_cylinder(0.03, 0.12, (0.3, 0.0, 0.07), mass=0.1)
    _pass_time(world, 240)
    assert world.pose(floor).position == (0.0, 0.0, -0.05)
    assert world.pose(cube).position[2] == pytest.approx(0.05, abs=0.002)
    assert world.pose(can).position[2] == pytest.approx(0.06, abs=0.002)
    assert world.contact_force(cube, floor) == pytest.approx(0.1 * 9.81, rel=0.05)


def test_a_pushed_box_slides_less_where_friction_is_set_higher(world: PhysicsWorld) -> None:
    world.bodies.add_box((2.0, 2.0, 0.1), (0.0, 0.0, -0.05), friction=1.0)
    boxes = [world.bodies.add_box((0.1, 0.1, 0.05), (0.0, y, 0.025), mass=1.0) for y in (-0.3, 0.3)]
    world.bodies.set_friction(boxes[0], -1, 0.1)
    world.bodies.set_friction(boxes[1], -1, 0.9)
    for _ in range(120):
        for box in boxes:
            world.push(box, (4.0, 0.0, 0.0))
        world.step()
    slippery, rough = (world.pose(box).position[0] for box in boxes)
    assert slippery > 0.05
    assert abs(rough) < 0.005


def test_a_model_that_is_not_there_or_is_none_is_refused(world: PhysicsWorld, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="AE002"):
        world.bodies.add_urdf(str(tmp_path / "missing.urdf"), (0.0, 0.0, 0.0))
    path = tmp_path / "broken.urdf"
    path.write_text("<robot>", encoding="utf-8")
    with pytest.raises(UserError, match="AE141"):
        world.bodies.add_urdf(str(path), (0.0, 0.0, 0.0))


def test_links_of_a_model_have_the_inertia_of_its_file(world: PhysicsWorld, tmp_path: Path) -> None:
    model = tmp_path / "brick.urdf"
    model.write_text(
        """<robot name="brick"><link name="brick"><inertial><mass value="2"/>
        <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.25"/></inertial>
        <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link></robot>"""
    )
    brick = world.bodies.add_urdf(str(model), (0.0, 0.0, 1.0))
    _, _, moments, *_ = pybullet.getDynamicsInfo(brick, -1, physicsClientId=world.client)
    assert moments == pytest.approx((0.1, 0.2, 0.25))
