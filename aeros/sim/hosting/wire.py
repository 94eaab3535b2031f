"""Messages between an agent and a hosted plant: length-prefixed JSON over a local socket.

Values arrive unchanged: doubles to the last bit, tuples as tuples. A malformed message ends the connection,
and so stops the plant.
"""

from __future__ import annotations

import json
import socket
import struct
from collections.abc import Mapping
from typing import Any, Final

from aeros.runtime.ports import (
    Ball,
    MotionCompletion,
    NoMotion,
    PlannedMotion,
    Reading,
    RobotBody,
    ServoBounds,
    Trajectory,
)

_LENGTH_PREFIX: Final = struct.Struct("<I")
_MAX_MESSAGE_BYTES: Final = 64 * 1024 * 1024


class ConnectionLostError(ConnectionError):
    """The other end is gone, does not answer in time, or sends malformed messages."""


class MessageChannel:
    """One end of the connection.

    Args:
        connection: a connected socket; the channel owns it.
        timeout_s: real seconds to wait for each read or write; None to wait for ever.
    """

    def __init__(self, connection: socket.socket, timeout_s: float | None) -> None:
        self._connection = connection
        connection.settimeout(timeout_s)

    def send(self, message: Mapping[str, Any]) -> None:
        """Send one message.

        Args:
            message: values that JSON can hold, `Reading`s, and numbers that convert to float.

        Raises:
            ConnectionLostError: it cannot be sent.
        """
        body = json.dumps(message, default=_json_default).encode()
        try:
            self._connection.sendall(_LENGTH_PREFIX.pack(len(body)) + body)
        except OSError as failure:
            raise ConnectionLostError(f"nothing can be said any more: {failure}") from failure

    def receive(self) -> dict[str, Any]:
        """Receive the next message.

        Returns:
            The JSON object; see `decode_value` for its values.

        Raises:
            ConnectionLostError: none arrives in time, or it is malformed.
        """
        (length,) = _LENGTH_PREFIX.unpack(self._receive_bytes(_LENGTH_PREFIX.size))
        if length > _MAX_MESSAGE_BYTES:
            raise ConnectionLostError(f"a message of {length} bytes is none")
        try:
            message = json.loads(self._receive_bytes(length))
        except ValueError as failure:
            raise ConnectionLostError(f"what was said is no message: {failure}") from failure
        if not isinstance(message, dict):
            raise ConnectionLostError("what was said is no message")
        return message

    def close(self) -> None:
        """Close the connection; safe to call twice."""
        self._connection.close()

    def _receive_bytes(self, count: int) -> bytes:
        parts = []
        while count:
            try:
                part = self._connection.recv(min(count, 1 << 20))
            except OSError as failure:
                raise ConnectionLostError(f"nothing is heard any more: {failure}") from failure
            if not part:
                raise ConnectionLostError("the other end hung up")
            parts.append(part)
            count -= len(part)
        return b"".join(parts)


def _json_default(value: object) -> object:
    """Encode values that JSON cannot hold: readings, and the numbers of NumPy."""
    if isinstance(value, Reading):
        return {"reading": [value.value, value.time]}
    return float(value)  # type: ignore[arg-type]  # raises TypeError for what is no number


def decode_value(value: Any) -> Any:
    """Restore a value from JSON: lists become tuples, encoded readings become `Reading`s.

    Args:
        value: as `json.loads` returns it.

    Returns:
        The value as it was sent.
    """
    if type(value) is list:
        return tuple(decode_value(part) for part in value)
    if type(value) is dict:
        (measured, time) = value["reading"]
        return Reading(decode_value(measured), time)
    return value


def encode_plan(plan: PlannedMotion) -> dict[str, Any]:
    """Encode a plan as a message, without its body.

    Args:
        plan: the plan.

    Returns:
        Values that JSON can hold.
    """
    match plan:
        case MotionCompletion(completed=completed, reason=reason):
            return {"completed": completed, "reason": reason}
        case NoMotion(reason=why):
            return {"motionless": why}
        case Trajectory():
            servo = plan.servo
            return {
                "paths": plan.joint_paths,
                "base": plan.base,
                "way": plan.base_path,
                "duration": plan.duration,
                "servo": None if servo is None else [getattr(servo, name) for name in _SERVO_FIELDS],
            }


_SERVO_FIELDS: Final = (
    "slack",
    "speed",
    "acceleration",
    "jerk",
    "tool_speed",
    "tool_acceleration",
    "tool_jerk",
)


def decode_plan(told: Mapping[str, Any], body: RobotBody | None) -> PlannedMotion:
    """The plan that was told of; `body`: of a trajectory."""
    if "completed" in told:
        return MotionCompletion(told["completed"], told["reason"])
    if "motionless" in told:
        return NoMotion(told["motionless"])
    if body is None:
        raise ConnectionLostError("it tells of a motion, and never told of the body that moves")
    servo = None if told["servo"] is None else ServoBounds(*decode_value(told["servo"]))
    paths, base, way = decode_value(told["paths"]), decode_value(told["base"]), decode_value(told["way"])
    return Trajectory(body, paths, base, way, told["duration"], servo)


def encode_body(body: RobotBody) -> dict[str, Any]:
    """Encode a robot's body as a message.

    Args:
        body: the body.

    Returns:
        Values that JSON can hold.
    """
    return {"rows": body.dh_rows, "tool": body.tool_offset, "balls": body.balls}


def decode_body(told: Mapping[str, Any]) -> RobotBody:
    """The body that was told of."""
    balls = tuple(
        Ball(link, joint, decode_value(centre), radius) for link, joint, centre, radius in told["balls"]
    )
    return RobotBody(decode_value(told["rows"]), decode_value(told["tool"]), balls)
