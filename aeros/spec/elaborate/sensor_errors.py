"""Elaborate the errors of a site's sensors and its safety laser scanners: names, units and bounds."""

from __future__ import annotations

from math import tau

from aeros.spec.declared import sensor_errors as declared
from aeros.spec.declared import site as declared_site
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.elaborate.names import resolve_name
from aeros.spec.elaborate.vocabulary import SiteVocabulary
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import ANGLE, LENGTH, TIME, Dimension, parse_quantity
from aeros.spec.model.sensor_errors import (
    AreaScanners,
    CameraErrors,
    OdometryErrors,
    QuantityErrors,
    ScannerPlacement,
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


def elaborate_area_scanners(
    site: declared_site.Site, vocabulary: SiteVocabulary, diagnostics: Diagnostics
) -> AreaScanners | None:
    """Elaborate the scanners of a site.

    Args:
        site: the declared site.
        vocabulary: its vocabulary.
        diagnostics: receives the faults.

    Returns:
        The scanners; None if the site declares none, or after reporting a fault.
    """
    found = site.area_scanners
    if found is None:
        return None
    before = len(diagnostics)
    _check_measured(found, vocabulary, diagnostics)
    number = _Numbers(diagnostics)
    dropout = 0.0 if found.dropout is None else float(found.dropout.value)
    if found.dropout is not None and not 0 <= dropout < 1:
        diagnostics.error("AE112", "this number is from 0 to 1, and less than 1", found.dropout.span)
    if not tuple(found.scanners):
        diagnostics.error(
            "AE112", "without a scanner nothing is measured", found.span, help=("declare it in `scanners`",)
        )
    scanners = AreaScanners(
        found.measures.value,
        number.signed(found.floor, LENGTH),
        number.positive(found.height, LENGTH),
        number.positive(found.field_of_view, ANGLE, most=tau),
        number.positive(found.resolution, ANGLE, least=_FINEST),
        number.positive(found.range, LENGTH),
        number.positive(found.period, TIME),
        number.positive(found.latency, TIME),
        number.positive(found.noise, LENGTH, least=0.0),
        number.positive(found.allowance, LENGTH, least=0.0),
        dropout,
        tuple(number.placement(name.value, one) for name, one in found.scanners),
    )
    if len(diagnostics) == before:
        _check_detection(found, scanners, diagnostics)
    return scanners if len(diagnostics) == before else None


_FINEST = tau / 36_000
"""Least angle between two rays, rad: 0.01 degrees."""


_HEIGHT_PER_WIDTH, _LEAST_WIDTH = 15.0, 0.05
"""A plane that finds what is at least d wide is at least 15 (d - 50 mm) high, after ISO 13855, in m."""


def _check_detection(found: declared.AreaScanners, scanners: AreaScanners, diagnostics: Diagnostics) -> None:
    """Check that what passes between two rays at the end of their range is no leg at the plane's height."""
    apart, most = scanners.step * scanners.range, scanners.height / _HEIGHT_PER_WIDTH + _LEAST_WIDTH
    if apart > most:
        diagnostics.error(
            "AE112",
            f"at {scanners.range:.4g} m rays are {1e3 * apart:.0f} mm apart, so a leg may pass between them",
            found.resolution.span,
            help=(
                f"a plane {1e3 * scanners.height:.0f} mm high needs rays at most {1e3 * most:.0f} mm apart, "
                "height / 15 + 50 mm (ISO 13855): declare a finer `resolution` or a shorter `range`",
            ),
        )


def _check_measured(
    found: declared.AreaScanners, vocabulary: SiteVocabulary, diagnostics: Diagnostics
) -> None:
    variable = resolve_name(found.measures, vocabulary.state, "a state variable of this site", diagnostics)
    if variable is None:
        return
    type_ = variable.variable.type
    if not isinstance(type_, RealType) or type_.dimension != LENGTH:
        diagnostics.error(
            "AE204",
            f"`{found.measures.value}` is not a distance, which scanners measure",
            found.measures.span,
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


class _Numbers:
    """Elaborates quantities within bounds."""

    def __init__(self, diagnostics: Diagnostics) -> None:
        self._diagnostics = diagnostics

    def placement(self, name: str, one: declared.ScannerPlacement) -> ScannerPlacement:
        x, y = (self.signed(part, LENGTH) for part in one.at)
        return ScannerPlacement(name, x, y, self.signed(one.facing, ANGLE))

    def signed(self, text: TextField, dimension: Dimension) -> float:
        value = elaborate_quantity(text, dimension, self._diagnostics)
        return 0.0 if value is None else float(value)

    def positive(
        self, text: TextField, dimension: Dimension, *, least: float | None = None, most: float = 1e6
    ) -> float:
        value = elaborate_quantity(text, dimension, self._diagnostics)
        if value is None:
            return 1.0
        number = float(value)
        if number <= 0.0 and least is None:
            self._diagnostics.error("AE112", f"`{text.value}` is not above 0", text.span)
        elif least is not None and number < least:
            self._diagnostics.error(
                "AE112", f"`{text.value}` is less than {least:.3g} {dimension}", text.span
            )
        elif number > most:
            self._diagnostics.error("AE112", f"`{text.value}` is more than {most:.4g} {dimension}", text.span)
        return number
