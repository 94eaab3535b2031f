"""Messages between an agent and a hosted plant: length-prefixed JSON over a local socket.

Values arrive unchanged: doubles to the last bit, tuples as tuples. A malformed message ends the connection,
and so stops the plant.
"""

from __future__ import annotations

import json
import socket
import struct
from base64 import b64decode, b64encode
from collections.abc import Mapping
from typing import Any, Final

from aeros.runtime.ports import (
    Ball,
    CameraPicture,
    CameraView,
    Hull,
    MotionCompletion,
    NoMotion,
    PlannedMotion,
    PlantLostError,
    Reading,
    RobotBody,
    ServoBounds,
    Trajectory,
)

_LENGTH_PREFIX: Final = struct.Struct("<I")
_MAX_MESSAGE_BYTES: Final = 64 * 1024 * 1024


class ConnectionLostError(PlantLostError):
    """The other end is gone, does not answer in time, or sends malformed messages."""


class MessageChannel:
    """One end of the connection between an agent and a hosted plant: sends and receives messages.

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
            message: values that JSON can hold, those of `encode_value`, and numbers that convert to float.

        Raises:
            ConnectionLostError: it cannot be sent.
        """
        # `float` encodes the numbers of NumPy, and raises TypeError for anything but a number.
        body = json.dumps(message, default=float).encode()
        try:
            self._connection.sendall(_LENGTH_PREFIX.pack(len(body)) + body)
        except OSError as failure:
            raise ConnectionLostError(f"cannot send: {failure}") from failure

    def receive(self) -> dict[str, Any]:
        """Receive the next message.

        Returns:
            The JSON object; see `decode_value` for its values.

        Raises:
            ConnectionLostError: none arrives in time, or it is malformed.
        """
        (length,) = _LENGTH_PREFIX.unpack(self._receive_bytes(_LENGTH_PREFIX.size))
        if length > _MAX_MESSAGE_BYTES:
            raise ConnectionLostError(f"message of {length} bytes exceeds the limit of {_MAX_MESSAGE_BYTES}")
        try:
            message = json.loads(self._receive_bytes(length))
        except ValueError as failure:
            raise ConnectionLostError(f"received data is not a message: {failure}") from failure
        if not isinstance(message, dict):
            raise ConnectionLostError("received data is not a message")
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
                raise ConnectionLostError(f"cannot receive: {failure}") from failure
            if not part:
                raise ConnectionLostError("connection closed by peer")
            parts.append(part)
            count -= len(part)
        return b"".join(parts)


def encode_value(value: Any) -> Any:
    """Encode a value that a monitor sees.

    Args:
        value: as plants measure it; one that was measured earlier is a `Reading`.

    Returns:
        Values that JSON can hold. `json.dumps` alone would make a list of a `Reading`, as it is a tuple.
    """
    return {"reading": [value.value, value.time]} if type(value) is Reading else value


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


def encode_picture(picture: CameraPicture) -> dict[str, Any]:
    """Encode a picture as a message.

    Args:
        picture: the picture.

    Returns:
        Values that JSON can hold; colours and depth in base 64.
    """
    depth = None if picture.depth is None else b64encode(picture.depth).decode("ascii")
    return {
        "camera": picture.camera,
        "time": picture.time,
        "size": [picture.width, picture.height],
        "rgb": b64encode(picture.rgb).decode("ascii"),
        "depth": depth,
        "view": picture.view,
    }


def decode_picture(message: Mapping[str, Any]) -> CameraPicture:
    """Decode a picture.

    Args:
        message: of `encode_picture`.

    Returns:
        The picture.
    """
    depth = None if message["depth"] is None else b64decode(message["depth"])
    width, height = message["size"]
    view = CameraView(*decode_value(message["view"]))
    return CameraPicture(
        message["camera"], message["time"], width, height, b64decode(message["rgb"]), depth, view
    )


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
    "joint_tolerance",
    "speed",
    "acceleration",
    "jerk",
    "tool_speed",
    "tool_acceleration",
    "tool_jerk",
)


def decode_plan(message: Mapping[str, Any], body: RobotBody | None) -> PlannedMotion:
    """Decode a plan.

    Args:
        message: of `encode_plan`.
        body: the robot's body, for a trajectory; None if none was received.

    Returns:
        The plan.

    Raises:
        ConnectionLostError: the plan is a trajectory, and there is no body.
    """
    if "completed" in message:
        return MotionCompletion(message["completed"], message["reason"])
    if "motionless" in message:
        return NoMotion(message["motionless"])
    if body is None:
        raise ConnectionLostError("plan refers to a body that was never sent")
    servo = None if message["servo"] is None else ServoBounds(*decode_value(message["servo"]))
    paths, base, way = (
        decode_value(message["paths"]),
        decode_value(message["base"]),
        decode_value(message["way"]),
    )
    return Trajectory(body, paths, base, way, message["duration"], servo)


def encode_body(body: RobotBody) -> dict[str, Any]:
    """Encode a robot's body as a message.

    Args:
        body: the body.

    Returns:
        Values that JSON can hold.
    """
    return {
        "rows": body.dh_rows,
        "tool": body.tool_offset,
        "balls": body.balls,
        "hulls": body.hulls,
        "exempt_pairs": body.exempt_pairs,
    }


def decode_body(message: Mapping[str, Any]) -> RobotBody:
    """Decode a robot's body.

    Args:
        message: of `encode_body`.

    Returns:
        The body.
    """
    balls = tuple(
        Ball(link, joint, decode_value(centre), radius) for link, joint, centre, radius in message["balls"]
    )
    hulls = tuple(
        Hull(link, joint, decode_value(corners), radius) for link, joint, corners, radius in message["hulls"]
    )
    exempt = decode_value(message["exempt_pairs"])
    return RobotBody(decode_value(message["rows"]), decode_value(message["tool"]), balls, hulls, exempt)
