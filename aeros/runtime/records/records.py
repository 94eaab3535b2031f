"""Contents of audit records: sessions, decisions, callers and planned motions.

The points of a path are packed as base64: a slide consists of 6,000 numbers, which take twice the room as
text. A body, which many motions share, is recorded once and named by its digest. A plan that does not have
the form of a motion is recorded as it is, as far as a record can hold it.

Values from a skill or a planner come last in each record: they may be too large to hold, and what comes
before them must not suffer (`canonical_json`).
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
    Hull,
    JointPath,
    JointVector,
    MotionCompletion,
    NoMotion,
    Readings,
    RobotBody,
    ServoBounds,
    Trajectory,
)
from aeros.skill import Action
from aeros.spec.model.cause import Cause, causes_to_json


def session_details(configuration: Configuration) -> dict[str, Any]:
    """Describe a configuration for the record that opens or resumes a session.

    Args:
        configuration: site and active modules.

    Returns:
        JSON-encodable identity of the site and of each active module, by digest.
    """
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


def encode_readings(readings: Readings) -> Encoded:
    """Encode value and time of each reading, by name. This is the definition of the encoding.

    Args:
        readings: value (SI) and plant time (s) of each state variable, by name.

    Returns:
        Canonical JSON with its size.
    """
    return encode_with_size({name: [reading.value, reading.time] for name, reading in readings.items()})


class DecisionRecord(NamedTuple):
    """A decision and everything it was based on: enough to decide it again.

    Attributes:
        decision: the final decision.
        configuration: digest of the configuration.
        now: plant seconds.
        readings: state on which it was decided.
        caller: module, skill and inputs.
        requested_action: the action as the skill asked for it.
        usage: used-up count of each quota; None if the clock was wrong and the gate was not asked.
        concurrent_records: numbers of the records of the decisions on the other active actions.
        halting_records: those of them whose motions were being brought to rest.
        motion: details from `motion_details`, if the whole motion was decided.
        causes: why the action was not simply allowed, as data.
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
    """Build the details of a decision's record.

    Args:
        record: the decision and everything it was based on.
        encode: encodes readings as `encode_readings` does.

    Returns:
        JSON-encodable details; the state carries its canonical text.
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


def disagreement_details(record: DecisionRecord, second: Decision) -> dict[str, Any]:
    """Build the details of the record of a disagreement of the compiled gate with Z3.

    Args:
        record: the decision of the compiled gate and everything it was based on.
        second: the decision by Z3.

    Returns:
        As `decision_details`, with the outcomes as `compiled` and `z3`.
    """
    details = decision_details(record)
    compiled = {name: details.pop(name) for name in decision_outcome(record.decision)}
    return {**details, "compiled": compiled, "z3": decision_outcome(second)}


def decision_outcome(decision: Decision) -> dict[str, Any]:
    """Build the part of a record that says how a decision came out.

    Args:
        decision: the decision.

    Returns:
        Verdict, reasons, and the action that may be executed or None.
    """
    return {
        "verdict": decision.kind.value,
        "reasons": [[reason.code, reason.rule, reason.text] for reason in decision.reasons],
        "decided": None if decision.action is None else _action_details(decision.action),
    }


def motion_details(gated: Decision, decision: Decision, motion: Mapping[str, Any]) -> dict[str, Any]:
    """Build the part of a record that says which motion was decided.

    Args:
        gated: the gate's decision, before the check of the motion.
        decision: the final decision; the same object if the motion changed nothing.
        motion: encoded by `motion_to_json`.

    Returns:
        The motion with its digest; if the motion was denied, also the gate's own decision.
    """
    encoding = encode_with_size(motion)
    details = {"motion_digest": encoding.digest, "motion": encoding}
    return details if decision is gated else {**details, "gate": decision_outcome(gated)}


def caller_details(caller: Caller) -> dict[str, Any]:
    """Build the part of a record that says who asked.

    Args:
        caller: module, skill and inputs.

    Returns:
        Module, skill and inputs, with the inputs last.
    """
    return {"module": caller.module, "skill": caller.skill, "inputs": dict(caller.inputs)}


def format_reasons(reasons: tuple[Reason, ...], causes: tuple[Cause, ...] = ()) -> str:
    """Format the reasons of a denial for people: the first that values explain, and the other rules.

    Args:
        reasons: the reasons, in order.
        causes: the cause of each, in the same order, with the values that broke it; empty if unknown.

    Returns:
        One line, `CODE RULE: VALUES; also RULE, RULE`; the text of the reason where no cause has values.
    """
    if not reasons:
        return "the gate gave no reason"
    values = [", ".join(map(str, cause.shortfalls)) for cause in causes] or [""] * len(reasons)
    first, shown = next(
        ((reason, one) for reason, one in zip(reasons, values, strict=True) if one), (reasons[0], "")
    )
    others = [rule for rule in dict.fromkeys(reason.rule for reason in reasons) if rule != first.rule]
    also = f"; also {', '.join(others)}" if others else ""
    return f"{first.code} {first.rule}: {shown or first.text}{also}"


def _action_details(action: Action) -> dict[str, Any]:
    return {"kind": action.kind, "parameters": dict(action.parameters)}


def motion_to_json(plan: object, body: str) -> dict[str, Any]:
    """Encode what a plant planned for an action.

    Args:
        plan: a `Trajectory`, `NoMotion` or `MotionCompletion`; anything else is encoded as it is.
        body: digest of the body of a trajectory.

    Returns:
        JSON-encodable dict, which `motion_from_json` decodes.
    """
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
    """Encode the body of a trajectory.

    Args:
        body: a `RobotBody`; anything else is returned as it is.

    Returns:
        JSON-encodable value, by whose digest motions name the body.
    """
    if type(body) is not RobotBody:
        return body
    parts = {"balls": _tuples_to_lists(body.balls, Ball), "hulls": _tuples_to_lists(body.hulls, Hull)}
    return {**_fields_to_json(body), **parts}


def _tuples_to_lists(parts: Any, kind: type[Ball | Hull]) -> Any:
    return [list(one) if type(one) is kind else one for one in parts] if type(parts) is tuple else parts


def motion_from_json(encoded_value: Any, bodies: Mapping[str, Any]) -> Any:
    """Decode what `motion_to_json` encoded, so that it can be decided again.

    Args:
        encoded_value: parsed JSON.
        bodies: encoded bodies (`body_to_json`) by digest.

    Returns:
        The plan, equal to the encoded one.

    Raises:
        KeyError: the body is not in `bodies`.
        TypeError: `encoded_value` is not such an encoding.
        ValueError: `encoded_value` is not such an encoding.
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
    raise ValueError("it is not a motion")


# Parts.


def _path_to_json(path: Any) -> Any:
    """Pack the points as doubles in base64, each shared point once; return anything but a path as it is."""
    if not _is_path(path):
        return path
    numbers = [*chain(path[0][0], *(point for piece in path for point in piece[1:]))]
    packed = b64encode(struct.pack(f"<{len(numbers)}d", *numbers)).decode("ascii")
    return {"joints": len(path[0][0]), "points": packed}


def _is_path(path: Any) -> bool:
    """Return True if all numbers are doubles, points have equal length and pieces are connected."""
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
                raise ValueError("its points are not doubles")
            numbers = struct.unpack(f"<{len(raw) // 8}d", raw)
            points: list[JointVector] = [*zip(*[iter(numbers)] * joints, strict=True)]
            return tuple([_piece(points[at : at + 4]) for at in range(0, len(points) - 1, 3)])
    path: JointPath = _lists_to_tuples(encoded_value)
    return path


def _piece(points: list[JointVector]) -> tuple[JointVector, JointVector, JointVector, JointVector]:
    a, b, c, d = points
    return a, b, c, d


def _body_from_json(encoded_value: Any) -> Any:
    if type(encoded_value) is dict and "hulls" not in encoded_value:
        encoded_value = {**_NO_HULLS, **encoded_value}  # recorded before bodies had hulls
    if not _has_fields(encoded_value, RobotBody):
        return _lists_to_tuples(encoded_value)
    read = _fields_from_json(encoded_value)
    for name, kind in (("balls", Ball), ("hulls", Hull)):
        if type(read[name]) is tuple:
            read[name] = tuple([kind(*one) if type(one) is tuple else one for one in read[name]])
    return RobotBody(**read)


_NO_HULLS: Final[dict[str, Any]] = {"hulls": [], "exempt_pairs": []}


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
    """Decode a value, with tuples in place of lists."""
    if type(plain) is list:
        return tuple([_lists_to_tuples(one) for one in plain])
    return decode_value(plain)
