"""Checks of the values that a perceiver computed: names, types, ranges and uncertainties."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

from aeros.runtime.gate.value_check import Scalars, ValueChecker
from aeros.runtime.isolation.protocol import PerceivedValue
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import Perceiver


class InvalidValuesError(Exception):
    """A perceiver's answer cannot be used; the message says why."""


class PerceivedValueCheck:
    """Check of the answers of one perceiver.

    Args:
        ecm: the module.
        perceiver: the perceiver of it.
    """

    def __init__(self, ecm: Ecm, perceiver: Perceiver) -> None:
        self._checkers = {
            name.partition(".")[2]: ValueChecker(ecm.state[name]) for name in perceiver.provides
        }

    def __call__(self, perceived: Mapping[str, PerceivedValue]) -> dict[str, Any]:
        """Check an answer.

        Args:
            perceived: values by short name.

        Returns:
            Values (SI) by full name, in the types of readings. Those that are absent, or less certain than
            declared, are absent.

        Raises:
            InvalidValuesError: a name, type, range or uncertainty is not as declared, so that nothing of the
                answer can be relied on.
        """
        values: dict[str, Any] = {}
        for name, one in perceived.items():
            checker = self._checkers.get(name)
            if checker is None:
                raise InvalidValuesError(f"it measured `{name}`, which it does not provide")
            scalars: Scalars = {}
            fault = checker.unpack(one.value, scalars)
            if fault is not None:
                raise InvalidValuesError(f"it measured a wrong value: {fault.text}")
            if _is_certain(checker, one.uncertainty):
                parts = tuple(scalars[scalar] for scalar in checker.names)
                is_compound = type(one.value) in (list, tuple)
                values[checker.declared.name] = parts if is_compound else parts[0]
        return values


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
