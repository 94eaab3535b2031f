"""Surveyed places are never the truth: as a camera sees their markers, or as they were surveyed at setup."""

from __future__ import annotations

from dataclasses import replace
from math import dist, radians, sin

import numpy as np
import pytest

from aeros.sim.geometry import Camera, Vector3, add
from aeros.sim.layouts.camera_checks import Carriage, SeeingCamera
from aeros.sim.layouts.placement import place_things
from aeros.sim.layouts.survey import Marker, Survey, markers_of
from aeros.sim.randomness import RandomSource
from aeros.spec.model.sensor_errors import SurveyErrors
from tests.shipped_scenes import shipped_scene

PLACE = (0.5, 0.1, 0.0)
CAMERA = Camera(eye=(0.5, 0.0, 1.0), target=(0.5, 0.0, 0.0), up=(1.0, 0.0, 0.0))
ERRORS = SurveyErrors(setup=0.002, calibration=0.0015, noise=0.001)
DRIFT = (0.03, -0.02, 0.0)


def measured(
    seed: int,
    tick: int = 0,
    errors: SurveyErrors = ERRORS,
    cameras: tuple[SeeingCamera, ...] = (),
    hidden: bool = False,
) -> Vector3:
    survey = Survey({"spot": Marker(PLACE, PLACE, None)}, errors, RandomSource(seed))
    return survey.measure(tick, cameras, lambda eye, marker: hidden)["spot"]


def seeing(
    drift: Vector3 = (0.0, 0.0, 0.0), name: str = "mast", *, is_fixed: bool = False
) -> tuple[SeeingCamera, ...]:
    believed = replace(CAMERA, eye=add(CAMERA.eye, drift), target=add(CAMERA.target, drift))
    return (SeeingCamera(name, CAMERA, believed, is_fixed),)


def test_without_errors_it_is_the_truth() -> None:
    assert measured(0, errors=SurveyErrors(), cameras=seeing(DRIFT)) == PLACE


def test_at_setup_each_coordinate_has_its_error_for_good() -> None:
    errors = np.array([np.subtract(measured(seed), PLACE) for seed in range(400)])
    # Heights are a fifth as far off: a height gauge takes them.
    assert errors.std(axis=0) == pytest.approx((0.002, 0.002, 0.0004), rel=0.15)
    assert measured(7, tick=0) == measured(7, tick=500) != PLACE


def test_a_marker_in_view_has_the_cameras_error_and_a_noise() -> None:
    over_runs = np.array([np.subtract(measured(seed, cameras=seeing()), PLACE) for seed in range(400)])
    distance = dist(CAMERA.eye, PLACE)
    expected = np.hypot(0.0015 * distance, 0.001 * distance**2)
    assert over_runs.std(axis=0) == pytest.approx((expected, expected, 0.0004), rel=0.15)
    over_ticks = np.array([measured(0, tick, cameras=seeing()) for tick in range(400)])
    assert over_ticks.std(axis=0)[:2] == pytest.approx((0.001 * distance**2,) * 2, rel=0.15)
    assert over_ticks.std(axis=0)[2] == pytest.approx(0.0)


def test_a_marker_in_a_carried_camera_drifts_with_the_robot() -> None:
    """So a place is right relative to a base that is not where it takes itself to be."""
    still, drifted = measured(1, cameras=seeing()), measured(1, cameras=seeing(DRIFT))
    assert drifted == pytest.approx(add(still, DRIFT))


def test_a_marker_in_a_turned_camera_is_as_far_off_as_all_that_it_shows() -> None:
    turned = replace(CAMERA, target=add(CAMERA.target, (0.0, sin(radians(1.0)), 0.0)))
    off = np.subtract(
        measured(1, cameras=(SeeingCamera("mast", turned, CAMERA, False),)), measured(1, cameras=seeing())
    )
    assert off == pytest.approx((0.0, -sin(radians(1.0)), 0.0), abs=1e-3)


def test_a_fixed_camera_that_sees_a_fixture_elsewhere_has_moved() -> None:
    assert measured(1, cameras=seeing(DRIFT, is_fixed=True)) == measured(1)
    assert measured(1, cameras=seeing((0.004, 0.0, 0.0), is_fixed=True)) != measured(1)


def test_a_camera_that_has_moved_leaves_the_marker_to_the_next_one() -> None:
    farther = replace(CAMERA, eye=add(CAMERA.eye, (0.0, 0.0, 0.1)))
    other = SeeingCamera("side", farther, farther, is_fixed=True)
    cameras = (*seeing(DRIFT, is_fixed=True), other)
    assert measured(1, cameras=cameras) == measured(1, cameras=(other,)) != measured(1)


TURNED = replace(CAMERA, target=add(CAMERA.target, (0.0, sin(radians(2.0)), 0.0)))


def test_a_carried_camera_that_was_knocked_is_placed_by_the_carriage() -> None:
    """The marker is as far off as the robot takes itself to be, and no farther."""
    carriage = Carriage((0.2, 0.0, -0.1), add((0.2, 0.0, -0.1), DRIFT))
    believed = replace(CAMERA, eye=add(CAMERA.eye, DRIFT), target=add(CAMERA.target, DRIFT))
    survey = Survey({"spot": Marker(PLACE, PLACE, None)}, ERRORS, RandomSource(1))

    def found(camera: Camera, carriage: Carriage | None, tick: int) -> Vector3:
        seeing = (SeeingCamera("mast", camera, believed, False),)
        return survey.measure(tick, seeing, lambda eye, marker: False, carriage)["spot"]

    right = found(CAMERA, carriage, 0)
    assert dist(right, add(PLACE, DRIFT)) < 0.008
    assert dist(found(TURNED, carriage, 1), right) < 0.008
    assert dist(found(TURNED, None, 2), right) > 0.03


def test_a_carried_camera_that_shows_no_carriage_is_not_believed_where_it_has_a_marker_elsewhere() -> None:
    away = Carriage((9.0, 0.0, 0.0), (9.0, 0.0, 0.0))
    survey = Survey({"spot": Marker(PLACE, PLACE, None)}, ERRORS, RandomSource(1))

    def found(camera: Camera, tick: int) -> Vector3:
        seeing = (SeeingCamera("mast", camera, CAMERA, False),)
        return survey.measure(tick, seeing, lambda eye, marker: False, away)["spot"]

    assert found(CAMERA, 0) != measured(1)
    assert found(TURNED, 1) == measured(1)


@pytest.mark.parametrize("cameras", [(), seeing()])
def test_a_hidden_marker_is_where_the_setup_says(cameras: tuple[SeeingCamera, ...]) -> None:
    assert measured(3, cameras=cameras, hidden=True) == measured(3)


def test_a_marker_is_on_the_fixed_body_that_is_declared_from_its_place() -> None:
    scene = shipped_scene("fetch")
    poses = place_things(scene, RandomSource(0))
    found = markers_of(scene, poses)
    by_end = {name.rpartition(".")[2]: marker for name, marker in found.items()}
    assert by_end["station_survey"].fixture == "stand"
    assert by_end["station_survey"].position == poses["stand"].position
    table = shipped_scene("table")
    rest = markers_of(table, place_things(table, RandomSource(0)))["sponge_rest_position"]
    assert (rest.fixture, rest.position) == (None, rest.place)  # the sponge moves


def test_a_fixture_measures_with_the_error_of_its_place() -> None:
    far = (5.0, 5.0, 0.0)
    survey = Survey(
        {"spot": Marker(PLACE, PLACE, None), "far": Marker(far, far, None)}, ERRORS, RandomSource(0)
    )
    found = survey.measure(0, (), lambda eye, marker: False)
    assert add(PLACE, survey.offset_near((0.6, 0.0, 0.0), found)) == pytest.approx(found["spot"])
    assert Survey({}, ERRORS, RandomSource(0)).offset_near(PLACE, {}) == (0.0, 0.0, 0.0)
