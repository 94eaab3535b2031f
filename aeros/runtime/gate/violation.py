"""What was measured when a rule did not hold: each quantity, its value, and the bound that it broke."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from aeros.spec.expr import terms as t
from aeros.spec.expr.shortfall import UnmetBound, unmet_bounds


class RuleViolation(NamedTuple):
    """A rule that does not hold at `values`: float, bool or str by scalar variable."""

    rule: str
    term: t.Term
    values: Mapping[str, Any]

    @property
    def unmet_bounds(self) -> tuple[UnmetBound, ...]:
        """Each part that is not as required."""
        return unmet_bounds(self.term, self.values)

    def __str__(self) -> str:
        """As in `link_speed is 0.31 m/s (at most 0.25 m/s)`, for each part that is not as required."""
        return ", ".join(map(str, self.unmet_bounds))
