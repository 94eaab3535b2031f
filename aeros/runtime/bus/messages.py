"""Shapes of messages: those of ROS 2's common packages, and of `aeros_msgs`, which is AEROS's own.

A field has the name, the order and the type that ROS 2 gives it, so a binding copies field by field;
a test holds them against the definitions that ROS 2 Humble ships.  Those of `aeros_msgs` are in the
folder of that name.  Messages are immutable, so that no subscriber changes what another reads.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Final

from msgspec import Meta, Struct

Int32 = Annotated[int, Meta(ge=-(2**31), lt=2**31)]
Uint32 = Annotated[int, Meta(ge=0, lt=2**32)]
Uint64 = Annotated[int, Meta(ge=0)]
Nanoseconds = Annotated[int, Meta(ge=0, lt=10**9)]

_NANO: Final = 10**9


class Message(Struct, frozen=True, forbid_unknown_fields=True):
    """Any message, request, response, goal, result or feedback; `ros` is its type's name in ROS 2."""

    ros: ClassVar[str]


class Time(Message, frozen=True):
    """A time stamp; here seconds on the plant's clock."""

    ros = "builtin_interfaces/msg/Time"
    sec: Int32 = 0
    nanosec: Nanoseconds = 0


def stamp(seconds: float) -> Time:
    """Return the stamp nearest to `seconds`, exactly: a product of doubles would be off by up to 128 ns.

    Raises:
        ValueError: ROS 2 has no stamp for `seconds`, or they are not a number.
        OverflowError: `seconds` are infinite.
    """
    numerator, denominator = seconds.as_integer_ratio()
    nanoseconds = (2 * numerator * _NANO + denominator) // (2 * denominator)
    if not -(2**31) <= nanoseconds // _NANO < 2**31:
        raise ValueError(f"{seconds} s is no time that ROS 2 can stamp")
    return Time(nanoseconds // _NANO, nanoseconds % _NANO)


class Header(Message, frozen=True):
    """When and in which frame."""

    ros = "std_msgs/msg/Header"
    stamp: Time = Time()
    frame_id: str = ""


class JointState(Message, frozen=True):
    """Positions, velocities and efforts of joints: rad, rad/s, N·m; m, m/s, N where a joint slides."""

    ros = "sensor_msgs/msg/JointState"
    header: Header = Header()
    name: tuple[str, ...] = ()
    position: tuple[float, ...] = ()
    velocity: tuple[float, ...] = ()
    effort: tuple[float, ...] = ()


class Vector3(Message, frozen=True):
    """A vector in space; m where it is a way."""

    ros = "geometry_msgs/msg/Vector3"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class Point(Message, frozen=True):
    """A place, m."""

    ros = "geometry_msgs/msg/Point"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class PointStamped(Message, frozen=True):
    """A place in the header's frame."""

    ros = "geometry_msgs/msg/PointStamped"
    header: Header = Header()
    point: Point = Point()


class Quaternion(Message, frozen=True):
    """A rotation, as a unit quaternion."""

    ros = "geometry_msgs/msg/Quaternion"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


class Transform(Message, frozen=True):
    """Where a frame is, in another."""

    ros = "geometry_msgs/msg/Transform"
    translation: Vector3 = Vector3()
    rotation: Quaternion = Quaternion()


class TransformStamped(Message, frozen=True):
    """Where `child_frame_id` is in the header's frame."""

    ros = "geometry_msgs/msg/TransformStamped"
    header: Header = Header()
    child_frame_id: str = ""
    transform: Transform = Transform()


class TFMessage(Message, frozen=True):
    """Transforms, as on `/tf`."""

    ros = "tf2_msgs/msg/TFMessage"
    transforms: tuple[TransformStamped, ...] = ()


class String(Message, frozen=True):
    """A text."""

    ros = "std_msgs/msg/String"
    data: str = ""


class TriggerRequest(Message, frozen=True):
    """Nothing but the wish."""

    ros = "std_srvs/srv/Trigger_Request"


class TriggerResponse(Message, frozen=True):
    """Whether it was done, and what is said of it."""

    ros = "std_srvs/srv/Trigger_Response"
    success: bool = False
    message: str = ""


class Decision(Message, frozen=True):
    """A decision of the gate, as the audit record has it.

    record: its number in the audit log.  action, reasons: JSON, as in the record.
    """

    ros = "aeros_msgs/msg/Decision"
    stamp: Time = Time()
    record: Uint64 = 0
    module: str = ""
    skill: str = ""
    verdict: str = ""
    action: str = ""
    reasons: str = ""


class Event(Message, frozen=True):
    """A record of the audit log; `details` is JSON."""

    ros = "aeros_msgs/msg/Event"
    stamp: Time = Time()
    record: Uint64 = 0
    event: str = ""
    details: str = ""


class BoolStamped(Message, frozen=True):
    """A truth value that was measured: a predicate, or a switch."""

    ros = "aeros_msgs/msg/BoolStamped"
    header: Header = Header()
    value: bool = False


class Float64Stamped(Message, frozen=True):
    """A number that was measured, in SI."""

    ros = "aeros_msgs/msg/Float64Stamped"
    header: Header = Header()
    value: float = 0.0


class StringStamped(Message, frozen=True):
    """A member of an enumeration that was measured."""

    ros = "aeros_msgs/msg/StringStamped"
    header: Header = Header()
    value: str = ""


class ExecuteSkillGoal(Message, frozen=True):
    """One skill invocation; `inputs` is a JSON object, in SI."""

    ros = "aeros_msgs/action/ExecuteSkill_Goal"
    module: str = ""
    skill: str = ""
    inputs: str = "{}"


class ExecuteSkillFeedback(Message, frozen=True):
    """How many actions the gate has decided so far, by verdict."""

    ros = "aeros_msgs/action/ExecuteSkill_Feedback"
    allowed: Uint32 = 0
    attenuated: Uint32 = 0
    denied: Uint32 = 0


class ExecuteSkillResult(Message, frozen=True):
    """How the step ended, as `StepStatus` has it, and why; `outputs` is a JSON object, in SI."""

    ros = "aeros_msgs/action/ExecuteSkill_Result"
    status: str = ""
    reason: str = ""
    outputs: str = "{}"
    allowed: Uint32 = 0
    attenuated: Uint32 = 0
    denied: Uint32 = 0
