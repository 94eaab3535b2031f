"""Conversion between messages and the classes that ROS 2's message packages generate for Python.

The packages are imported when a type is first used, so this module needs none. A field is copied by its name,
as `Message` gives each field the name, order and type of ROS 2.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from importlib import import_module
from typing import Any, Final

from aeros.runtime.bus.messages import Message
from aeros.runtime.bus.port import BusError, M

_OCTET: Final = "octet"
"""Type of a field that ROS 2 calls `byte`, and of which rclpy wants `bytes`."""


class MissingTypeError(BusError):
    """The package of a message type is not installed; the message names it."""

    def __init__(self, package: str, ros: str) -> None:
        super().__init__(f"`{ros}` needs the ROS 2 package `{package}`, which is not installed")
        self.package = package


def import_interface(ros: str) -> Any:
    """Import the class of a message, a service or an action.

    Args:
        ros: Name in ROS 2, as `std_msgs/msg/Header`, `std_srvs/srv/Trigger` or
            `aeros_msgs/action/ExecuteSkill`; the name of a part, as `std_srvs/srv/Trigger_Request`, gives
            the class of the part.

    Returns:
        The class.

    Raises:
        MissingTypeError: Its package is not installed, or has no such type.
    """
    package, kind, name = ros.split("/")
    whole, _, part = name.partition("_") if kind != "msg" else (name, "", "")
    try:
        found = getattr(import_module(f"{package}.{kind}"), whole)
    except (ImportError, AttributeError) as error:
        raise MissingTypeError(package, ros) from error
    return getattr(found, part) if part else found


def interface_of(kinds: tuple[type[Message], ...]) -> str:
    """Name the service or action that messages are parts of.

    Args:
        kinds: Types of request and response, or of goal, feedback and result.

    Returns:
        Its name in ROS 2.

    Raises:
        BusError: They are not parts of one service or action.
    """
    names = {kind.ros.rpartition("_")[0] for kind in kinds if "/msg/" not in kind.ros}
    if len(names) != 1 or any("/msg/" in kind.ros for kind in kinds):
        raise BusError(f"{', '.join(kind.ros for kind in kinds)} are not parts of one service or action")
    return names.pop()


class RosConverter:
    """Converter of messages to objects of ROS 2's classes and back.

    Not thread-safe while a type is first used; each use later only reads.

    Args:
        find: Returns the class of a ROS 2 type.
    """

    def __init__(self, find: Callable[[str], Any] = import_interface) -> None:
        self._find = find
        self._classes: dict[type[Message], Any] = {}
        self._octets: dict[type[Message], frozenset[str]] = {}

    def class_of(self, kind: type[Message]) -> Any:
        """Return the ROS 2 class of a message type.

        Args:
            kind: The message type.

        Returns:
            The class.

        Raises:
            MissingTypeError: Its package is not installed.
        """
        if kind not in self._classes:
            found = self._find(kind.ros)
            fields = found.get_fields_and_field_types().items()
            self._octets[kind] = frozenset(name for name, ros_type in fields if ros_type == _OCTET)
            self._classes[kind] = found
        return self._classes[kind]

    def to_ros(self, message: Message) -> Any:
        """Convert a message.

        Args:
            message: The message.

        Returns:
            An object of its ROS 2 class.

        Raises:
            MissingTypeError: A package is not installed.
        """
        kind = type(message)
        ros_class, octets = self.class_of(kind), self._octets[kind]
        values: dict[str, Any] = {}
        for name in kind.__struct_fields__:
            value = getattr(message, name)
            values[name] = bytes([value]) if name in octets else self._value_to_ros(value)
        return ros_class(**values)

    def from_ros(self, ros: Any, kind: type[M]) -> M:
        """Convert an object of a ROS 2 class.

        Args:
            ros: The object.
            kind: Message type to convert it to; its fields that are messages have a default.

        Returns:
            The message.
        """
        values: dict[str, Any] = {}
        for name, default in zip(kind.__struct_fields__, kind.__struct_defaults__, strict=True):
            value = getattr(ros, name)
            if isinstance(default, Message):
                values[name] = self.from_ros(value, type(default))
            elif isinstance(default, tuple):
                values[name] = tuple(value)
            else:
                values[name] = value
        return kind(**values)

    def _value_to_ros(self, value: Any) -> Any:
        if isinstance(value, Message):
            return self.to_ros(value)
        if isinstance(value, tuple) and value and type(value[0]) is int:
            return array("B", value)  # bytes, which rclpy would check one by one in a list
        if isinstance(value, tuple):
            return [self._value_to_ros(one) for one in value]
        return value
