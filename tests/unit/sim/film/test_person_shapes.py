"""People look where they walk, their legs swing while they do, and their feet are on the floor."""

from __future__ import annotations

from math import pi
from pathlib import Path

import pytest

from aeros.runtime.ports import PersonFigure
from aeros.sim.film.person_shapes import PERSON_PARTS, Stance, part_poses, stances_of
from tests.described import lines
from tests.reports_in_full import compare_with_section
from tests.unit.sim.film.recordings import samples


def test_a_walker_looks_ahead_and_swings_and_a_bystander_does_not() -> None:
    walking = stances_of([sample.people for sample in samples(60)])
    assert all(stances[0].heading == pytest.approx(pi) for stances in walking)
    assert walking[-1][0].pace > 0.9
    assert walking[-1][0].phase > 2.0 * pi
    standing = stances_of([samples(1)[0].people] * 60)
    assert standing[-1][0].pace == 0.0


def test_a_person_is_as_high_as_declared_and_stands_on_the_floor() -> None:
    figure = PersonFigure(1.0, 2.0, -0.3, 1.75, 0.25)
    ((stance,),) = stances_of([(figure,)])
    poses = part_poses(stance)
    assert len(poses) == len(PERSON_PARTS)
    heights = [
        pose.position[2] + shape.place.position[2] + side * shape.size[2] / 2.0
        for pose, shapes in zip(poses, PERSON_PARTS, strict=True)
        for shape in shapes
        for side in (-1.0, 1.0)
        if shape.kind == "ellipsoid"
    ]
    assert min(heights) == pytest.approx(-0.3, abs=0.02)
    assert max(heights) == pytest.approx(1.45, abs=0.03)


def test_a_person_who_appears_later_is_behind_the_others() -> None:
    one, other = PersonFigure(0.0, 0.0, 0.0, 1.75, 0.25), PersonFigure(3.0, 0.0, 0.0, 1.75, 0.25)
    stances = stances_of([(one,), (one, other), (one, other._replace(y=0.5))])
    assert [len(one) for one in stances] == [1, 2, 2]
    assert stances[1][1].heading == pytest.approx(pi / 2)


EXPECTED = Path(__file__).with_name("person.txt")


def test_the_figure_of_a_person_part_by_part() -> None:
    compare_with_section(EXPECTED, "shapes", lines(shape for part in PERSON_PARTS for shape in part))


def test_steps_of_a_person_who_walks_a_corner() -> None:
    way = [(0.1 * number, 0.0) for number in range(8)] + [(0.7, 0.1 * number) for number in range(1, 8)]
    other = PersonFigure(5.0, 5.0, 0.2, 1.2, 0.2)
    pictures = [(PersonFigure(x, y, -0.3, 1.9, 0.25), other) for x, y in way]
    stances = stances_of(pictures)
    compare_with_section(EXPECTED, "steps", lines(one[:2] for one in stances))
    compare_with_section(EXPECTED, "poses", lines(part_poses(stances[-1][0])))
    compare_with_section(EXPECTED, "stands", lines(part_poses(Stance(other, 1.0, 2.0, 0.5))))
