"""The port of physics engines, on each: weight, friction, pushes, rays, people, hands and sections."""

from __future__ import annotations

from math import dist, inf, pi, sqrt
from pathlib import Path

import numpy as np
import pytest

from aeros.sim.engine.carried_way import LIFT, MAX_FORCE
from aeros.sim.engine.engine import Engine
from aeros.sim.engine.world import GRAVITY
from aeros.sim.geometry import UPRIGHT, Camera, Pose
from aeros.sim.scanners.sections import Disc, Polygon
from aeros.spec.model.scene import Cylinder, Joint, UrdfModel
from tests.unit.sim.engine.declared_bodies import body
from tests.unit.sim.engine.engines import GREY, engine

pytestmark = pytest.mark.physics

__all__ = ["engine"]

FLAP = """<robot name="flap"><link name="post"><inertial><mass value="1"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
<collision><geometry><box size="0.02 0.1 0.1"/></geometry></collision></link>
<link name="leaf"><inertial><origin xyz="0.1 0 0"/><mass value="0.2"/>
<inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial>
<collision><origin xyz="0.1 0 0"/><geometry><box size="0.1 0.1 0.01"/></geometry></collision></link>
<joint name="hinge" type="revolute"><parent link="post"/><child link="leaf"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1.5" effort="10" velocity="10"/></joint></robot>"""


def floor(engine: Engine) -> int:
    return engine.add_box((2.0, 2.0, 0.1), (0.0, 0.0, -0.05), mass=0.0, colour=GREY)


def steps(engine: Engine, ticks: int) -> None:
    for _ in range(ticks):
        engine.world.step()


def test_a_body_at_rest_presses_with_its_weight(engine: Engine) -> None:
    ground = floor(engine)
    box = engine.add_box((0.1, 0.1, 0.1), (0.3, 0.0, 0.05), mass=2.0, colour=GREY)
    steps(engine, 120)
    contacts = engine.world.contacts(box, ground)
    assert sum(one.force for one in contacts) == pytest.approx(2.0 * GRAVITY, rel=0.02)
    assert all(one.normal[2] > 0.99 and one.body_b == ground for one in contacts)
    below = engine.world.contacts(ground, box, -1)
    assert all(one.normal[2] < -0.99 and one.body_b == box for one in below)
    assert len(below) == len(contacts)
    assert engine.world.contacts(box, box) == []
    assert engine.world.pose(box).position == pytest.approx((0.3, 0.0, 0.05), abs=1e-3)


@pytest.mark.parametrize(("force", "slides"), [(0.8, False), (1.3, True)])
def test_coefficients_of_touching_surfaces_are_multiplied(engine: Engine, force: float, slides: bool) -> None:
    """0.5 · 0.6 · 0.4 kg · 9.81 m/s² = 1.18 N."""
    floor(engine)  # of friction 0.6
    number = engine.add_body(
        body(friction=0.5, mass=0.4, spinning=0.0), Pose((0.0, 0.0, 0.05), UPRIGHT)
    ).number
    for _ in range(120):
        engine.world.push(number, (force, 0.0, 0.0))
        engine.world.step()
    assert (engine.world.pose(number).position[0] > 0.02) is slides


def test_a_push_acts_for_one_tick(engine: Engine) -> None:
    box = engine.add_box((0.1, 0.1, 0.1), (0.0, 0.0, 5.0), mass=0.5, colour=GREY)
    engine.world.push(box, (0.0, 60.0, 0.0))
    steps(engine, 1)
    steps(engine, 24)
    # 60 N for 1/240 s make 0.5 m/s.
    assert engine.world.pose(box).position[1] == pytest.approx(0.5 * 25 / 240, rel=0.05)
    assert engine.world.time == 25 / 240


def test_a_ray_meets_the_nearest_body_and_no_person(engine: Engine) -> None:
    box = engine.add_box((0.2, 0.2, 0.2), (1.0, 0.0, 0.5), mass=0.0, colour=GREY)
    engine.add_person(1.8, 0.2).move((0.5, 0.0, 0.9))
    steps(engine, 1)
    assert engine.world.first_on_way((0.0, 0.0, 0.5), (0.8, 0.0, 0.5)) is None
    met = engine.world.first_on_way((0.0, 0.0, 0.5), (2.0, 0.0, 0.5))
    assert met is not None
    assert met[0] == box
    assert met[1] == pytest.approx(1.1, abs=1e-3)


def test_the_distance_of_a_person_is_from_the_nearest_surface(engine: Engine) -> None:
    box = engine.add_box((0.2, 0.2, 0.2), (0.0, 0.0, 0.9), mass=0.0, colour=GREY)
    person = engine.add_person(1.8, 0.25)
    person.move((1.0, 0.0, 0.9))
    steps(engine, 1)
    assert person.distance(box, 5.0) == pytest.approx(0.65, abs=2e-3)
    assert person.distance(box, 0.5) == inf
    person.move((0.3, 0.0, 0.9))
    steps(engine, 1)
    assert person.distance(box, 5.0) == pytest.approx(-0.05, abs=2e-3)


def test_a_person_who_comes_later_changes_nothing_else(engine: Engine) -> None:
    box = engine.add_box((0.1, 0.1, 0.1), (0.0, 0.0, 5.0), mass=0.5, colour=GREY)
    steps(engine, 12)
    fallen = engine.world.pose(box).position[2]
    person = engine.add_person(1.8, 0.25)
    person.move((0.0, 0.0, 5.0))
    assert engine.world.pose(box).position[2] == pytest.approx(fallen, abs=1e-12)
    steps(engine, 12)
    assert engine.world.contacts(box) == []
    assert engine.world.pose(box).position[2] == pytest.approx(5.0 - 0.5 * GRAVITY * 0.01, abs=4e-3)


@pytest.mark.parametrize("turn", [0.0, pi / 2.0])
def test_a_hand_carries_a_body_over_and_lets_it_go(engine: Engine, turn: float) -> None:
    floor(engine)
    can = engine.add_box((0.04, 0.04, 0.08), (0.0, 0.0, 0.04), mass=0.15, colour=GREY)
    goal = (0.4, -0.3, 0.05)
    hand = engine.carry(can, goal, turn, (1.0, 0.0, 0.0), lift=LIFT, strength=MAX_FORCE)
    heights = []
    for tick in range(1, 361):
        hand.push(tick / 360)
        engine.world.step()
        heights.append(engine.world.pose(can).position[2])
    place, orientation = engine.world.pose(can)
    assert max(heights) == pytest.approx(goal[2] + LIFT, abs=0.02)
    assert dist(place, goal) < 0.01
    assert 2.0 * abs(orientation[0] * orientation[3]) == pytest.approx(1.0 if turn else 0.0, abs=0.05)


def test_a_hand_does_not_hold_a_body_that_is_too_heavy(engine: Engine) -> None:
    heavy = engine.add_box((0.1, 0.1, 0.1), (0.0, 0.0, 2.0), mass=2.0, colour=GREY)
    hand = engine.carry(heavy, (0.0, 0.0, 2.0), 0.0, (0.0, 0.0, 1.0), lift=0.0, strength=MAX_FORCE)
    for tick in range(1, 121):
        hand.push(tick / 120)
        engine.world.step()
    # (19.6 - 15) N / 2 kg for half a second.
    assert engine.world.pose(heavy).position[2] == pytest.approx(2.0 - 0.5 * 2.31 * 0.25, abs=0.02)


def test_a_place_is_occupied_as_far_as_the_bounds_of_a_body_reach(engine: Engine) -> None:
    box = engine.add_box((0.2, 0.2, 0.2), (0.0, 0.0, 0.1), mass=1.0, colour=GREY)
    other = engine.add_box((0.2, 0.2, 0.2), (3.0, 0.0, 0.1), mass=1.0, colour=GREY)
    steps(engine, 1)
    assert engine.is_occupied((-0.01, -0.01, 0.15), (0.01, 0.01, 0.4), box)
    assert not engine.is_occupied((-0.01, -0.01, 0.25), (0.01, 0.01, 0.4), box)
    assert not engine.is_occupied((-0.01, -0.01, 0.15), (0.01, 0.01, 0.4), other)


def test_a_plane_cuts_bodies_at_their_present_places(engine: Engine) -> None:
    floor(engine)
    post = engine.add_body(body(shape=Cylinder(0.1, 1.0)), Pose((1.0, 0.5, 0.5), UPRIGHT)).number
    box = engine.add_box((0.2, 0.2, 0.2), (0.0, 0.0, 0.4), mass=1.0, colour=GREY)
    steps(engine, 1)
    left_out: list[int] = []
    plane = engine.cut_bodies(0.35, lambda: left_out)
    seen = plane.sections()
    assert {type(one) for one in seen} <= {Disc, Polygon}
    assert sorted((round(one.x, 3), round(one.y, 3)) for one in seen) == [(0.0, 0.0), (1.0, 0.5)]
    assert plane.sections() is seen
    left_out.append(post)
    assert [round(one.x, 3) for one in plane.sections()] == [0.0]
    steps(engine, 60)
    assert plane.sections() == ()
    assert engine.world.pose(box).position[2] < 0.2


def test_a_hinge_turns_by_its_dry_friction_or_not_at_all(engine: Engine, tmp_path: Path) -> None:
    path = tmp_path / "flap.urdf"
    path.write_text(FLAP)
    shape = UrdfModel(
        str(path), ("post", "leaf"), {"hinge": "revolute"}, {}, {"hinge": Joint(1.0, (-0.5, 1.0))}
    )
    placed = engine.add_body(body(shape=shape), Pose((0.0, 0.0, 1.0), UPRIGHT))
    assert placed.links["leaf"] >= 0
    assert placed.links["post"] == -1
    hinge = placed.joints["hinge"]
    # Its weight gives 0.2 kg · 9.81 m/s² · 0.1 m = 0.2 N·m.
    steps(engine, 60)
    assert engine.world.joint_position(placed.number, hinge) == pytest.approx(0.0, abs=5e-3)
    engine.set_joint_friction(placed.number, hinge, 0.0)
    steps(engine, 240)
    assert engine.world.joint_position(placed.number, hinge) == pytest.approx(1.0, abs=0.02)
    leaf = engine.world.pose(placed.number, placed.links["leaf"])
    assert leaf.position == pytest.approx((0.0, 0.0, 1.0), abs=1e-3)
    assert engine.world.frame_pose(placed.number).position == pytest.approx((0.0, 0.0, 1.0))


def test_a_painted_picture_is_seen_on_its_surface(engine: Engine) -> None:
    floor(engine)
    rectangle = engine.add_painted_rectangle((-0.5, -0.5), (0.5, 0.5), 0.0)
    engine.world.renderer.paint(rectangle, np.full((4, 4, 3), (250, 0, 0), dtype=np.uint8))
    camera = Camera((0.0, -0.01, 1.0), (0.0, 0.0, 0.0), width=32, height=24)
    seen = engine.world.renderer.render(camera)
    red, green, _ = seen.rgb[12, 16].tolist()
    assert red > 100 > green
    assert seen.depth[12, 16] == pytest.approx(1.0, abs=2e-3)


def test_the_frame_of_a_body_is_not_its_centre_of_mass(engine: Engine, tmp_path: Path) -> None:
    path = tmp_path / "club.urdf"
    path.write_text(
        FLAP.replace('<link name="post"><inertial>', '<link name="post"><inertial><origin xyz="0 0 0.04"/>')
    )
    half = sqrt(0.5)
    shape = UrdfModel(str(path), ("post", "leaf"), {"hinge": "revolute"})
    placed = engine.add_body(body(shape=shape, mass=1.0), Pose((0.0, 0.0, 1.0), (half, 0.0, 0.0, half)))
    assert engine.world.frame_pose(placed.number).position == pytest.approx((0.0, 0.0, 1.0), abs=1e-9)
    assert engine.world.pose(placed.number).position == pytest.approx((0.0, -0.04, 1.0), abs=1e-9)
