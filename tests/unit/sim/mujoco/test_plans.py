"""Masses of shapes, and numbers of links and joints."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from aeros.sim.geometry import UPRIGHT, Pose
from aeros.sim.mujoco.plans import (
    AT_ORIGIN,
    Friction,
    JointPlan,
    LinkPlan,
    ShapePlan,
    inertia_of_shapes,
    names_of_joints,
    names_of_links,
)


def link(name: str, joint: str | None = None) -> LinkPlan:
    hinge = None if joint is None else JointPlan(joint, False, (0.0, 0.0, 1.0))
    return LinkPlan(name, None, AT_ORIGIN, hinge, None, (), Friction(0.5))


@pytest.mark.parametrize(
    ("shape", "volume", "diagonal"),
    [
        (ShapePlan("box", (1.0, 2.0, 3.0)), 6.0, (13 / 12, 10 / 12, 5 / 12)),
        (ShapePlan("sphere", (0.5, 0.0, 0.0)), pi / 6.0, (0.1, 0.1, 0.1)),
        (ShapePlan("cylinder", (0.5, 2.0, 0.0)), pi / 2.0, (4.75 / 12, 4.75 / 12, 0.125)),
        (ShapePlan("capsule", (0.5, 1.0, 0.0)), pi / 4.0 + pi / 6.0, (4.75 / 12, 4.75 / 12, 0.125)),
        (ShapePlan("hull", (0.0, 0.0, 0.0)), 0.0, (0.0, 0.0, 0.0)),
    ],
)
def test_volume_and_moments_are_those_of_the_textbook(
    shape: ShapePlan, volume: float, diagonal: tuple[float, ...]
) -> None:
    assert shape.volume == pytest.approx(volume)
    assert shape.inertia(1.0).tolist() == pytest.approx(list(diagonal))


def test_two_halves_have_the_moments_of_the_whole() -> None:
    whole = inertia_of_shapes(3.0, (ShapePlan("box", (2.0, 1.0, 0.5)),))
    halves = [ShapePlan("box", (1.0, 1.0, 0.5), Pose((x, 0.0, 0.0), UPRIGHT)) for x in (-0.5, 0.5)]
    parts = inertia_of_shapes(3.0, halves)
    assert np.allclose(whole.matrix, parts.matrix)
    assert (parts.mass, parts.centre) == (3.0, (0.0, 0.0, 0.0))


def test_a_turned_shape_has_turned_moments() -> None:
    turned = ShapePlan("box", (1.0, 2.0, 3.0), Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.5**0.5, 0.5**0.5)))
    assert np.allclose(
        inertia_of_shapes(1.0, (turned,)).matrix,
        inertia_of_shapes(1.0, (ShapePlan("box", (2.0, 1.0, 3.0)),)).matrix,
    )


def test_the_base_is_link_minus_one_and_joints_have_the_numbers_of_their_links() -> None:
    links = [link("base"), link("arm", "shoulder"), link("plate"), link("hand", "wrist")]
    assert names_of_links(links) == {"base": -1, "arm": 0, "plate": 1, "hand": 2}
    assert names_of_joints(links) == {"shoulder": 0, "wrist": 2}
