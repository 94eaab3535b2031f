"""Violations of rules: each measured quantity, its value, and the bound that it broke."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from aeros.spec.expr import terms as t
from aeros.spec.expr.shortfall import UnmetBound, unmet_bounds


class RuleViolation(NamedTuple):
    """A rule that does not hold.

    Attributes:
        rule: its id.
        term: its condition.
        values: float, bool or str by scalar variable, at which it does not hold.
    """

    rule: str
    term: t.Term
    values: Mapping[str, Any]

    @property
    def unmet_bounds(self) -> tuple[UnmetBound, ...]:
        """The parts of the condition that do not hold."""
        return unmet_bounds(self.term, self.values)

    def __str__(self) -> str:
        """Describe each part that does not hold, as in `link_speed is 0.31 m/s (at most 0.25 m/s)`."""
        return ", ".join(map(str, self.unmet_bounds))


class MotionDeviation(NamedTuple):
    """A motion that the robot does not follow as it was decided.

    Attributes:
        rule: name under which the robot is stopped.
        unmet_bounds: the measured values and the bounds that they broke.
    """

    rule: str
    unmet_bounds: tuple[UnmetBound, ...]

    def __str__(self) -> str:
        """Describe each part, as in `distance from the decided path is 0.034 m (at most 0.01 m)`."""
        return ", ".join(map(str, self.unmet_bounds))
