"""What the audit record says of sessions, decisions and callers.

What a skill or a planner supplied comes last in each: it may be too large to hold, and what comes
before it must not suffer (`canonical`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

from aeros.runtime.canonical import Encoded, encoded
from aeros.runtime.configuration import Configuration
from aeros.runtime.decision import Caller, Decision, Reason
from aeros.runtime.ports import Readings
from aeros.runtime.told_readings import told_readings
from aeros.skill import Action
from aeros.spec.cause import Cause, told


def session_details(configuration: Configuration) -> dict[str, Any]:
    """Which site governs and which code is active, by digest."""
    site = configuration.site
    modules = {
        name: {
            "version": ecm.version,
            "manifest": ecm.manifest_digest,
            "code": ecm.code_digest,
            "models": dict(ecm.model_digests),
        }
        for name, ecm in configuration.modules.items()
    }
    return {
        "configuration": configuration.digest,
        "site": {"id": site.id, "digest": site.digest},
        "modules": modules,
    }


class DecisionRecord(NamedTuple):
    """What was decided, and everything that it was decided on: enough to decide it again.

    configuration: its digest.
    usage: by quota, what was used up; None where the clock was wrong and the gate was not asked.
    beside: the records of the decisions on the actions that were under way.
    halting: those of them that came to rest before their ends.
    motion: where the whole motion was to be decided, what `motion_details` says of it.
    causes: the reasons as data.
    """

    decision: Decision
    configuration: str
    now: float
    readings: Readings
    caller: Caller
    asked: Action
    usage: Mapping[str, int] | None
    beside: Sequence[int] = ()
    halting: Sequence[int] = ()
    motion: Mapping[str, Any] = MappingProxyType({})
    causes: Sequence[Cause] = ()


def decision_details(
    one: DecisionRecord, tell: Callable[[Readings], Encoded] = told_readings
) -> dict[str, Any]:
    """What the log has of it.

    tell: what says of the readings what `told_readings` says.
    """
    state = tell(one.readings)
    return {
        **outcome_details(one.decision),
        "configuration": one.configuration,
        "time": one.now,
        "state_digest": state.digest,
        "state": state,
        "usage": None if one.usage is None else dict(one.usage),
        **({"beside": list(one.beside)} if one.beside else {}),
        **({"halting": list(one.halting)} if one.halting else {}),
        **one.motion,
        **({"causes": told(one.causes)} if one.causes else {}),
        **caller_details(one.caller),
        "asked": _action_details(one.asked),
    }


def outcome_details(decision: Decision) -> dict[str, Any]:
    """What came out."""
    return {
        "verdict": decision.verdict.value,
        "reasons": [[reason.code, reason.rule, reason.text] for reason in decision.reasons],
        "decided": None if decision.action is None else _action_details(decision.action),
    }


def motion_details(gated: Decision, decision: Decision, motion: Mapping[str, Any]) -> dict[str, Any]:
    """The motion that the action becomes, as it is told; where that was denied, what the gate had said."""
    encoding = encoded(motion)
    told = {"motion_digest": encoding.digest, "motion": encoding}
    return told if decision is gated else {**told, "gate": outcome_details(gated)}


def caller_details(caller: Caller) -> dict[str, Any]:
    """Who asks, with its inputs."""
    return {"module": caller.module, "skill": caller.skill, "inputs": dict(caller.inputs)}


def spell_reasons(reasons: tuple[Reason, ...]) -> str:
    """Why an action was denied, in words."""
    spelt = "; ".join(f"{reason.code} {reason.rule}: {reason.text}" for reason in reasons)
    return spelt or "the gate gave no reason"


def _action_details(action: Action) -> dict[str, Any]:
    return {"kind": action.kind, "parameters": dict(action.parameters)}
