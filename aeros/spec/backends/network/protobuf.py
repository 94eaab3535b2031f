"""Reader of the protocol buffers' wire format, as far as ONNX files use it; needs no library.

    message := (key value)*        key = field number * 8 + wire type, as a varint
    wire type 0: varint; 1: 8 bytes; 2: a length and as many bytes; 5: 4 bytes

Source: protobuf.dev, Encoding.
"""

from __future__ import annotations

import struct
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

Message = Mapping[int, Sequence[int | bytes]]
"""Values of each field in order, by field number: integers, and bytes for the other wire types."""

_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_MAX_VARINT_BYTES: Final = 10


def read_message(content: bytes) -> Message:
    """Read one message.

    Args:
        content: its bytes.

    Returns:
        Its fields.

    Raises:
        ValueError: the bytes are no message.
    """
    fields: dict[int, list[int | bytes]] = defaultdict(list)
    position = 0
    while position < len(content):
        key, position = _varint(content, position)
        number, wire = key >> 3, key & 7
        if wire == _VARINT:
            value, position = _varint(content, position)
            fields[number].append(value)
            continue
        if wire == _BYTES:
            length, position = _varint(content, position)
        else:
            length = {_FIXED64: 8, _FIXED32: 4}.get(wire, -1)
        if length < 0 or position + length > len(content):
            raise ValueError("it ends in the middle of a field, or has a field of an unknown form")
        fields[number].append(content[position : position + length])
        position += length
    return fields


def texts(message: Message, field: int) -> list[str]:
    """Read a field of texts.

    Args:
        message: the message.
        field: number of the field.

    Returns:
        The texts in order.

    Raises:
        ValueError: one is no text.
    """
    return [part.decode() for part in parts(message, field)]


def parts(message: Message, field: int) -> list[bytes]:
    """Read a field of bytes or messages.

    Args:
        message: the message.
        field: number of the field.

    Returns:
        The bytes of each in order.

    Raises:
        ValueError: the field holds integers.
    """
    found = [value for value in message.get(field, ()) if isinstance(value, bytes)]
    if len(found) != len(message.get(field, ())):
        raise ValueError(f"field {field} holds an integer")
    return found


def integers(message: Message, field: int) -> list[int]:
    """Read a field of signed 64-bit integers, packed or not.

    Args:
        message: the message.
        field: number of the field.

    Returns:
        The integers in order.

    Raises:
        ValueError: a packed part ends in the middle of an integer.
    """
    return [one for value in message.get(field, ()) for one in _signed(value)]


def floats(message: Message, field: int, code: str = "f") -> list[float]:
    """Read a field of floating-point numbers, packed or not.

    Args:
        message: the message.
        field: number of the field.
        code: `f` for 4 bytes each, `d` for 8.

    Returns:
        The numbers in order.

    Raises:
        ValueError: a part holds no whole number of them.
    """
    size = struct.calcsize(code)
    numbers: list[float] = []
    for part in parts(message, field):
        if len(part) % size:
            raise ValueError(f"field {field} ends in the middle of a number")
        numbers += struct.unpack(f"<{len(part) // size}{code}", part)
    return numbers


def _varint(content: bytes, position: int) -> tuple[int, int]:
    value = 0
    for shift in range(_MAX_VARINT_BYTES):
        if position >= len(content):
            raise ValueError("it ends in the middle of a number")
        byte = content[position]
        position += 1
        value |= (byte & 0x7F) << (7 * shift)
        if byte < 0x80:
            return value, position
    raise ValueError("it holds a number of more than 64 bits")


def _signed(value: int | bytes) -> Iterator[int]:
    if isinstance(value, int):
        yield value - (1 << 64) if value >= 1 << 63 else value
        return
    position = 0
    while position < len(value):
        one, position = _varint(value, position)
        yield one - (1 << 64) if one >= 1 << 63 else one
