"""Observations of an environment: the measured state as numbers, with a flag for each that is known.

A value that is missing, stale or outside its declared range is unknown to the agent, and so it is here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from aeros.agent.world.state_numbers import StateNumbers
from aeros.agent.world.world import WorldModel
from aeros.spec.model.variables import Declared

GymObservation = dict[str, NDArray[Any]]
"""`values`, float64 of shape (n,), in SI units; and `known`, int8 of shape (n,), 1 for each known one."""


class ObservationEncoder:
    """Encoder of the measured state as arrays.

    Args:
        state: declared state variables by name.

    Attributes:
        names: names of the numbers of an observation, in order.
        space: the space that every observation is in.
    """

    def __init__(self, state: Mapping[str, Declared]) -> None:
        self._numbers = StateNumbers(state)
        self.names = self._numbers.names
        low = np.array([slot.low for slot in self._numbers.slots])
        high = np.array([slot.high for slot in self._numbers.slots])
        self.space = spaces.Dict(
            {
                "known": spaces.MultiBinary(len(self.names)),
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
        values, known = self._numbers.encode(world.known)
        return {"known": np.array(known, dtype=np.int8), "values": np.array(values, dtype=np.float64)}
