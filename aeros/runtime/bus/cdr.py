"""ROS 2's own encoding of messages (CDR), and the definitions of their types.

With `bag.py` the only importer of `rosbags`, which the extra `ros` provides.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final, get_args, get_type_hints

import numpy as np
from msgspec.structs import replace
from rosbags.interfaces.typing import Typesdict
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from aeros.runtime.bus.messages import Message, Time

_PACKAGES: Final = ("aeros_msgs", "foxglove_msgs")
"""Message packages that ROS 2 Humble does not bring."""

_ROS2: Final = 2

_NUMPY_TYPES: Final[dict[Any, type[np.float64 | np.uint8]]] = {
    tuple[float, ...]: np.float64,
    tuple[int, ...]: np.uint8,
}


class CdrEncoder:
    """Encoder of messages; it knows the types of ROS 2 Humble, of `aeros_msgs` and of `foxglove_msgs`.

    Attributes:
        store: the types.
    """

    def __init__(self) -> None:
        self.store = get_typestore(Stores.ROS2_HUMBLE)
        for package in _PACKAGES:
            found: Typesdict = {}
            for path in sorted((Path(__file__).parent / package / "msg").glob("*.msg")):
                text = path.read_text(encoding="utf-8")
                found |= get_types_from_msg(text, f"{package}/msg/{path.stem}")
            self.store.register(found)

    def encode(self, message: Message) -> memoryview:
        """Encode a message.

        Args:
            message: the message.

        Returns:
            Its CDR encoding.
        """
        return self.store.serialize_cdr(_to_numpy_fields(message), message.ros)

    def definition(self, kind: type[Message]) -> str:
        """Return the definition of a type and of all types in it.

        Args:
            kind: type of the messages.

        Returns:
            Text in the form of ROS 2's `.msg` files, joined as MCAP and Foxglove expect it.
        """
        text, _ = self.store.generate_msgdef(kind.ros, ros_version=_ROS2)
        return text


def _to_numpy_fields(message: Message) -> Message:
    """Return `message` for `rosbags`, which reads fields of any object: number sequences as NumPy arrays."""
    changed = {
        name: _to_numpy(getattr(message, name), kind)
        for name, kind in _fields_with_numbers(type(message)).items()
    }
    return replace(message, **changed) if changed else message


def _to_numpy(value: Any, kind: Any) -> Any:
    if kind is bytes:
        return np.frombuffer(value, np.uint8)
    if kind in _NUMPY_TYPES:
        return np.array(value, _NUMPY_TYPES[kind])
    return tuple(map(_to_numpy_fields, value)) if isinstance(value, tuple) else _to_numpy_fields(value)


@cache
def _fields_with_numbers(kind: type[Message]) -> dict[str, Any]:
    """Return the types of the fields that are sequences of numbers, or messages with such fields."""
    hints = get_type_hints(kind)
    kinds = {name: hints[name] for name in kind.__struct_fields__}
    return {name: one for name, one in kinds.items() if _has_numbers(one)}


def _has_numbers(kind: Any) -> bool:
    if kind is bytes or kind in _NUMPY_TYPES:
        return True
    parts = (kind, *get_args(kind))
    return any(
        bool(_fields_with_numbers(one)) for one in parts if isinstance(one, type) and issubclass(one, Message)
    )


def plant_nanoseconds(message: Message) -> int:
    """Return the first time stamp in a message.

    A late sensor's first value is older than the clock, and no file has negative times.

    Args:
        message: the message.

    Returns:
        Nanoseconds on the plant's clock, at least 0; 0 if the message has no stamp.
    """
    when = next(_stamps(message), Time())
    return max(0, when.sec * 10**9 + when.nanosec)


def _stamps(value: Any) -> Iterator[Time]:
    if isinstance(value, Time):
        yield value
    elif isinstance(value, Message):
        for name in value.__struct_fields__:
            yield from _stamps(getattr(value, name))
    elif isinstance(value, tuple):
        for part in value:
            yield from _stamps(part)
