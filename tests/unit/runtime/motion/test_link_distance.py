"""Links against links: distances worked out by hand; tests/property samples random ones."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import copysign, hypot, pi
from typing import Any

import pytest

from aeros.kinematic_chain import JointFrame
from aeros.runtime.motion.kinematic_bounds import ForwardKinematics
from aeros.runtime.motion.link_distance import (
    PostureRange,
    find_link_contact,
    hull_pairs,
    search_separation,
    separation,
)
from aeros.runtime.motion.swept_volume import Enclosure, SweptMotion
from aeros.runtime.ports import Hull, JointVector, RobotBody, Vec3
from tests.unit.runtime.motions import chance_of

NOWHERE = (0.0, 0.0, 0.0)
EXEMPT = (("foot", "first"), ("first", "second"), ("second", "third"))


def rod(link: str, joint: int, length: float) -> Hull:
    """A rod along x of its joint's frame, 0.1 m thick."""
    return Hull(link, joint, (NOWHERE, (length, 0.0, 0.0)), 0.05)


FINGER = RobotBody(
    ((0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.5, 0.0, 0.0)),
    NOWHERE,
    (),
    (Hull("foot", 0, (NOWHERE,), 0.05), rod("first", 1, 0.5), rod("second", 2, 0.5), rod("third", 3, 0.4)),
    EXEMPT,
)
"""Three rods in a plane, the last of which can reach the first and the foot."""
WITHOUT_FOOT = replace(FINGER, hulls=FINGER.hulls[1:], exempt_pairs=EXEMPT[1:])


def moving(start: JointVector, end: JointVector, body: RobotBody = FINGER, slack: float = 0.0) -> SweptMotion:
    a, b, c, d = (
        tuple(p + (q - p) * third / 3.0 for p, q in zip(start, end, strict=True)) for third in range(4)
    )
    return SweptMotion(body, ([(a, b, c, d)],), (slack,) * 3, NOWHERE, NOWHERE, True)


def test_pairs_are_of_links_that_move_against_each_other_and_are_not_exempt() -> None:
    rigid = replace(FINGER, hulls=(*FINGER.hulls, rod("tip", 3, 0.1)), exempt_pairs=(("second", "first"),))
    names = [(pair.inner.link, pair.outer.link) for pair in hull_pairs(rigid)]
    assert names == [
        ("foot", "first"),
        ("foot", "second"),
        ("foot", "third"),
        ("foot", "tip"),
        ("first", "third"),
        ("first", "tip"),
        ("second", "third"),
        ("second", "tip"),
    ]


def test_a_ball_encloses_each_hull_of_a_pair() -> None:
    pair = hull_pairs(FINGER)[-1]
    assert (pair.inner.link, pair.inner_ball) == ("first", Hull("first", 1, ((0.25, 0.0, 0.0),), 0.3))
    assert pair.outer_ball == Hull("third", 3, ((0.2, 0.0, 0.0),), 0.25)


def test_the_clearance_is_kept_to_the_last_millimetre() -> None:
    # Three sides of a square: the third rod is parallel to the first, 0.5 m from it, with 0.4 m of air.
    still = (0.0, pi / 2, pi / 2)
    assert find_link_contact(moving(still, still), 0.399) is None
    assert find_link_contact(moving(still, still), 0.4 - 2e-9) is None
    assert find_link_contact(moving(still, still), 0.4 - 1e-12) is not None, "rounding has its room"
    found = find_link_contact(moving(still, still, WITHOUT_FOOT), 0.401)
    assert found is not None
    assert (found.inner, found.outer) == ("first", "third")
    assert found.distance == pytest.approx(0.4)


def test_a_motion_that_folds_a_link_into_another_is_found_with_its_place() -> None:
    found = find_link_contact(moving((0.0, 0.0, 0.0), (1.0, 2.5, 2.5), WITHOUT_FOOT), 0.005)
    assert found is not None
    assert (found.inner, found.outer) == ("first", "third")
    assert 0.7 < found.path_parameter < 1.0
    assert find_link_contact(moving((0.0, 0.0, 0.0), (1.0, 1.5, 1.5)), 0.005) is None


def test_contact_on_the_way_is_found_though_both_ends_are_clear() -> None:
    # The third rod passes the foot: from one side of the first rod to the other, by the way of the second.
    start, end = (0.0, pi / 2, 1.9), (0.0, pi / 2, 4.4)
    assert find_link_contact(moving(start, start), 0.005) is None
    assert find_link_contact(moving(end, end), 0.005) is None
    assert find_link_contact(moving(start, end), 0.005) is not None


def test_joints_up_to_the_inner_link_do_not_matter() -> None:
    spinning = moving((-100.0, pi / 2, pi / 2), (100.0, pi / 2, pi / 2), WITHOUT_FOOT)
    assert find_link_contact(spinning, 0.399) is None


def test_the_tolerance_of_the_joints_counts() -> None:
    still = (0.0, pi / 2, pi / 2)
    assert find_link_contact(moving(still, still, slack=0.01), 0.38) is None
    # 0.01 rad of both joints: the tip is up to 0.64 m from one and 0.4 m from the other.
    assert find_link_contact(moving(still, still, slack=0.01), 0.396) is not None


def test_every_path_is_searched() -> None:
    clear, not_clear = moving((0.0,) * 3, (0.0,) * 3), moving((0.0, 2.5, 2.5), (0.0, 2.5, 2.5))
    assert find_link_contact(clear._replace(paths=clear.paths * 2), 0.0) is None
    assert find_link_contact(clear._replace(paths=(*clear.paths, *not_clear.paths)), 0.0) is not None


def test_pieces_of_a_path_are_searched_each() -> None:
    clear, folding = moving((0.0,) * 3, (0.0,) * 3), moving((0.0,) * 3, (0.0, 2.5, 2.5))
    for pieces in ([*clear.paths[0], *folding.paths[0]], [*folding.paths[0], *clear.paths[0]]):
        assert find_link_contact(clear._replace(paths=(pieces,)), 0.005) is not None


def test_separation_along_a_direction_is_scaled_by_its_length() -> None:
    inner = [NOWHERE, (1.0, 0.0, 0.0)]
    outer = [Enclosure((3.0, 5.0, 0.0), (0.25, 0.0, 0.0), 0.125), Enclosure((4.0, 0.0, 0.0), NOWHERE, 0.0)]
    assert separation(inner, outer, (2.0, 0.0, 0.0)) == 2.0 * (3.0 - 0.25 - 0.125 - 1.0)
    assert separation(inner, outer, (-1.0, 0.0, 0.0)) == -4.0


def test_each_hull_is_placed_once_in_a_posture(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    to_base, deviation = JointFrame.to_base, ForwardKinematics.chord_deviation_bound

    def place(frame: JointFrame, at: Vec3) -> Vec3:
        asked.append("place")
        return to_base(frame, at)

    def enclose(posture: ForwardKinematics, *given: Any) -> tuple[Vec3, float]:
        asked.append("enclosure")
        return deviation(posture, *given)

    monkeypatch.setattr(JointFrame, "to_base", place)
    monkeypatch.setattr(ForwardKinematics, "chord_deviation_bound", enclose)
    posture = PostureRange(WITHOUT_FOOT, (0.0, pi / 2, pi / 2), (0.0,) * 3, (0.1,) * 3)
    (pair,) = hull_pairs(WITHOUT_FOOT)
    for _ in range(2):
        assert posture.find_gap(pair, 9.0) is not None
        # Both balls, and two corners of each rod; the outer ones are enclosed, too.
        assert (asked.count("place"), asked.count("enclosure")) == (6, 3)


@pytest.mark.parametrize("axis", range(3))
def test_a_lower_bound_along_a_direction_holds_of_every_point(axis: int) -> None:
    chance = chance_of(axis)

    def anywhere(most: float) -> Vec3:
        return (chance.uniform(-most, most), chance.uniform(-most, most), chance.uniform(-most, most))

    for _ in range(20):
        x, y, z = (abs(one) for one in anywhere(0.5))
        outer, inner, direction = (
            Enclosure(anywhere(2.0), (x, y, z), 0.25),
            [anywhere(2.0)] * 2,
            anywhere(1.0),
        )
        found = separation(inner, [outer], direction)
        # The corner of the box that lies least far, and from there the radius against the direction.
        length = hypot(*direction)
        p = [c - copysign(e, n) - 0.25 * n / length for c, e, n in zip(*outer[:2], direction, strict=True)]
        exact = sum(n * (a - b) for n, a, b in zip(direction, p, inner[0], strict=True))
        assert found == pytest.approx(exact)


@pytest.mark.parametrize("centre", [(0.5, 0.5, 0.5), (0.4, 0.6, 0.5), (0.0, 0.0, 0.0)])
def test_hulls_inside_each_other_are_never_apart(centre: Vec3) -> None:
    cube = [(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]
    found = search_separation(cube, [Enclosure(centre, NOWHERE, 0.0)], 0.01)
    assert found.direction is None
    assert found.distance < 0.05


def test_a_gap_is_that_of_the_rounded_hulls() -> None:
    (pair,) = (one for one in hull_pairs(FINGER) if (one.inner.link, one.outer.link) == ("first", "third"))
    still = PostureRange(FINGER, (0.0, pi / 2, pi / 2), (0.0,) * 3, (0.0,) * 3)
    assert still.find_gap(pair, 0.3) is None
    assert still.find_gap(pair, 0.5) == pytest.approx(0.4)


@pytest.mark.parametrize(("first", "last"), [(0.0, 0.4), (0.4, 0.8), (0.6, 1.0)])
def test_a_contact_is_placed_on_the_whole_path_of_many_pieces(first: float, last: float) -> None:
    """The last rod folds into the first one between two shares of the path, and rests before."""
    count = 8
    shares = [min(max((number / count - first) / (last - first), 0.0), 1.0) for number in range(count + 1)]
    postures = [(share, 2.5 * share, 2.5 * share) for share in shares]
    pieces = [piece for a, b in pairwise(postures) for piece in moving(a, b).paths[0]]
    path = moving(postures[0], postures[-1], WITHOUT_FOOT)._replace(paths=(pieces,))
    found = find_link_contact(path, 0.005)
    assert found is not None
    whole = find_link_contact(moving((0.0, 0.0, 0.0), (1.0, 2.5, 2.5), WITHOUT_FOOT), 0.005)
    assert whole is not None
    expected = first + whole.path_parameter * (last - first)
    assert found.path_parameter == pytest.approx(expected, abs=0.06)
