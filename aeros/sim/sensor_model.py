"""Errors of one measured quantity in a simulator: noise, bias, resolution, latency and dropout."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, inf

from aeros.sim.clock import TICK
from aeros.spec.diagnostics.errors import MisuseError


@dataclass(frozen=True, slots=True)
class SensorModel:
    """Errors of one measured quantity; by default none.

    Attributes:
        noise: standard deviation of each of its numbers, SI; booleans and words have no noise. Of a camera:
            of each pixel's depth, m.
        resolution: readings are whole multiples of it, SI; 0 means no rounding.
        latency: time from when a value is true to when its reading arrives, s.
        dropout: probability that the value of one tick is never read; the last reading stays and ages.
        bias: standard deviation of the constant error of each of its numbers, SI, drawn once for a plant.
        colour_noise: of a camera, standard deviation of each colour of a pixel, of 255.
        lowest, highest: least and greatest number that the instrument shows, SI, whatever its errors.
    """

    noise: float = 0.0
    resolution: float = 0.0
    latency: float = 0.0
    dropout: float = 0.0
    bias: float = 0.0
    colour_noise: float = 0.0
    lowest: float = -inf
    highest: float = inf

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            MisuseError: a number is negative or infinite, or the dropout is above 1.
        """
        amounts = (
            self.noise, self.bias, self.colour_noise, self.resolution, self.latency, self.dropout
        )  # fmt: skip
        if not all(0.0 <= amount < inf for amount in amounts) or self.dropout > 1.0:
            raise MisuseError(f"invalid sensor model {self}")

    @property
    def needs_history(self) -> bool:
        """True if a reading depends on values of earlier ticks."""
        return self.latency > 0.0 or self.dropout > 0.0

    @property
    def latency_ticks(self) -> int:
        """The latency in ticks, rounded up."""
        return ceil(self.latency / TICK - 1e-9)
