"""Messages against ROS 2's own definitions, and through its own encoding."""

from __future__ import annotations

from fractions import Fraction
from typing import Any, get_args, get_type_hints

import msgspec
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from aeros.runtime.bus import messages
from aeros.runtime.bus.messages import (
    Header,
    JointState,
    Message,
    Quaternion,
    TFMessage,
    Time,
    Transform,
    TransformStamped,
    Vector3,
    stamp,
)
from tests.repo.tree import ROOT

OWN = ROOT / "aeros" / "runtime" / "bus" / "aeros_msgs"
SHAPES = [one for one in vars(messages).values() if isinstance(one, type) and issubclass(one, Message)]
NAMED = {one.ros: one for one in SHAPES if one is not Message}
SERVICES = {
    "std_srvs/srv/Trigger_Request": "",
    "std_srvs/srv/Trigger_Response": "bool success\nstring message\n",
}
"""Services are not in the store; these are the lines of std_srvs/srv/Trigger.srv."""


def store() -> Any:
    found = get_typestore(Stores.ROS2_HUMBLE)
    texts = {f"aeros_msgs/msg/{path.stem}": path.read_text() for path in (OWN / "msg").iterdir()}
    for path in (OWN / "action").iterdir():
        parts = zip(("Goal", "Result", "Feedback"), path.read_text().split("---\n"), strict=True)
        texts |= {f"aeros_msgs/action/{path.stem}_{part}": text for part, text in parts}
    for name, text in (texts | SERVICES).items():
        lines = text or "uint8 structure_needs_at_least_one_member\n"
        (definition,) = get_types_from_msg(lines, name).values()
        found.register({name: definition})
    return found


STORE = store()


def spelt(shape: Any) -> str:
    """The type of a field, as ROS writes it."""
    if isinstance(shape, type) and issubclass(shape, Message):
        return shape.ros
    if shape in SCALARS:
        return SCALARS[shape]
    element, more = get_args(shape)
    assert more is ...
    return f"sequence<{spelt(element)}>"


SCALARS: dict[Any, str] = {
    str: "string",
    bool: "bool",
    float: "float64",
    messages.Octet: "byte",
    messages.Int32: "int32",
    messages.Uint8: "uint8",
    messages.Uint32: "uint32",
    messages.Nanoseconds: "uint32",
    messages.Uint64: "uint64",
}


def of_ros(node: Any) -> str:
    kind, content = node[0].name, node[1]
    if kind == "SEQUENCE":
        return f"sequence<{of_ros(content[0])}>"
    return str(content if kind == "NAME" else content[0])


@pytest.mark.parametrize("name", sorted(NAMED))
def test_fields_are_those_of_the_definition(name: str) -> None:
    shape = NAMED[name]
    hints = get_type_hints(shape, include_extras=True)
    ours = [(field, spelt(hints[field])) for field in shape.__struct_fields__]
    theirs = [(field, of_ros(node)) for field, node in STORE.fielddefs[name][1]]
    assert ours == [one for one in theirs if one[0] != "structure_needs_at_least_one_member"]


def test_every_own_definition_has_a_shape() -> None:
    own = {name for name in STORE.fielddefs if name.startswith("aeros_msgs/")}
    assert own == {name for name in NAMED if name.startswith("aeros_msgs/")}


TIMES = st.builds(Time, st.integers(-(2**31), 2**31 - 1), st.integers(0, 10**9 - 1))
HEADERS = st.builds(Header, TIMES, st.text("abc/_", max_size=5))
NUMBERS = st.floats(allow_nan=False)
SERIES = st.lists(NUMBERS, max_size=4).map(tuple)
VECTORS = st.builds(Vector3, NUMBERS, NUMBERS, NUMBERS)
TRANSFORMS = st.builds(
    TransformStamped,
    HEADERS,
    st.text("abc", max_size=4),
    st.builds(Transform, VECTORS, st.builds(Quaternion, NUMBERS, NUMBERS, NUMBERS, NUMBERS)),
)
JOINTS = st.builds(
    JointState, HEADERS, st.lists(st.text("abc", max_size=3), max_size=4).map(tuple), SERIES, SERIES, SERIES
)


def to_ros(message: Any) -> Any:
    if isinstance(message, Message):
        fields = {name: to_ros(getattr(message, name)) for name in message.__struct_fields__}
        return STORE.types[message.ros](**fields)
    if isinstance(message, tuple):
        return [to_ros(one) for one in message]
    return message


def plain(value: Any) -> Any:
    if hasattr(value, "__dataclass_fields__"):
        return {
            name: plain(getattr(value, name))
            for name in value.__dataclass_fields__
            if name != "__msgtype__" and not name.isupper()  # a constant of the type
        }
    if isinstance(value, float):
        return float(value)  # an element of an array of NumPy is a float of its own kind
    if isinstance(value, np.uint8):
        return int(value)
    if isinstance(value, str | bool | int):
        return value
    return [plain(one) for one in value]


@given(JOINTS | st.builds(TFMessage, st.lists(TRANSFORMS, max_size=3).map(tuple)))
def test_a_message_goes_through_the_encoding_of_ros_unchanged(message: Message) -> None:
    ros = to_ros(message)
    if isinstance(message, JointState):
        ros = type(ros)(
            ros.header, ros.name, *(np.array(one) for one in (ros.position, ros.velocity, ros.effort))
        )
    there = STORE.deserialize_cdr(STORE.serialize_cdr(ros, message.ros), message.ros)
    assert msgspec.convert(plain(there), type(message)) == message


@given(st.floats(-(2.0**31), 2.0**31 - 1))
@example(1_700_000_000.123456)
@example(-1e-9 / 3)
def test_a_stamp_is_the_nearest(seconds: float) -> None:
    made = stamp(seconds)
    assert 0 <= made.nanosec < 10**9
    assert abs(made.sec * 10**9 + made.nanosec - Fraction(seconds) * 10**9) <= Fraction(1, 2)


@pytest.mark.parametrize("seconds", [2.0**31, -(2.0**31) - 1, float("inf"), float("nan")])
def test_values_that_cannot_be_stamped_are_refused(seconds: float) -> None:
    with pytest.raises((ValueError, OverflowError)):
        stamp(seconds)
