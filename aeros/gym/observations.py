"""Observations of an environment: the measured state as numbers, with a flag for each that is known.

A value that is missing, stale or outside its declared range is unknown to the agent, and so it is here: its
flag is 0 and its number is 0 or, if 0 is outside its range, the bound nearest to 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from aeros.agent.world.world import WorldModel
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import scalar_variables
from aeros.spec.expr.types import BoolType, EnumType
from aeros.spec.model.variables import Declared

GymObservation = dict[str, NDArray[Any]]
"""`values`, float64 of shape (n,), in SI units; and `known`, int8 of shape (n,), 1 for each known one."""


class _Slot(NamedTuple):
    """One number of an observation.

    Attributes:
        name: `VARIABLE`, `VARIABLE.x`, `VARIABLE[MEMBER]`, or `VARIABLE=MEMBER` of an enum.
        variable: name of the state variable.
        part: place in its value, of a vector or a family; None for a scalar.
        member: member that the number is 1 for; None unless the variable is of an enum.
        low: least number.
        high: greatest number.
    """

    name: str
    variable: str
    part: int | None
    member: str | None
    low: float
    high: float


class ObservationEncoder:
    """Encoder of the measured state as arrays.

    Args:
        state: declared state variables by name.

    Attributes:
        names: names of the numbers of an observation, in order.
        space: the space that every observation is in.
    """

    def __init__(self, state: Mapping[str, Declared]) -> None:
        self._slots = tuple(slot for name in sorted(state) for slot in _slots(state[name]))
        self.names = tuple(slot.name for slot in self._slots)
        low = np.array([slot.low for slot in self._slots])
        high = np.array([slot.high for slot in self._slots])
        self._unknown = np.clip(0.0, low, high)
        self.space = spaces.Dict(
            {
                "known": spaces.MultiBinary(len(self._slots)),
                "values": spaces.Box(low, high, dtype=np.float64),
            }
        )

    def encode(self, world: WorldModel) -> GymObservation:
        """Encode the measured state.

        Args:
            world: the known values.

        Returns:
            The observation, in `space`.
        """
        values = self._unknown.copy()
        known = np.zeros(len(self._slots), dtype=np.int8)
        for place, slot in enumerate(self._slots):
            value: Any = world.known.get(slot.variable)
            if value is None:
                continue
            known[place] = 1
            if slot.member is not None:
                values[place] = value == slot.member
            else:
                # Rounding of a bound's exact value may leave the range by one unit in the last place.
                number = float(value if slot.part is None else value[slot.part])
                values[place] = min(max(number, slot.low), slot.high)
        return {"known": known, "values": values}


def _slots(declared: Declared) -> Iterator[_Slot]:
    variable = declared.variable
    if isinstance(variable.type, EnumType):
        for member in variable.type.members:
            yield _Slot(f"{variable.name}={member}", variable.name, None, member, 0.0, 1.0)
        return
    parts = scalar_variables(variable)
    is_scalar = parts == (variable,)
    for place, part in enumerate(parts):
        low, high = _bounds(part, declared)
        yield _Slot(part.name, variable.name, None if is_scalar else place, None, low, high)


def _bounds(part: t.Variable, declared: Declared) -> tuple[float, float]:
    return (0.0, 1.0) if isinstance(part.type, BoolType) else declared.double_range
