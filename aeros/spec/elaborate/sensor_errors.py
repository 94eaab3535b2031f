"""Elaborate the errors of a site's sensors: names, units and bounds."""

from __future__ import annotations

from aeros.spec.declared import sensor_errors as declared
from aeros.spec.declared import site as declared_site
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.elaborate.names import resolve_name
from aeros.spec.elaborate.vocabulary import SiteVocabulary
from aeros.spec.expr.units import LENGTH, TIME, Dimension, parse_quantity
from aeros.spec.model.sensor_errors import (
    CameraErrors,
    OdometryErrors,
    QuantityErrors,
    SensorErrors,
    SurveyErrors,
)
from aeros.spec.text.fields import NumberField, TextField


def elaborate_sensor_errors(
    site: declared_site.Site, vocabulary: SiteVocabulary, diagnostics: Diagnostics
) -> SensorErrors:
    """Elaborate the errors of a site's sensors.

    Args:
        site: the declared site.
        vocabulary: its vocabulary.
        diagnostics: receives the faults.

    Returns:
        The errors; none if the site declares none.
    """
    errors = site.sensor_errors
    if errors is None:
        return SensorErrors()
    number = _Amounts(diagnostics)
    state = {}
    for name, one in errors.state:
        variable = resolve_name(name, vocabulary.state, "a state variable of this site", diagnostics)
        if variable is not None:
            state[name.value] = number.quantity(one, variable.unit.dimension)
    sensors = {}
    known = {name.value: name for name, _ in site.sensors}
    for name, one in errors.sensors:
        resolve_name(name, known, "a sensor whose quantities modules declare", diagnostics)
        sensors[name.value] = number.quantity(one, number.dimension_of(one))
    cameras = {name.value: name for name, _ in site.cameras}
    for name, _ in errors.cameras:
        resolve_name(name, cameras, "a camera of this site", diagnostics)
    return SensorErrors(
        state,
        sensors,
        {name.value: number.camera(one) for name, one in errors.cameras},
        number.survey(errors.survey),
        number.odometry(errors.odometry),
    )


class _Amounts:
    """Elaborates amounts, each at least 0."""

    def __init__(self, diagnostics: Diagnostics) -> None:
        self._diagnostics = diagnostics

    def quantity(self, errors: declared.QuantityErrors, dimension: Dimension | None) -> QuantityErrors:
        noise, bias, resolution = (
            0.0 if dimension is None else self.size(one, dimension)
            for one in (errors.noise, errors.bias, errors.resolution)
        )
        latency, dropout = self.size(errors.latency, TIME), self.plain(errors.dropout, 1.0)
        return QuantityErrors(dimension, noise, bias, resolution, latency, dropout)

    def survey(self, errors: declared.SurveyErrors | None) -> SurveyErrors:
        if errors is None:
            return SurveyErrors()
        setup, calibration, noise = (
            self.size(one, LENGTH) for one in (errors.setup, errors.calibration, errors.noise)
        )
        return SurveyErrors(setup, calibration, noise)

    def odometry(self, errors: declared.OdometryErrors | None) -> OdometryErrors:
        if errors is None:
            return OdometryErrors()
        return OdometryErrors(self.plain(errors.scale, 0.5), self.size(errors.drift, LENGTH))

    def dimension_of(self, errors: declared.QuantityErrors) -> Dimension | None:
        """Return the dimension of the first amount that has a unit."""
        for one in (errors.noise, errors.bias, errors.resolution):
            parsed = None if one is None else parse_quantity(one.value)
            if parsed is not None:
                return parsed[1].dimension
        return None

    def camera(self, errors: declared.CameraErrors) -> CameraErrors:
        return CameraErrors(
            self.plain(errors.colour_noise, 255.0),
            self.size(errors.depth_noise, LENGTH),
            self.size(errors.latency, TIME),
            self.plain(errors.dropout, 1.0),
        )

    def size(self, text: TextField | None, dimension: Dimension) -> float:
        if text is None:
            return 0.0
        value = elaborate_quantity(text, dimension, self._diagnostics)
        if value is not None and value < 0:
            self._diagnostics.error("AE112", "an error of a sensor is at least 0", text.span)
        return 0.0 if value is None else float(value)

    def plain(self, number: NumberField | None, most: float) -> float:
        if number is None:
            return 0.0
        if not 0 <= number.value <= most:
            self._diagnostics.error("AE112", f"this number is from 0 to {most:g}", number.span)
        return float(number.value)
