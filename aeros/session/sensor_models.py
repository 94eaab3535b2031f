"""Turn the errors that a site declares into the sensor models of a simulated plant."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from aeros.runtime.gate.configuration import Configuration
from aeros.sim.sensor_model import SensorModel
from aeros.spec.model.sensor_errors import AreaScanners, OdometryErrors, QuantityErrors, SurveyErrors


class SensorSetup(NamedTuple):
    """Errors of all sensors of a plant; by default none.

    Attributes:
        models: of state variables and cameras, by full name.
        survey: of surveyed places.
        odometry: of a base that drives.
        scanners: that measure how far people are; None if that is measured exactly.
    """

    models: dict[str, SensorModel]
    survey: SurveyErrors = SurveyErrors()
    odometry: OdometryErrors = OdometryErrors()
    scanners: AreaScanners | None = None


def sensor_setup(configuration: Configuration, *, ideal: bool = False, factor: float = 1.0) -> SensorSetup:
    """Collect the errors of the sensors.

    Args:
        configuration: the site, and the modules whose variables its sensors measure.
        ideal: no errors at all, and the exact distance of people.
        factor: factor on noise, bias and drift, but for the sensors that measure how far people are.

    Returns:
        The errors that the site declares.
    """
    errors = configuration.site.sensor_errors
    if ideal:
        return SensorSetup({})
    models = {name: _model(one) for name, one in errors.state.items()}
    for name, camera in errors.cameras.items():
        models[name] = SensorModel(
            noise=camera.depth_noise,
            colour_noise=camera.colour_noise,
            latency=camera.latency,
            dropout=camera.dropout,
        )
    for module in configuration.modules.values():
        for name, variable in module.state.items():
            found = errors.sensors.get(variable.sensor or "")
            if found is not None and found.dimension == variable.unit.dimension:
                lowest, highest = variable.double_range
                models[name] = replace(_model(found), lowest=lowest, highest=highest)
    setup = SensorSetup(models, errors.survey, errors.odometry, configuration.site.area_scanners)
    return setup if factor == 1.0 else _scaled(setup, factor)


def _scaled(setup: SensorSetup, factor: float) -> SensorSetup:
    """Return greater or smaller errors; how late and how rarely values come stays."""
    models = {
        name: replace(
            one, noise=factor * one.noise, bias=factor * one.bias, colour_noise=factor * one.colour_noise
        )
        for name, one in setup.models.items()
    }
    survey = SurveyErrors(*(factor * one for one in setup.survey))
    odometry = OdometryErrors(*(factor * one for one in setup.odometry))
    return setup._replace(models=models, survey=survey, odometry=odometry)


def _model(errors: QuantityErrors) -> SensorModel:
    return SensorModel(
        noise=errors.noise,
        bias=errors.bias,
        resolution=errors.resolution,
        latency=errors.latency,
        dropout=errors.dropout,
    )
