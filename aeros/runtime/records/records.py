"""Contents of the audit record: sessions, decisions, callers, and motions as a plant states them.

The points of a path are packed: a slide is made of 6,000 numbers, which as text take twice the room.
A body, which many motions have in common, is recorded once, and named by its digest.  What is not of the form
of a motion is recorded as it is, as far as a record can.

What a skill or a planner supplied comes last in each: it may be too large to hold, and what comes
before it must not suffer (`canonical`).
"""

from __future__ import annotations

import struct
from base64 import b64decode, b64encode
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from itertools import chain, pairwise
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from aeros.runtime.canonical_json import Encoded, decode_value, encode_with_size
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision, Reason
from aeros.runtime.ports import (
    Ball,
    JointPath,
    JointVector,
    MotionCompletion,
    NoMotion,
    Readings,
    RobotBody,
    ServoBounds,
    Trajectory,
)
from aeros.runtime.records.encode_readings import encode_readings
from aeros.skill import Action
from aeros.spec.model.cause import Cause, causes_to_json


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
    requested_action: Action
    usage: Mapping[str, int] | None
    concurrent_records: Sequence[int] = ()
    halting_records: Sequence[int] = ()
    motion: Mapping[str, Any] = MappingProxyType({})
    causes: Sequence[Cause] = ()


def decision_details(
    record: DecisionRecord, encode: Callable[[Readings], Encoded] = encode_readings
) -> dict[str, Any]:
    """What the log has of it.

    tell: what says of the readings what `encode_readings` says.
    """
    state = encode(record.readings)
    return {
        **decision_outcome(record.decision),
        "configuration": record.configuration,
        "time": record.now,
        "state_digest": state.digest,
        "state": state,
        "usage": None if record.usage is None else dict(record.usage),
        **({"beside": list(record.concurrent_records)} if record.concurrent_records else {}),
        **({"halting": list(record.halting_records)} if record.halting_records else {}),
        **record.motion,
        **({"causes": causes_to_json(record.causes)} if record.causes else {}),
        **caller_details(record.caller),
        "asked": _action_details(record.requested_action),
    }


def decision_outcome(decision: Decision) -> dict[str, Any]:
    """What came out."""
    return {
        "verdict": decision.kind.value,
        "reasons": [[reason.code, reason.rule, reason.text] for reason in decision.reasons],
        "decided": None if decision.action is None else _action_details(decision.action),
    }


def motion_details(gated: Decision, decision: Decision, motion: Mapping[str, Any]) -> dict[str, Any]:
    """The motion that the action becomes, as it is told; where that was denied, what the gate had said."""
    encoding = encode_with_size(motion)
    told = {"motion_digest": encoding.digest, "motion": encoding}
    return told if decision is gated else {**told, "gate": decision_outcome(gated)}


def caller_details(caller: Caller) -> dict[str, Any]:
    """Who asks, with its inputs."""
    return {"module": caller.module, "skill": caller.skill, "inputs": dict(caller.inputs)}


def format_reasons(reasons: tuple[Reason, ...]) -> str:
    """Why an action was denied, in words."""
    spelt = "; ".join(f"{reason.code} {reason.rule}: {reason.text}" for reason in reasons)
    return spelt or "the gate gave no reason"


def _action_details(action: Action) -> dict[str, Any]:
    return {"kind": action.kind, "parameters": dict(action.parameters)}


def motion_to_json(plan: object, body: str) -> dict[str, Any]:
    """Encode what a plant says that an action would do; `body`: digest of the body of a trajectory."""
    if type(plan) is Trajectory:
        paths, servo = plan.joint_paths, plan.servo
        return {
            "body": body,
            "base": plan.base,
            "way": plan.base_path,
            "duration": plan.duration,
            "servo": _fields_to_json(servo) if type(servo) is ServoBounds else servo,
            "paths": [_path_to_json(one) for one in paths] if type(paths) is tuple else paths,
        }
    if type(plan) is NoMotion:
        return {"motionless": plan.reason}
    if type(plan) is MotionCompletion:
        return {"completed": plan.completed, "reason": plan.reason}
    return {"unheard_of": plan}


def body_to_json(body: object) -> Any:
    """Encode the body of a trajectory."""
    if type(body) is not RobotBody:
        return body
    balls = body.balls
    listed = [list(one) if type(one) is Ball else one for one in balls] if type(balls) is tuple else balls
    return {**_fields_to_json(body), "balls": listed}


def motion_from_json(encoded_value: Any, bodies: Mapping[str, Any]) -> Any:
    """Decode what `motion_to_json` encoded, so that it can be decided again.

    bodies: what `body_to_json` encoded of each body, by its digest.
    Raises KeyError, TypeError or ValueError for what is no such encoding.
    """
    match encoded_value:
        case {"motionless": why}:
            return NoMotion(why)
        case {"completed": completed, "reason": reason}:
            return MotionCompletion(completed, reason)
        case {"body": body, "base": base, "way": way, "duration": duration, "servo": servo, "paths": paths}:
            return Trajectory(
                _body_from_json(bodies[body]),
                tuple(map(_path_from_json, paths)) if type(paths) is list else decode_value(paths),
                _lists_to_tuples(base),
                _lists_to_tuples(way),
                decode_value(duration),
                ServoBounds(**_fields_from_json(servo))
                if _has_fields(servo, ServoBounds)
                else decode_value(servo),
            )
        case {"unheard_of": plan}:
            return decode_value(plan)
    raise ValueError("it is no motion")


# Parts.


def _path_to_json(path: Any) -> Any:
    """Encode the points, each that two pieces share once, as doubles in base64; what is no path, as it is."""
    if not _is_path(path):
        return path
    numbers = [*chain(path[0][0], *(point for piece in path for point in piece[1:]))]
    packed = b64encode(struct.pack(f"<{len(numbers)}d", *numbers)).decode("ascii")
    return {"joints": len(path[0][0]), "points": packed}


def _is_path(path: Any) -> bool:
    """Say whether all are doubles, as many in each point, each piece beginning where the one before ends."""
    if type(path) is not tuple or not path or any(type(piece) is not tuple for piece in path):
        return False
    points = [*chain.from_iterable(path)]
    return (
        all(len(piece) == 4 for piece in path)
        and all(type(point) is tuple and len(point) == len(points[0]) > 0 for point in points)
        and all(type(number) is float for number in chain.from_iterable(points))
        and all(left[3] == right[0] for left, right in pairwise(path))
    )


def _path_from_json(encoded_value: Any) -> JointPath:
    match encoded_value:
        case {"joints": int(joints), "points": str(packed)}:
            raw = b64decode(packed, validate=True)
            if len(raw) % 8:
                raise ValueError("its points are no doubles")
            numbers = struct.unpack(f"<{len(raw) // 8}d", raw)
            points: list[JointVector] = [*zip(*[iter(numbers)] * joints, strict=True)]
            return tuple([_piece(points[at : at + 4]) for at in range(0, len(points) - 1, 3)])
    path: JointPath = _lists_to_tuples(encoded_value)
    return path


def _piece(points: list[JointVector]) -> tuple[JointVector, JointVector, JointVector, JointVector]:
    a, b, c, d = points
    return a, b, c, d


def _body_from_json(encoded_value: Any) -> Any:
    if not _has_fields(encoded_value, RobotBody):
        return _lists_to_tuples(encoded_value)
    read = _fields_from_json(encoded_value)
    balls = read["balls"]
    if type(balls) is tuple:
        read["balls"] = tuple([Ball(*one) if type(one) is tuple else one for one in balls])
    return RobotBody(**read)


_WRITTEN_NAMES: Final = {"dh_rows": "rows", "tool_offset": "tool", "joint_tolerance": "slack"}
"""Names that records have for fields of `RobotBody` and `ServoBounds`, where they differ from the code's."""
_CODE_NAMES: Final = {written: name for name, written in _WRITTEN_NAMES.items()}


def _fields_to_json(value: RobotBody | ServoBounds) -> dict[str, Any]:
    return {_WRITTEN_NAMES.get(one.name, one.name): getattr(value, one.name) for one in fields(value)}


def _has_fields(encoded_value: Any, kind: type[RobotBody | ServoBounds]) -> bool:
    names = {_WRITTEN_NAMES.get(one.name, one.name) for one in fields(kind)}
    return type(encoded_value) is dict and encoded_value.keys() == names


def _fields_from_json(encoded_value: Mapping[str, Any]) -> dict[str, Any]:
    return {_CODE_NAMES.get(name, name): _lists_to_tuples(value) for name, value in encoded_value.items()}


def _lists_to_tuples(plain: Any) -> Any:
    """Restore a value, with tuples in place of lists."""
    if type(plain) is list:
        return tuple([_lists_to_tuples(one) for one in plain])
    return decode_value(plain)
