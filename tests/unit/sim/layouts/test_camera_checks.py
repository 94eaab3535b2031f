"""A carried camera that was knocked is placed by the markers on the carriage that it shows."""

from __future__ import annotations

from dataclasses import replace
from math import dist, radians, sin

import numpy as np
import pytest

from aeros.sim.geometry import Camera, Vector3, add, seen_with
from aeros.sim.layouts.camera_checks import CameraChecks, Carriage, SeeingCamera, fit_shift, is_in_view

CAMERA = Camera(eye=(0.05, 0.2, 0.85), target=(0.58, 0.0, 0.12), up=(0.0, 0.0, 1.0))
"""The mast of the reference site, which shows a corner of the carriage."""

AWAY = Camera(eye=(0.3, 0.0, 0.4), target=(1.0, 0.0, 0.0), up=(0.0, 0.0, 1.0))
POINT = (0.6, 0.0, -0.1)
DRIFT = (0.02, -0.01, 0.0)


def knocked(camera: Camera, degrees: float) -> Camera:
    return replace(camera, target=add(camera.target, (0.0, 0.92 * sin(radians(degrees)), 0.0)))


def shown(
    degrees: float,
    carriage: Carriage,
    camera: Camera = CAMERA,
    noise: float = 0.0,
    checks: CameraChecks | None = None,
) -> Vector3:
    """Return the point as a camera has it that is turned by an angle, after a look at the carriage."""
    drift = tuple(np.subtract(carriage.believed, carriage.base).tolist())
    believed = replace(camera, eye=add(camera.eye, drift), target=add(camera.target, drift))
    one = SeeingCamera("mast", knocked(camera, degrees), believed, is_fixed=False)
    checks = checks or CameraChecks()
    spots = carriage.markers_in(one.camera)
    errors = noise * np.random.default_rng(0).standard_normal((len(spots), 3))
    checks.note(one, spots, errors, carriage, tick=0)
    return checks.correct(one, seen_with(one.camera, believed, POINT))


@pytest.mark.parametrize("drift", [(0.0, 0.0, 0.0), DRIFT])
@pytest.mark.parametrize("degrees", [0.0, 2.5, -2.5])
def test_a_point_is_where_it_is_for_the_robot_however_the_camera_is_turned(
    drift: Vector3, degrees: float
) -> None:
    carriage = Carriage((0.0, 0.0, 0.0), drift)
    assert shown(degrees, carriage) == pytest.approx(add(POINT, drift))
    assert dist(shown(degrees, carriage, noise=0.0002), add(POINT, drift)) < 0.006


def test_a_small_turn_is_left_to_the_camera() -> None:
    carriage = Carriage((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert dist(shown(0.3, carriage), POINT) == pytest.approx(0.92 * radians(0.3), rel=0.1)


def test_a_place_lasts_while_the_camera_shows_nothing_of_the_carriage() -> None:
    checks = CameraChecks()
    near, far = (Carriage(base, base) for base in ((0.0, 0.0, 0.0), (3.0, 0.0, 0.0)))
    shown(2.5, near, checks=checks)
    assert shown(2.5, far, checks=checks) == pytest.approx(POINT)
    assert dist(shown(2.5, far), POINT) > 0.03
    # A camera that is put right again is seen to be.
    assert shown(0.0, near, checks=checks) == pytest.approx(POINT)


def test_a_check_is_due_again_after_a_while_and_lasts_as_long() -> None:
    checks, carriage = CameraChecks(), Carriage((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    one = SeeingCamera("mast", CAMERA, CAMERA, is_fixed=False)
    assert checks.is_due(one, 0, at_once=False)
    assert not checks.is_checked(one, 0)
    spots = carriage.markers_in(CAMERA)
    checks.note(one, spots, np.zeros((len(spots), 3)), carriage, tick=0)
    assert [checks.is_due(one, tick, at_once=False) for tick in (0, 23, 24)] == [False, False, True]
    assert [checks.is_due(one, tick, at_once=True) for tick in (0, 1)] == [False, True]
    assert [checks.is_checked(one, tick) for tick in (0, 23, 24)] == [True, True, False]


def test_a_camera_that_shows_too_little_of_the_carriage_is_not_checked() -> None:
    carriage = Carriage((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert not carriage.markers_in(AWAY)
    in_line = np.array([(0.1 * step, 0.0, 1.0) for step in range(5)])
    assert fit_shift(in_line, in_line) is None
    high = replace(CAMERA, eye=(0.0, 0.0, 1.6), target=(0.0, 0.01, 0.0))
    assert is_in_view(high, (0.0, 0.0, 0.0))
    assert not carriage.markers_in(high)


@pytest.mark.parametrize(
    ("point", "is_seen"),
    [
        ((0.5, 0.0, 0.0), True),
        ((0.93, 0.0, 0.0), True),
        ((0.97, 0.0, 0.0), False),
        ((0.5, 0.58, 0.0), True),
        ((0.5, 0.65, 0.0), False),
        ((0.5, 0.0, 0.9), False),  # too near
        ((0.5, 0.0, -1.6), False),  # too far
        ((0.5, 0.0, 1.5), False),  # behind
    ],
)
def test_a_picture_ends_at_its_edges_and_markers_are_read_from_near(point: Vector3, is_seen: bool) -> None:
    camera = Camera(eye=(0.5, 0.0, 1.0), target=(0.5, 0.0, 0.0), up=(1.0, 0.0, 0.0))
    assert is_in_view(camera, point) is is_seen
