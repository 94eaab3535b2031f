"""People look where they walk, their legs swing while they do, and their feet are on the floor."""

from __future__ import annotations

from math import pi

import pytest

from aeros.runtime.ports import PersonFigure
from aeros.sim.film.person_shapes import PERSON_PARTS, part_poses, stances_of
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
