"""Checks of the values that a perceiver computed: names, types, ranges and uncertainties."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from math import isfinite
from typing import Any

from aeros.runtime.gate.value_check import Scalars, ValueChecker
from aeros.runtime.isolation.protocol import PerceivedValue
from aeros.runtime.ports import Reading
from aeros.spec.expr.units import format_quantity
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import Perceiver
from aeros.spec.model.variables import Declared


class InvalidValuesError(Exception):
    """A perceiver's answer cannot be used; the message says why."""


class PerceivedValueCheck:
    """Check of the answers of one perceiver.

    Args:
        ecm: the module.
        perceiver: the perceiver of it.

    Attributes:
        unsure: what the last answer gave less certain than declared: by full name, how uncertain it was.
    """

    def __init__(self, ecm: Ecm, perceiver: Perceiver) -> None:
        self.unsure: dict[str, str] = {}
        self._checkers = {
            name.partition(".")[2]: ValueChecker(ecm.state[name]) for name in perceiver.provides
        }

    def __call__(
        self, perceived: Mapping[str, PerceivedValue], oldest: float, newest: float
    ) -> dict[str, Reading]:
        """Check an answer.

        Args:
            perceived: values by short name.
            oldest: plant time of the oldest picture in the view, or of the call, s: that of values that
                state none.
            newest: plant time of the newest picture, or of the call, s: no value can be newer.

        Returns:
            Readings (SI) by full name. Those that are absent, or less certain than declared, are absent.

        Raises:
            InvalidValuesError: a name, type, range, uncertainty or time is not as it can be, so that nothing
                of the answer can be relied on.
        """
        values: dict[str, Reading] = {}
        self.unsure = {}
        for name, one in perceived.items():
            checker = self._checkers.get(name)
            if checker is None:
                raise InvalidValuesError(f"it measured `{name}`, which it does not provide")
            scalars: Scalars = {}
            fault = checker.unpack(one.value, scalars)
            if fault is not None:
                raise InvalidValuesError(f"it measured {repr(one.value)[:40]} in SI units: {fault.text}")
            if not _is_certain(checker, one.uncertainty):
                self.unsure[checker.declared.name] = _uncertainty_text(checker.declared, one.uncertainty)
            else:
                parts = tuple(scalars[scalar] for scalar in checker.names)
                is_compound = type(one.value) in (list, tuple)
                time = _checked_time(name, one.time, oldest, newest)
                values[checker.declared.name] = Reading(parts if is_compound else parts[0], time)
        return values


def _uncertainty_text(declared: Declared, uncertainty: Any) -> str:
    most = declared.uncertainty or Fraction(0)
    found = f"{float(Fraction(uncertainty) / declared.unit.factor):.3g}"
    return f"{found} {declared.unit.text}, declared at most {format_quantity(most, declared.unit)}"


def _checked_time(name: str, time: Any, oldest: float, newest: float) -> float:
    """Return the time of a value.

    Raises:
        InvalidValuesError: it is no time, or later than what the perceiver saw.
    """
    if time is None:
        return oldest
    if type(time) not in (int, float) or not isfinite(time):
        raise InvalidValuesError(f"the time of `{name}` is not a number")
    if time > newest:
        raise InvalidValuesError(f"`{name}` has a time after that of the newest picture")
    return float(time)


def _is_certain(checker: ValueChecker, uncertainty: Any) -> bool:
    """Return True if a value is as certain as declared.

    Raises:
        InvalidValuesError: the uncertainty is no number, or is missing although one is declared.
    """
    declared, name = checker.declared.uncertainty, checker.declared.name
    if uncertainty is None and declared is None:
        return True
    if uncertainty is None:
        raise InvalidValuesError(f"it gave no uncertainty of `{name}`: yield `estimate(value, uncertainty)`")
    if type(uncertainty) not in (int, float) or not isfinite(uncertainty) or uncertainty < 0:
        raise InvalidValuesError(f"the uncertainty of `{name}` is not a number of at least 0")
    # As doubles, so that the bound itself, as code writes it, is certain enough.
    return declared is None or float(uncertainty) <= float(declared)
