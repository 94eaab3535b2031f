from __future__ import annotations

from math import cos, pi, sin

import pytest

from aeros.sim.geometry import Pose, yaw_of, yaw_orientation
from aeros.sim.kinematic.objects import CylindricalObject, GraspableObject, ObjectSet, slab


def test_a_box_turned_in_the_fingers_is_wider_and_a_round_thing_is_not() -> None:
    tool = Pose((0.0, 0.0, 0.0), yaw_orientation(0.0))
    corners = (-0.03, -0.02, -0.02), (0.03, 0.02, 0.02)
    assert GraspableObject(tool, *corners, 0.02).width_between(tool) == pytest.approx(0.04)
    for yaw in (0.3, -0.3, pi / 2):
        box = GraspableObject(Pose((0.0, 0.0, 0.0), yaw_orientation(yaw)), *corners, 0.02)
        assert box.width_between(tool) == pytest.approx(0.04 * cos(yaw) + 0.06 * abs(sin(yaw)))
        can = CylindricalObject(
            Pose((0.0, 0.0, 0.0), yaw_orientation(yaw)), (-0.02, -0.02, -0.02), (0.02, 0.02, 0.02), 0.02
        )
        assert can.width_between(tool) == pytest.approx(0.04)


# A table at 0, a block of 0.1 m at the origin, and cubes of 4 cm.

TABLE, BLOCK = slab(0.0, 0.0, 0.0, 4.0, 4.0), slab(0.0, 0.0, 0.1, 0.2, 0.2)
HALF = 0.02


def cube(x: float, y: float, z: float, *, yaw: float = 0.0, supports: bool = True) -> GraspableObject:
    top = slab(0.0, 0.0, HALF, 2 * HALF, 2 * HALF) if supports else None
    pose = Pose((x, y, z), yaw_orientation(yaw))
    return GraspableObject(pose, (-HALF,) * 3, (HALF,) * 3, HALF, top_surface=top)


def at(x: float, y: float, z: float, yaw: float = 0.0) -> Pose:
    return Pose((x, y, z), yaw_orientation(yaw))


def test_a_surface_is_under_what_is_over_it_and_up_to_5_mm_below_its_height() -> None:
    surface = slab(1.0, 2.0, 0.5, 0.4, 0.2)
    for place, is_under in (
        ((1.0, 2.0, 0.5), True),
        ((1.0, 2.0, 9.0), True),
        ((1.0, 2.0, 0.4951), True),
        ((1.0, 2.0, 0.4949), False),
        ((1.19, 2.09, 0.5), True),
        ((1.21, 2.0, 0.5), False),
        ((0.79, 2.0, 0.5), False),
        ((1.0, 2.11, 0.5), False),
        ((1.0, 1.89, 0.5), False),
    ):
        assert surface.is_under(place) is is_under, place


def test_a_turned_surface_is_under_what_is_over_its_own_sides() -> None:
    turned = slab(0.0, 0.0, 0.0, 0.4, 0.2, yaw=pi / 2)
    assert turned.is_under((0.0, 0.19, 0.0))
    assert not turned.is_under((0.19, 0.0, 0.0))


def test_objects_fall_onto_what_is_under_them_at_the_start() -> None:
    things = [cube(0.0, 0.0, 0.5), cube(1.0, 0.0, 0.5)]
    ObjectSet(things, [TABLE, BLOCK])
    assert things[0].pose.position == pytest.approx((0.0, 0.0, 0.12))
    assert things[1].pose.position == pytest.approx((1.0, 0.0, 0.02))


def test_an_object_is_between_the_pads_within_its_sides_and_9_mm_above_and_below() -> None:
    one = cube(0.0, 0.0, 0.0)
    for place, is_between in (
        ((0.0, 0.0, 0.0), True),
        ((0.019, -0.019, 0.0), True),
        ((0.021, 0.0, 0.0), False),
        ((0.0, -0.021, 0.0), False),
        ((0.0, 0.0, 0.0289), True),
        ((0.0, 0.0, 0.0291), False),
        ((0.0, 0.0, -0.0289), True),
        ((0.0, 0.0, -0.0291), False),
    ):
        assert (one.width_between(at(*place)) is not None) is is_between, place


def test_the_widest_object_between_the_fingers_counts() -> None:
    wide = GraspableObject(at(0.0, 0.0, 0.0), (-0.03, -0.03, -0.03), (0.03, 0.03, 0.03), 0.03)
    objects = ObjectSet([cube(0.0, 0.0, 0.5, supports=False), wide], [TABLE])
    assert objects.width_between(at(0.0, 0.0, 0.03)) == pytest.approx(0.06)
    assert objects.width_between(at(1.0, 0.0, 0.03)) is None


def test_a_gripped_object_keeps_its_place_and_turn_in_the_hand() -> None:
    one = cube(0.01, 0.0, 0.5, yaw=0.3)
    objects = ObjectSet([one], [TABLE])
    objects.grip(at(0.0, 0.0, 0.02))
    assert objects.is_holding
    assert objects.holds(one)
    objects.tick(at(0.5, 0.6, 0.4, pi / 2), 0.04)
    assert one.pose.position == pytest.approx((0.5, 0.61, 0.4))
    assert yaw_of(one.pose.orientation) == pytest.approx(pi / 2 + 0.3)
    assert objects.is_lifted(one)
    assert objects.load == 0.0


def test_a_load_on_a_gripped_object_comes_along_and_falls_after_it() -> None:
    below, above, beside = cube(0.0, 0.0, 0.02), cube(0.01, 0.0, 0.5, supports=False), cube(0.5, 0.0, 0.5)
    objects = ObjectSet([below, above, beside], [TABLE])
    assert above.pose.position[2] == pytest.approx(0.06)
    objects.grip(at(0.0, 0.0, 0.02))
    assert [objects.holds(one) for one in (below, above, beside)] == [True, True, False]
    objects.tick(at(1.0, 1.0, 0.3), 0.04)
    assert above.pose.position == pytest.approx((1.01, 1.0, 0.34))
    objects.release()
    assert not objects.is_holding
    assert below.pose.position == pytest.approx((1.0, 1.0, 0.02))
    assert above.pose.position == pytest.approx((1.01, 1.0, 0.06))
    assert beside.pose.position == pytest.approx((0.5, 0.0, 0.02))
    assert not objects.is_lifted(above)


def test_fingers_close_on_nothing_where_nothing_is() -> None:
    objects = ObjectSet([cube(0.0, 0.0, 0.5)], [TABLE])
    objects.grip(at(0.3, 0.0, 0.02))
    assert not objects.is_holding
    objects.release()


def test_a_held_object_presses_on_the_surface_that_it_is_pushed_into() -> None:
    one = cube(0.0, 0.0, 0.5)
    objects = ObjectSet([one], [TABLE])
    objects.grip(at(0.0, 0.0, 0.02))
    # 1 mm too low: 10 N; the tips are 9 mm below the tool and still above the table.
    objects.tick(at(0.0, 0.0, 0.019), 0.04)
    assert one.pose.position == pytest.approx((0.0, 0.0, 0.02))
    assert objects.load == pytest.approx(10.0)
    assert not objects.is_lifted(one)
    objects.tick(at(0.0, 0.0, 0.021), 0.04)
    assert objects.load == 0.0
    assert objects.is_lifted(one)


def test_the_finger_tips_press_by_the_one_that_is_deeper() -> None:
    step = slab(0.0, 0.5, 0.001, 0.1, 0.99)  # from y = 0.005 on, the table is 1 mm higher
    objects = ObjectSet([], [TABLE, step])
    objects.tick(at(0.0, 0.0, 0.008), 0.02)
    assert objects.load == pytest.approx(20.0)
    objects.tick(at(0.0, 0.0, 0.008), 0.0)
    assert objects.load == pytest.approx(10.0)
    objects.tick(at(0.0, 0.0, 0.011), 0.02)
    assert objects.load == 0.0


def test_a_round_object_is_as_wide_however_it_lies_and_turned() -> None:
    can = CylindricalObject(at(0.0, 0.0, 0.0, 0.7), (-0.02, -0.02, -0.02), (0.02, 0.02, 0.02), 0.02)
    assert can.width_between(at(0.0, 0.0, 0.0)) == pytest.approx(0.04)


def test_an_object_moves_with_the_fingers_but_not_below_its_support() -> None:
    one = cube(0.0, 0.0, 0.5)
    assert one.move_with_gripper(at(1.0, 2.0, 0.5, 0.3), 0.4) == 0.0
    assert one.pose == at(1.0, 2.0, 0.5, 0.3)
    assert one.move_with_gripper(at(1.0, 2.0, 0.4195), 0.4) == pytest.approx(5.0)
    assert one.pose.position == pytest.approx((1.0, 2.0, 0.42))
    one.drop_onto_support(0.1)
    assert one.pose.position == pytest.approx((1.0, 2.0, 0.12))
