"""Obstacles against links: distances worked out by hand."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from math import pi

import pytest

from aeros.runtime.motion.obstacle_contact import (
    as_barrier,
    ends_at_obstacle,
    find_held_contact,
    find_obstacle_contact,
    obstacle_hull,
    trim_held_space,
)
from aeros.runtime.motion.swept_volume import BarrierBox, SweptMotion
from aeros.runtime.ports import Ball, Hull, Obstacle, RobotBody, Vec3

ORIGIN = (0.0, 0.0, 0.0)
ARM = RobotBody(
    ((0.0, 0.0, 0.0),),
    (0.5, 0.0, 0.0),
    # Coarse: one ball around the whole arm, which is a thin rod.
    (Ball("arm", 1, (0.25, 0.0, 0.0), 0.3), Ball("foot", 0, ORIGIN, 0.05)),
    (Hull("foot", 0, (ORIGIN,), 0.05), Hull("arm", 1, (ORIGIN, (0.5, 0.0, 0.0)), 0.02)),
    (("foot", "arm"),),
)
"""A rod of 0.5 m that turns about z."""

BALLS_ALONE = replace(ARM, hulls=(), exempt_pairs=())


def thing(name: str, lower: Vec3, upper: Vec3) -> Obstacle:
    return Obstacle(name, lower, upper, 1.0, "overhead", "bench")


def turning(
    start: float,
    end: float,
    body: RobotBody = ARM,
    base: Vec3 = ORIGIN,
    way: Vec3 = ORIGIN,
    held: Hull | None = None,
) -> SweptMotion:
    a, b, c, d = ((start + (end - start) * third / 3.0,) for third in range(4))
    return SweptMotion(body, ([(a, b, c, d)],), (0.0,), base, way, True, held)


ASIDE = thing("aside", (0.20, 0.10, -0.1), (0.40, 0.30, 0.1))


def test_a_link_keeps_the_clearance_from_an_obstacle() -> None:
    assert find_obstacle_contact(turning(0.0, 0.0), [ASIDE], 0.07) is None
    breach = find_obstacle_contact(turning(0.0, 0.0), [ASIDE], 0.09)
    assert breach is not None
    assert (breach.barrier, breach.link) == ("aside", "arm")


def test_an_obstacle_on_the_way_is_found_and_the_one_beyond_it_is_not() -> None:
    ahead, beyond = (
        thing("ahead", (-0.1, 0.3, -0.1), (0.1, 0.4, 0.1)),
        thing("beyond", (-0.5, -0.1, 0), (-0.4, 0.1, 0.1)),
    )
    breach = find_obstacle_contact(turning(0.0, pi / 2.0), [beyond, ahead], 0.01)
    assert breach is not None
    assert (breach.barrier, breach.link) == ("ahead", "arm")
    assert breach.path_parameter > 0.5
    assert find_obstacle_contact(turning(0.0, pi / 4.0), [beyond, ahead], 0.01) is None


def test_without_hulls_and_while_the_base_drives_the_balls_decide() -> None:
    assert find_obstacle_contact(turning(0.0, 0.0, BALLS_ALONE), [ASIDE], 0.07) is not None
    assert find_obstacle_contact(turning(0.0, 0.0, way=(0.0, -0.1, 0.0)), [ASIDE], 0.07) is not None
    # Both are clear of what is farther away.
    far = thing("far", (0.2, 0.5, -0.1), (0.4, 0.6, 0.1))
    assert find_obstacle_contact(turning(0.0, 0.0, BALLS_ALONE), [far], 0.07) is None


def test_an_obstacle_is_where_it_is_from_a_base_that_stands_elsewhere() -> None:
    moved = thing("moved", (1.20, 2.10, 0.4), (1.40, 2.30, 0.6))
    base = (1.0, 2.0, 0.5)
    assert find_obstacle_contact(turning(0.0, 0.0, base=base), [moved], 0.07) is None
    assert find_obstacle_contact(turning(0.0, 0.0, base=base), [moved], 0.09) is not None
    lower, *_, upper = obstacle_hull(moved, base).corners
    assert lower == pytest.approx(ASIDE.lower)
    assert upper == pytest.approx(ASIDE.upper)
    assert obstacle_hull(moved, base).joint == 0


def test_a_held_object_keeps_the_clearance_too_and_touches_the_arm() -> None:
    held = Hull("held", 1, ((0.45, 0.0, 0.0), (0.45, 0.2, 0.0)), 0.0)
    aside = thing("aside", (0.44, 0.10, -0.1), (0.6, 0.3, 0.1))
    assert find_obstacle_contact(turning(0.0, 0.0), [aside], 0.07) is None
    breach = find_obstacle_contact(turning(0.0, 0.0, held=held), [aside], 0.07)
    assert breach is not None
    assert breach.link == "held"


FOOT = BarrierBox("off-the-foot", (-0.1, -0.3, -0.3), (0.38, 0.3, -0.02), False, True, None)
"""The foot that the arm stands on: it ends 120 mm before the tool."""

GRIPPED = Hull("held", 1, ((0.4, -0.1, -0.1), (0.4, 0.1, 0.1), (0.6, -0.1, -0.1), (0.6, 0.1, 0.1)), 0.0)
"""The largest thing that may be held: 100 mm on each side of the tool."""


def test_a_held_object_is_no_larger_than_the_foot_beside_it_leaves_it() -> None:
    assert find_held_contact(turning(0.0, 0.0), [FOOT], 0.03) is None, "an empty hand"
    assert find_held_contact(turning(0.0, 0.0, held=GRIPPED), [], 0.03) is None
    assert find_held_contact(turning(0.0, 0.0, held=GRIPPED), [FOOT], 0.03) is None
    under_it = FOOT._replace(upper=(0.6, 0.3, -0.02))
    breach = find_held_contact(turning(0.0, 0.0, held=GRIPPED), [under_it], 0.03)
    assert breach is not None
    assert (breach.barrier, breach.link) == ("off-the-foot", "held")


def test_a_held_object_that_was_clear_of_the_foot_keeps_its_size_and_the_clearance() -> None:
    beside = FOOT._replace(lower=(-0.1, 0.38, -0.3), upper=(0.55, 0.6, 0.3))
    assert find_held_contact(turning(0.0, 0.2, held=GRIPPED), [beside], 0.03) is None
    breach = find_held_contact(turning(0.0, 1.0, held=GRIPPED), [beside], 0.03)
    assert breach is not None
    assert breach.path_parameter > 0.3


def test_obstacles_may_touch_each_other_and_links_are_compared_elsewhere() -> None:
    folded = replace(ARM, hulls=(*ARM.hulls, Hull("tip", 1, ((0.1, 0.0, 0.0),), 0.05)))
    near = thing("near", (0.20, 0.09, -0.1), (0.40, 0.30, 0.1))
    assert find_obstacle_contact(turning(0.0, 0.0, folded), [ASIDE, near, ASIDE], 0.03) is None


def test_the_end_of_a_motion_is_looked_at_alone() -> None:
    ahead = thing("ahead", (-0.1, 0.3, -0.1), (0.1, 0.4, 0.1))
    assert ends_at_obstacle(turning(0.0, pi / 2.0), [ahead], 0.01)
    assert not ends_at_obstacle(turning(0.0, pi), [ahead], 0.01)
    assert find_obstacle_contact(turning(0.0, pi), [ahead], 0.01) is not None
    driven = turning(0.0, 0.0, way=(0.0, 0.5, 0.0))
    assert not ends_at_obstacle(driven, [ASIDE], 0.02)
    assert ends_at_obstacle(turning(0.0, 0.0, way=(0.0, 0.2, 0.0)), [ASIDE], 0.02)


def test_an_obstacle_is_a_barrier_for_every_link() -> None:
    assert as_barrier(ASIDE) == BarrierBox("aside", ASIDE.lower, ASIDE.upper, False, False, None)


def crate(axis: int, sign: float, gap: float) -> Hull:
    """A crate that stands beside the tool of the arm at 0 rad, at a distance along one axis, m."""
    sides = [(-1.0, 1.0)] * 3
    tool = ARM.tool_offset[axis]
    sides[axis] = (tool + sign * gap, tool + sign * 2.0)
    return Hull("crate", 0, tuple(product(sides[0], sides[1], sides[2])), 0.0)


def space(shares: dict[tuple[int, float], float]) -> set[Vec3]:
    """Corners of 0.1 m on each side of the tool, times the share of a side."""
    rows = [
        [ARM.tool_offset[axis] + sign * 0.1 * shares.get((axis, sign), 1.0) for sign in (-1.0, 1.0)]
        for axis in range(3)
    ]
    return {(x, y, z) for x in rows[0] for y in rows[1] for z in rows[2]}


def same(held: Hull, corners: set[Vec3]) -> bool:
    return sorted(held.corners) == [pytest.approx(one) for one in sorted(corners)]


BOXED = GRIPPED._replace(corners=tuple(sorted(space({}))))


SIDES = [(axis, sign) for axis in range(3) for sign in (-1.0, 1.0)]


@pytest.mark.parametrize(("axis", "sign"), SIDES)
def test_the_side_of_a_held_object_beside_a_solid_thing_is_drawn_in(axis: int, sign: float) -> None:
    # It is clear by 10 mm and by the 5 mm that the tool may sway.
    for gap, share in ((0.0901, 0.75), (0.0899, 0.5)):
        found = trim_held_space(turning(0.0, 1.0), BOXED, [crate(axis, sign, gap)], 0.01)
        assert same(found, space({(axis, sign): share}))
        assert (found.link, found.joint, found.radius) == ("held", 1, 0.0)


@pytest.mark.parametrize(
    ("gap", "share"), [(0.1151, 1.0), (0.1149, 0.75), (0.0651, 0.5), (0.0649, 0.25), (0.0401, 0.25)]
)
def test_a_held_object_is_drawn_in_no_further_than_needed(gap: float, share: float) -> None:
    found = trim_held_space(turning(0.0, 1.0), BOXED, [crate(1, 1.0, gap)], 0.01)
    assert same(found, space({(1, 1.0): share}))


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_held_object_beside_two_solid_things_is_drawn_in_on_all_sides(sign: float) -> None:
    both = [crate(0, sign, 0.0901), crate(2, sign, 0.0901)]
    found = trim_held_space(turning(0.0, 1.0), BOXED, both, 0.01)
    assert same(found, space(dict.fromkeys(SIDES, 0.75)))


def test_a_held_object_of_which_a_quarter_is_not_clear_keeps_its_size() -> None:
    assert trim_held_space(turning(0.0, 1.0), BOXED, [crate(0, 1.0, 0.0399)], 0.01) == BOXED
    assert same(trim_held_space(turning(1.0, 0.0), BOXED, [crate(0, 1.0, 0.0399)], 0.01), space({}))


def test_a_held_object_is_compared_with_obstacles_and_not_with_links() -> None:
    touching = Hull("held", 1, ((0.05, 0.0, 0.0),), 0.01)  # the foot
    assert find_obstacle_contact(turning(0.0, 0.0, held=touching), [ASIDE], 0.07) is None
    assert find_obstacle_contact(turning(0.0, 0.0, held=touching), [ASIDE], 0.09) is not None


def test_a_held_object_at_the_end_is_as_small_as_things_left_it_at_the_start() -> None:
    beside = thing("beside", (0.5901, -1.0, -1.0), (2.0, 0.2, 1.0))
    at_target = thing("at-target", (-1.0, 0.5871, -1.0), (0.3, 2.0, 1.0))
    holding = turning(0.0, pi / 2.0, held=BOXED)
    assert not ends_at_obstacle(holding, [beside, at_target], 0.01)
    nearer = at_target._replace(lower=(-1.0, 0.5849, -1.0))
    assert ends_at_obstacle(holding, [beside, nearer], 0.01)
    # With nothing beside it at the start it is as large as it may be, and does not fit there.
    assert ends_at_obstacle(holding, [at_target], 0.01)
    assert not ends_at_obstacle(turning(0.0, pi / 2.0), [beside, at_target], 0.01)
