"""Elaborate the safety laser scanners of a cell: names, units and bounds."""

from __future__ import annotations

from math import tau

from aeros.spec.declared import area_scanners as declared
from aeros.spec.declared import site as declared_site
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.elaborate.names import resolve_name
from aeros.spec.elaborate.vocabulary import SiteVocabulary
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import ANGLE, LENGTH, TIME, Dimension
from aeros.spec.model.area_scanners import AreaScanners, ScannerPlacement
from aeros.spec.text.fields import TextField


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
    number = _Amounts(diagnostics)
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
    return scanners if len(diagnostics) == before else None


_FINEST = tau / 36_000
"""Least angle between two rays, rad: 0.01 degrees."""


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
