"""Events of runs as audit logs hold them: a step that the gate denies, and the end that follows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.model.cause import Cause, causes_to_json

NEAR = Cause(
    "rule",
    "separation",
    "human_distance >= 500 mm",
    "ISO 13855",
    "cell.yaml:299",
    (UnmetBound("human_distance", 0.41, "at least", 0.5, "m"),),
    "AE750",
)


SKILL = {"module": "tidy", "skill": "wipe"}


Events = Sequence[tuple[str, Mapping[str, Any]]]


def note(event: str, **details: Any) -> tuple[str, Mapping[str, Any]]:
    return "note", {"event": event, "details": details}


STARTED = note("step-started", skill="tidy.wipe")


GRIP = {"kind": "grip", "parameters": {}}


WHY = {"causes": causes_to_json([NEAR])}


DENIED: Events = [
    STARTED,
    ("decision", {**SKILL, "verdict": "DENY", "asked": GRIP, **WHY}),
    ("step-ended", {**SKILL, "status": "denied", "reason": "AE750", **WHY}),
    note("step-ended", skill="tidy.wipe", status="denied", failed=True, reason="denied: AE750", **WHY),
]


FAILED = note(
    "run-ended",
    task="tidy.clean",
    reached=False,
    goal="clean",
    measured={"clean": None},
    reason="`wipe` was denied",
)
