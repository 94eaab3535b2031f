"""Rules that bit, with the values that broke them, as audit records hold them."""

from __future__ import annotations

from math import isfinite
from typing import Any, NamedTuple


class Shortfall(NamedTuple):
    """A quantity that broke a rule.

    Attributes:
        quantity: its name.
        value: the value that it had, SI.
        bound: the bound that it had to keep, SI.
        is_upper: True if it had to be at most the bound, False if at least.
        unit: unit of both.
    """

    quantity: str
    value: float
    bound: float
    is_upper: bool
    unit: str


class RuleCause(NamedTuple):
    """A rule that bit, and why.

    Attributes:
        rule: its id.
        text: its condition; may be empty.
        shortfalls: quantities that broke it; may be empty.
    """

    rule: str
    text: str
    shortfalls: tuple[Shortfall, ...]


def read_causes(recorded: object) -> tuple[RuleCause, ...]:
    """Read the causes of a decision or of the end of a step.

    Args:
        recorded: `causes` of the audit record; what has another form is left out.

    Returns:
        The causes.
    """
    causes = recorded if isinstance(recorded, list) else []
    return tuple(
        RuleCause(str(one.get("rule")), str(one.get("text", "")), _shortfalls(one.get("shortfalls")))
        for one in causes
        if isinstance(one, dict)
    )


def _shortfalls(recorded: object) -> tuple[Shortfall, ...]:
    found = []
    for one in recorded if isinstance(recorded, list) else []:
        match one:
            case {"quantity": str(name), "value": value, "bound": bound, "asked": asked, "unit": str(unit)}:
                if _is_number(value) and _is_number(bound):
                    found.append(Shortfall(name, float(value), float(bound), asked == "at most", unit))
    return tuple(found)


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and isfinite(value)
