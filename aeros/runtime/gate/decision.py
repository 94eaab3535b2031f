"""The gate's decisions: ALLOW, ATTENUATE or DENY, with every reason."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple

from aeros.skill import Action


class DecisionKind(Enum):
    """Kind of a decision. It has no truth value, so that callers must compare it."""

    ALLOW = "ALLOW"
    ATTENUATE = "ATTENUATE"
    DENY = "DENY"

    def __bool__(self) -> bool:
        raise TypeError("a kind of decision has no truth value; compare it")


@dataclass(frozen=True, slots=True)
class Reason:
    """One violated rule.

    Attributes:
        code: the diagnostic code of the layer.
        rule: the invariant, block or quota, or the name of the offending field.
        text: the objection in words.
    """

    code: str
    rule: str
    text: str


@dataclass(frozen=True, slots=True)
class Caller:
    """An active module's skill that asks for an action.

    Attributes:
        module: the module's name.
        skill: the skill's id.
        inputs: the inputs that the skill runs with, by name, SI.
    """

    module: str
    skill: str
    inputs: Mapping[str, Any]


class Decision(NamedTuple):
    """A decision of the gate: its kind, the action that may be executed (None on DENY), and every reason.

    For ATTENUATE the action is the reduced one, which the gate decided again and allowed; the reasons are the
    objections to the requested action.

    Attributes:
        kind: ALLOW, ATTENUATE or DENY, also as text in `kind.value`.
        action: the action that may be executed; None on DENY.
        reasons: objections, none on ALLOW; each has a `code`, the violated `rule` and a `text`.

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
