"""Rings turn amber and red as the robot must slow down and stop, and the path ends where the tool does."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.sim.film.captions import Caption, PersonSeparation, Status, ZoneFigure
from aeros.sim.film.marks import marks_of, tool_path
from aeros.sim.film.scene_pictures import FloorRing, Line, Zone
from tests.described import lines
from tests.reports_in_full import compare_with_section
from tests.unit.sim.film.recordings import READY, ROBOT, samples


@pytest.mark.parametrize(
    ("measured", "stop_colour", "slow_colour"),
    [(3.0, "green", "green"), (1.5, "amber", "amber"), (0.6, "red", "amber"), (None, "green", "green")],
)
def test_rings_have_the_colour_of_what_people_make_the_robot_do(
    measured: float | None, stop_colour: str, slow_colour: str
) -> None:
    caption = Caption(separation=PersonSeparation(measured, 0.9, 2.3))
    slow, stop = (mark for mark in marks_of(samples(1)[0], caption, ROBOT) if isinstance(mark, FloorRing))
    assert (stop.radius, slow.radius) == pytest.approx((0.25 + 0.9, 0.25 + 2.3))
    for disc, name in ((stop, stop_colour), (slow, slow_colour)):
        red, green, _, _ = disc.colour
        assert name == ("red" if red > 0.8 and green < 0.3 else "amber" if red > 0.8 else "green")


def test_the_path_of_the_tool_ends_where_it_is() -> None:
    (x, y, z), *_ = tool_path(ROBOT, [READY], (1.0, 0.0, 0.0))
    assert (x, y, z) == pytest.approx((1.3069, 0.0, 0.4869), abs=1e-3)
    assert tool_path(ROBOT, [(0.0,)], (0.0, 0.0, 0.0)) == []
    turned = (0.1, *READY[1:])
    marks = list(marks_of(samples(1)[0], Caption("slowed", joint_path=(READY, turned)), ROBOT))
    assert any(isinstance(mark, Line) and len(mark.points) == 2 for mark in marks)


def test_a_volume_that_a_decision_was_about_is_red() -> None:
    zones = tuple(ZoneFigure("a", (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), is_broken) for is_broken in (False, True))
    usual, broken = marks_of(samples(1)[0], Caption(zones=zones), ROBOT)
    assert isinstance(usual, Zone)
    assert isinstance(broken, Zone)
    assert broken.colour[0] > 0.8 > usual.colour[0]


@pytest.mark.parametrize("status", ["allowed", "slowed"])
@pytest.mark.parametrize("measured", [0.89, 0.9, 2.29, 2.3, None])
def test_every_mark_of_a_picture(status: Status, measured: float | None) -> None:
    zones = (
        ZoneFigure("a", (0.0, 0.1, 0.2), (1.0, 1.1, 1.2), False),
        ZoneFigure("b", (0, 0, 0), (1, 1, 1), True),
    )
    separation = PersonSeparation(measured, 0.9, 2.3)
    caption = Caption(status, separation=separation, joint_path=(READY, (0.1, *READY[1:])), zones=zones)
    expected = Path(__file__).with_name("marks.txt")
    compare_with_section(expected, f"{status}, {measured} m", lines(marks_of(samples(1)[0], caption, ROBOT)))


def test_without_a_slow_distance_there_is_one_ring() -> None:
    (ring,) = marks_of(samples(1)[0], Caption(separation=PersonSeparation(0.5, 0.9, None)), ROBOT)
    assert isinstance(ring, FloorRing)
    assert ring.radius == pytest.approx(1.15)
