"""Messages become objects of ROS 2's classes and come back, field by field."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from aeros.runtime.bus.messages import (
    BoolStamped,
    DiagnosticStatus,
    ExecuteSkillFeedback,
    ExecuteSkillGoal,
    ExecuteSkillResult,
    Header,
    JointState,
    KeyValue,
    Message,
    PointStamped,
    String,
    Time,
    TriggerRequest,
    TriggerResponse,
)
from aeros.runtime.bus.port import BusError
from aeros.runtime.bus.ros2.ros_types import MissingTypeError, RosConverter, import_interface, interface_of


def ros_class(name: str) -> Any:
    """A class as rosidl generates it: attributes by keyword, and a table of the fields' types."""
    octets = {"level": "octet"} if name.endswith("DiagnosticStatus") else {}

    class Generated(SimpleNamespace):
        @staticmethod
        def get_fields_and_field_types() -> dict[str, str]:
            return octets

    Generated.__name__ = name
    return Generated


@pytest.fixture
def converter() -> RosConverter:
    return RosConverter(ros_class)


@pytest.mark.parametrize(
    "message",
    [
        String("text"),
        PointStamped(Header(Time(3, 5), "world")),
        JointState(Header(Time(1)), ("a", "b"), (0.5, 1.5)),
        BoolStamped(Header(), True),
        TriggerResponse(True, "done"),
    ],
)
def test_a_message_survives_the_way_there_and_back(message: Message, converter: RosConverter) -> None:
    assert converter.from_ros(converter.to_ros(message), type(message)) == message


def test_arrays_and_messages_within_messages_are_converted(converter: RosConverter) -> None:
    ros = converter.to_ros(DiagnosticStatus(2, "arm", values=(KeyValue("k", "v"),)))
    assert ros.level == b"\x02"
    assert [type(one).__name__ for one in ros.values] == ["diagnostic_msgs/msg/KeyValue"]


def test_a_package_that_is_missing_is_named() -> None:
    with pytest.raises(MissingTypeError, match="needs the ROS 2 package `no_such_msgs`") as raised:
        import_interface("no_such_msgs/msg/Thing")
    assert raised.value.package == "no_such_msgs"


def test_a_part_of_a_service_is_an_attribute_of_its_class(monkeypatch: pytest.MonkeyPatch) -> None:
    trigger = SimpleNamespace(Request="request", Response="response")
    monkeypatch.setitem(__import__("sys").modules, "std_srvs.srv", SimpleNamespace(Trigger=trigger))
    assert import_interface("std_srvs/srv/Trigger") is trigger
    assert import_interface("std_srvs/srv/Trigger_Request") == "request"


def test_parts_name_their_service_or_action() -> None:
    assert interface_of((TriggerRequest, TriggerResponse)) == "std_srvs/srv/Trigger"
    parts = (ExecuteSkillGoal, ExecuteSkillFeedback, ExecuteSkillResult)
    assert interface_of(parts) == "aeros_msgs/action/ExecuteSkill"


@pytest.mark.parametrize("kinds", [(TriggerRequest, ExecuteSkillGoal), (String,)])
def test_parts_of_different_interfaces_are_refused(kinds: tuple[type[Message], ...]) -> None:
    with pytest.raises(BusError, match="not parts of one service or action"):
        interface_of(kinds)
