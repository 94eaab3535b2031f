"""What agent and hosted plant say to each other: length-prefixed JSON over a local socket.

Values come as they were: doubles to the last bit, tuples as tuples.  What is not of this form ends the
conversation, and so stops the plant.
"""

from __future__ import annotations

import json
import socket
import struct
from collections.abc import Mapping
from typing import Any, Final

from aeros.runtime.ports import Ball, Body, Completion, Motionless, Plan, Reading, Servo, Trajectory

_LENGTH: Final = struct.Struct("<I")
_MOST: Final = 64 * 1024 * 1024


class LostError(ConnectionError):
    """The other end is gone, or silent for too long, or makes no sense."""


class Line:
    """One end of the conversation.

    patience: real seconds for each message of the other end; None to wait for ever.
    """

    def __init__(self, connection: socket.socket, patience: float | None) -> None:
        self._connection = connection
        connection.settimeout(patience)

    def say(self, message: Mapping[str, Any]) -> None:
        """Send one message; raises `LostError`."""
        body = json.dumps(message, default=_told).encode()
        try:
            self._connection.sendall(_LENGTH.pack(len(body)) + body)
        except OSError as failure:
            raise LostError(f"nothing can be said any more: {failure}") from failure

    def hear(self) -> dict[str, Any]:
        """The next message; raises `LostError`."""
        (length,) = _LENGTH.unpack(self._exactly(_LENGTH.size))
        if length > _MOST:
            raise LostError(f"a message of {length} bytes is none")
        try:
            message = json.loads(self._exactly(length))
        except ValueError as failure:
            raise LostError(f"what was said is no message: {failure}") from failure
        if not isinstance(message, dict):
            raise LostError("what was said is no message")
        return message

    def close(self) -> None:
        """Hang up; safe to call twice."""
        self._connection.close()

    def _exactly(self, count: int) -> bytes:
        parts = []
        while count:
            try:
                part = self._connection.recv(min(count, 1 << 20))
            except OSError as failure:
                raise LostError(f"nothing is heard any more: {failure}") from failure
            if not part:
                raise LostError("the other end hung up")
            parts.append(part)
            count -= len(part)
        return b"".join(parts)


def _told(value: object) -> object:
    """What JSON does not know: readings, and the numbers of NumPy."""
    if isinstance(value, Reading):
        return {"reading": [value.value, value.time]}
    return float(value)  # type: ignore[arg-type]  # raises TypeError for what is no number


def heard(value: Any) -> Any:
    """A value as it was before it was said."""
    if type(value) is list:
        return tuple(heard(part) for part in value)
    if type(value) is dict:
        (measured, time) = value["reading"]
        return Reading(heard(measured), time)
    return value


def plan_told(plan: Plan) -> dict[str, Any]:
    """A plan as a message, its body left out."""
    match plan:
        case Completion(completed=completed, reason=reason):
            return {"completed": completed, "reason": reason}
        case Motionless(why=why):
            return {"motionless": why}
        case Trajectory():
            servo = plan.servo
            return {
                "paths": plan.paths,
                "base": plan.base,
                "way": plan.way,
                "duration": plan.duration,
                "servo": None if servo is None else [getattr(servo, name) for name in _SERVO],
            }


_SERVO: Final = ("slack", "speed", "acceleration", "jerk", "tool_speed", "tool_acceleration", "tool_jerk")


def plan_heard(told: Mapping[str, Any], body: Body | None) -> Plan:
    """The plan that was told of; `body`: of a trajectory."""
    if "completed" in told:
        return Completion(told["completed"], told["reason"])
    if "motionless" in told:
        return Motionless(told["motionless"])
    if body is None:
        raise LostError("it tells of a motion, and never told of the body that moves")
    servo = None if told["servo"] is None else Servo(*heard(told["servo"]))
    paths, base, way = heard(told["paths"]), heard(told["base"]), heard(told["way"])
    return Trajectory(body, paths, base, way, told["duration"], servo)


def body_told(body: Body) -> dict[str, Any]:
    """A body as a message."""
    return {"rows": body.rows, "tool": body.tool, "balls": body.balls}


def body_heard(told: Mapping[str, Any]) -> Body:
    """The body that was told of."""
    balls = tuple(Ball(link, joint, heard(centre), radius) for link, joint, centre, radius in told["balls"])
    return Body(heard(told["rows"]), heard(told["tool"]), balls)
