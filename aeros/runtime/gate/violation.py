"""What was measured when a rule did not hold: each quantity, its value, and the bound that it broke."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from aeros.spec.expr import terms as t
from aeros.spec.expr.shortfall import Shortfall, shortfalls


class Violation(NamedTuple):
    """A rule that does not hold at `values`: float, bool or str by scalar variable."""

    rule: str
    term: t.Term
    values: Mapping[str, Any]

    @property
    def shortfalls(self) -> tuple[Shortfall, ...]:
        """Each part that is not as required."""
        return shortfalls(self.term, self.values)

    def __str__(self) -> str:
        """As in `link_speed is 0.31 m/s (at most 0.25 m/s)`, for each part that is not as required."""
        return ", ".join(map(str, self.shortfalls))
