"""What the gate says: ALLOW, ATTENUATE or DENY, and every reason there is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple

from aeros.skill import Action


class DecisionKind(Enum):
    """Has no truth value on purpose: callers compare."""

    ALLOW = "ALLOW"
    ATTENUATE = "ATTENUATE"
    DENY = "DENY"

    def __bool__(self) -> bool:
        raise TypeError("a verdict has no truth value; compare it")


@dataclass(frozen=True, slots=True)
class Reason:
    """One violated rule.

    code: the diagnostic code of the layer.
    rule: the invariant, block or quota, or the name of the offending field.
    text: what is wrong, for people.
    """

    code: str
    rule: str
    text: str


@dataclass(frozen=True, slots=True)
class Caller:
    """Who asks: an active module's skill, running with these inputs (SI)."""

    module: str
    skill: str
    inputs: Mapping[str, Any]


class Decision(NamedTuple):
    """The verdict, the action that may be executed (None on DENY), and every reason.

    For ATTENUATE the action is the reduced one, decided again and allowed; the reasons name what
    stood in the way of the one asked for.

    Example:
        >>> gate = aeros.load_gate("ecms/make_dumplings", skill="wrap")
        >>> decision = gate.decide(aeros.act("look", camera="overhead"), {"estop_pressed": True})
        >>> decision.action is None
        True
        >>> decision.reasons[0].text
        'breaks `not estop_pressed`: nothing goes on while an emergency stop is pressed'
    """

    kind: DecisionKind
    action: Action | None
    reasons: tuple[Reason, ...]
