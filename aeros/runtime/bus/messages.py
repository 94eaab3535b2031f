"""Message types: those of ROS 2's common packages, and AEROS's own package `aeros_msgs`.

Each field has the name, order and type that ROS 2 gives it, so a binding copies field by field. A test
compares them with the definitions of ROS 2 Humble; those of `aeros_msgs` are in the folder of that name.
Messages are immutable, so that no subscriber changes what another receives.
"""

from __future__ import annotations

from functools import lru_cache
from math import nan
from typing import Annotated, ClassVar, Final

from msgspec import Meta, Struct

Int32 = Annotated[int, Meta(ge=-(2**31), lt=2**31)]
Uint8 = Annotated[int, Meta(ge=0, lt=2**8)]
Uint32 = Annotated[int, Meta(ge=0, lt=2**32)]
Uint64 = Annotated[int, Meta(ge=0)]
Octet = Annotated[int, Meta(ge=0, lt=2**8, title="byte")]
Nanoseconds = Annotated[int, Meta(ge=0, lt=10**9)]

_NANO: Final = 10**9


class Message(Struct, frozen=True, forbid_unknown_fields=True):
    """Base of messages, requests, responses, goals, results and feedback; `ros` is its type name in ROS 2."""

    ros: ClassVar[str]


class Time(Message, frozen=True):
    """Time stamp; here in seconds on the plant's clock.

    Attributes:
        sec: whole seconds.
        nanosec: nanoseconds beyond these, below 10⁹.
    """

    ros = "builtin_interfaces/msg/Time"
    sec: Int32 = 0
    nanosec: Nanoseconds = 0


@lru_cache(maxsize=16)  # the measurements of a tick have one time
def stamp(seconds: float) -> Time:
    """Convert a time to the nearest stamp, exactly: a product of doubles would be off by up to 128 ns.

    Args:
        seconds: plant seconds.

    Returns:
        The stamp.

    Raises:
        ValueError: ROS 2 has no stamp for `seconds`, or they are not a number.
        OverflowError: `seconds` are infinite.
    """
    numerator, denominator = seconds.as_integer_ratio()
    nanoseconds = (2 * numerator * _NANO + denominator) // (2 * denominator)
    if not -(2**31) <= nanoseconds // _NANO < 2**31:
        raise ValueError(f"ROS 2 cannot stamp the time {seconds} s")
    return Time(nanoseconds // _NANO, nanoseconds % _NANO)


class Header(Message, frozen=True):
    """Time stamp and frame of a message.

    Attributes:
        stamp: time of the measurement.
        frame_id: name of the frame that coordinates are in; empty if it has none.
    """

    ros = "std_msgs/msg/Header"
    stamp: Time = Time()
    frame_id: str = ""


class JointState(Message, frozen=True):
    """State of joints; each array is empty or has one value for each name.

    Attributes:
        header: time stamp.
        name: names of the joints.
        position: rad; m for a sliding joint.
        velocity: rad/s; m/s for a sliding joint.
        effort: N·m; N for a sliding joint.
    """

    ros = "sensor_msgs/msg/JointState"
    header: Header = Header()
    name: tuple[str, ...] = ()
    position: tuple[float, ...] = ()
    velocity: tuple[float, ...] = ()
    effort: tuple[float, ...] = ()


class Vector3(Message, frozen=True):
    """Vector in space.

    Attributes:
        x, y, z: components; m if it is a displacement.
    """

    ros = "geometry_msgs/msg/Vector3"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class Point(Message, frozen=True):
    """Position.

    Attributes:
        x, y, z: coordinates, m.
    """

    ros = "geometry_msgs/msg/Point"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class PointStamped(Message, frozen=True):
    """Position in the header's frame.

    Attributes:
        header: time stamp and frame.
        point: the position, m.
    """

    ros = "geometry_msgs/msg/PointStamped"
    header: Header = Header()
    point: Point = Point()


class Quaternion(Message, frozen=True):
    """Rotation as a unit quaternion.

    Attributes:
        x, y, z: vector part.
        w: scalar part.
    """

    ros = "geometry_msgs/msg/Quaternion"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


class Transform(Message, frozen=True):
    """Pose of one frame in another.

    Attributes:
        translation: origin of the frame, m.
        rotation: orientation of the frame.
    """

    ros = "geometry_msgs/msg/Transform"
    translation: Vector3 = Vector3()
    rotation: Quaternion = Quaternion()


class TransformStamped(Message, frozen=True):
    """Pose of the frame `child_frame_id` in the header's frame.

    Attributes:
        header: time stamp, and the parent frame.
        child_frame_id: name of the frame whose pose it is.
        transform: its pose in the parent frame.
    """

    ros = "geometry_msgs/msg/TransformStamped"
    header: Header = Header()
    child_frame_id: str = ""
    transform: Transform = Transform()


class TFMessage(Message, frozen=True):
    """Transforms, as on `/tf`.

    Attributes:
        transforms: one transform for each child frame.
    """

    ros = "tf2_msgs/msg/TFMessage"
    transforms: tuple[TransformStamped, ...] = ()


class CompressedImage(Message, frozen=True):
    """Picture of a camera.

    Attributes:
        header: time at which it was taken, and the camera's name.
        format: name of the compression.
        data: bytes of the compressed picture.
    """

    ros = "sensor_msgs/msg/CompressedImage"
    header: Header = Header()
    format: str = ""
    data: tuple[Uint8, ...] = ()


class Clock(Message, frozen=True):
    """Time of the plant, as on `/clock`.

    Attributes:
        clock: the time.
    """

    ros = "rosgraph_msgs/msg/Clock"
    clock: Time = Time()


class KeyValue(Message, frozen=True):
    """A value that a diagnosis reports.

    Attributes:
        key: name of the value.
        value: the value as text.
    """

    ros = "diagnostic_msgs/msg/KeyValue"
    key: str = ""
    value: str = ""


class DiagnosticStatus(Message, frozen=True):
    """State of one part of a robot.

    Attributes:
        level: 0 ok, 1 warning, 2 error, 3 stale.
        name: name of the part.
        message: its state in words.
        hardware_id: the robot.
        values: numbers behind the state.
    """

    ros = "diagnostic_msgs/msg/DiagnosticStatus"
    level: Octet = 0
    name: str = ""
    message: str = ""
    hardware_id: str = ""
    values: tuple[KeyValue, ...] = ()


class DiagnosticArray(Message, frozen=True):
    """States of parts of a robot, as on `/diagnostics`.

    Attributes:
        header: time stamp.
        status: the states.
    """

    ros = "diagnostic_msgs/msg/DiagnosticArray"
    header: Header = Header()
    status: tuple[DiagnosticStatus, ...] = ()


class String(Message, frozen=True):
    """Text.

    Attributes:
        data: the text.
    """

    ros = "std_msgs/msg/String"
    data: str = ""


class TriggerRequest(Message, frozen=True):
    """Request without fields."""

    ros = "std_srvs/srv/Trigger_Request"


class TriggerResponse(Message, frozen=True):
    """Response to a request without arguments.

    Attributes:
        success: True if the request was carried out.
        message: explanation in words.
    """

    ros = "std_srvs/srv/Trigger_Response"
    success: bool = False
    message: str = ""


class DecisionMessage(Message, frozen=True):
    """Decision of the gate, as the audit log records it.

    Attributes:
        stamp: plant time of the decision.
        record: number of its record.
        module: name of the module whose skill asked.
        skill: id of that skill.
        verdict: decision, as the log writes it: ALLOW, ATTENUATE or DENY.
        action: JSON, as in the record.
        reasons: JSON, as in the record.
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
    """Record of the audit log.

    Attributes:
        stamp: plant time of the event.
        record: number of the record.
        event: kind of event.
        details: the event's data, as JSON text.
    """

    ros = "aeros_msgs/msg/Event"
    stamp: Time = Time()
    record: Uint64 = 0
    event: str = ""
    details: str = ""


class BoolStamped(Message, frozen=True):
    """Measured truth value: a predicate, or a switch.

    Attributes:
        header: time stamp of the measurement.
        value: the value.
    """

    ros = "aeros_msgs/msg/BoolStamped"
    header: Header = Header()
    value: bool = False


class Float64Stamped(Message, frozen=True):
    """Measured number.

    Attributes:
        header: time stamp of the measurement.
        value: the number, SI.
    """

    ros = "aeros_msgs/msg/Float64Stamped"
    header: Header = Header()
    value: float = 0.0


class StringStamped(Message, frozen=True):
    """Measured member of an enumeration.

    Attributes:
        header: time stamp of the measurement.
        value: the member's name.
    """

    ros = "aeros_msgs/msg/StringStamped"
    header: Header = Header()
    value: str = ""


class BoundedQuantity(Message, frozen=True):
    """Quantity that rules of the site bound, and its tightest bounds; NaN where there is none.

    Attributes:
        header: time stamp.
        unit: SI unit of the numbers.
        value: the quantity.
        lower, upper: bounds.
        lower_rule, upper_rule: ids of the rules that the bounds come from; empty where there is none.
    """

    ros = "aeros_msgs/msg/BoundedQuantity"
    header: Header = Header()
    unit: str = ""
    value: float = nan
    lower: float = nan
    upper: float = nan
    lower_rule: str = ""
    upper_rule: str = ""


class ExecuteSkillGoal(Message, frozen=True):
    """Goal: run one skill.

    Attributes:
        module: name of the module.
        skill: id of its skill.
        inputs: inputs by name, a JSON object; numbers in SI.
    """

    ros = "aeros_msgs/action/ExecuteSkill_Goal"
    module: str = ""
    skill: str = ""
    inputs: str = "{}"


class ExecuteSkillFeedback(Message, frozen=True):
    """Numbers of actions of the skill that the gate has decided so far.

    Attributes:
        allowed: number of allowed actions.
        attenuated: number of attenuated actions.
        denied: number of denied actions.
    """

    ros = "aeros_msgs/action/ExecuteSkill_Feedback"
    allowed: Uint32 = 0
    attenuated: Uint32 = 0
    denied: Uint32 = 0


class ExecuteSkillResult(Message, frozen=True):
    """End of a skill's step.

    Attributes:
        status: a value of `StepStatus`.
        reason: text of the reason; empty if the skill finished.
        outputs: the skill's outputs, a JSON object in SI.
        allowed, attenuated, denied: numbers of the skill's decided actions.
    """

    ros = "aeros_msgs/action/ExecuteSkill_Result"
    status: str = ""
    reason: str = ""
    outputs: str = "{}"
    allowed: Uint32 = 0
    attenuated: Uint32 = 0
    denied: Uint32 = 0


class LogMessage(Message, frozen=True):
    """Line of a log, as viewers show it.

    Attributes:
        stamp: time of the event.
        level: 20 for information, 30 for a warning, 40 for an error.
        name: name of the source.
        msg: text.
        file, function, line: place in a program; empty and 0 here.
    """

    ros = "rcl_interfaces/msg/Log"
    stamp: Time = Time()
    level: Uint8 = 20
    name: str = ""
    msg: str = ""
    file: str = ""
    function: str = ""
    line: Uint32 = 0


class PursueGoal(Message, frozen=True):
    """Goal: pursue one instruction.

    Attributes:
        instruction: words that tasks of the modules declare.
        timeout: s on the plant's clock after which the task is cancelled; 0 for no limit.
    """

    ros = "aeros_msgs/action/Pursue_Goal"
    instruction: str = ""
    timeout: float = 0.0


class PursueFeedback(Message, frozen=True):
    """Newest event of the agent.

    Attributes:
        event: kind of event.
        text: the event in words; may be empty.
    """

    ros = "aeros_msgs/action/Pursue_Feedback"
    event: str = ""
    text: str = ""


class PursueResult(Message, frozen=True):
    """End of a pursued instruction.

    Attributes:
        reached: True if the goal is measured as true.
        reason: why it is not reached; empty if it is.
        measured: values that the goal and the task are about, a JSON object.
        steps: number of skill invocations.
        allowed, attenuated, denied: numbers of decided actions.
    """

    ros = "aeros_msgs/action/Pursue_Result"
    reached: bool = False
    reason: str = ""
    measured: str = "{}"
    steps: Uint32 = 0
    allowed: Uint32 = 0
    attenuated: Uint32 = 0
    denied: Uint32 = 0
