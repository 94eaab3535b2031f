"""The errors that a site declares become sensor models of the plant, by full names."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.proving import prove_configuration
from aeros.session.sensor_models import SensorSetup, sensor_setup
from aeros.spec.text.discovery import reference_site_path

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def configuration() -> Configuration:
    return prove_configuration([ROOT / "ecms" / "make_dumplings"], reference_site_path(), certified=True)[0]


@pytest.fixture(scope="module")
def setup(configuration: Configuration) -> SensorSetup:
    return sensor_setup(configuration)


def test_state_variables_and_cameras_have_models(setup: SensorSetup) -> None:
    assert setup.models["contact_force"].noise > 0.0
    assert setup.models["contact_force"].bias > 0.0
    assert setup.models["mast"].colour_noise > 0.0
    assert setup.models["mast"].latency > 0.0
    assert min(setup.survey) > 0.0 < min(setup.odometry)


def test_a_modules_variables_have_the_errors_of_their_sensor_if_the_unit_fits(setup: SensorSetup) -> None:
    assert setup.models["make_dumplings.press_force"].noise == 0.05
    assert "make_dumplings.press_handle_position" not in setup.models  # N is no length
    assert "make_dumplings.wrapper_yaw" not in setup.models  # a perceiver's


def test_a_factor_scales_noise_bias_and_drift_alone(setup: SensorSetup, configuration: Configuration) -> None:
    scaled = sensor_setup(configuration, factor=2.0)
    one, two = setup.models["contact_force"], scaled.models["contact_force"]
    assert (two.noise, two.bias) == (2.0 * one.noise, 2.0 * one.bias)
    assert (two.latency, two.dropout, two.resolution) == (one.latency, one.dropout, one.resolution)
    assert scaled.models["mast"].colour_noise == 2.0 * setup.models["mast"].colour_noise
    assert scaled.survey == tuple(2.0 * each for each in setup.survey)
    assert scaled.odometry == tuple(2.0 * each for each in setup.odometry)
    assert scaled.scanners == setup.scanners


def test_ideal_sensors_have_no_errors(configuration: Configuration) -> None:
    assert sensor_setup(configuration, ideal=True) == SensorSetup({})


def test_the_scanners_are_those_of_the_site(setup: SensorSetup, configuration: Configuration) -> None:
    assert setup.scanners is not None
    assert setup.scanners is configuration.site.area_scanners
