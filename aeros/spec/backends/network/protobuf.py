"""Reader of the protocol buffers' wire format, as far as ONNX files use it; needs no library.

    message := (key value)*        key = field number * 8 + wire type, as a varint
    wire type 0: varint; 1: 8 bytes; 2: a length and as many bytes; 5: 4 bytes

Other readers take the last of several values of a field that holds one, and skip values of a wrong wire type.
So both are refused here: a file has one meaning or none.

Source: protobuf.dev, Encoding.
"""

from __future__ import annotations

import struct
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Final, TypeVar


class Fixed(bytes):
    """Number of 4 or 8 bytes, as against bytes that are written with their length."""


Message = Mapping[int, Sequence[int | bytes]]
"""Values of each field in order, by field number: integers, and bytes or `Fixed` for the other wire types."""

_VARINT, _BYTES = 0, 2
_FIXED_BYTES: Final = {1: 8, 5: 4}
"""Length of the values of other wire types, bytes."""

_T = TypeVar("_T")
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
        elif wire in _FIXED_BYTES:
            length = _FIXED_BYTES[wire]
        else:
            raise ValueError("it has a field of an unknown form")
        value_bytes = content[position : position + length]
        if len(value_bytes) < length:
            raise ValueError("it ends in the middle of a field")
        fields[number].append(value_bytes if wire == _BYTES else Fixed(value_bytes))
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


def text(message: Message, field: int) -> str:
    """Read a field of one text.

    Args:
        message: the message.
        field: number of the field.

    Returns:
        The text; empty if the field is left out.

    Raises:
        ValueError: it is no text, or there are several.
    """
    return _only(texts(message, field), "", field)


def parts(message: Message, field: int) -> list[bytes]:
    """Read a field of bytes or messages.

    Args:
        message: the message.
        field: number of the field.

    Returns:
        The bytes of each in order.

    Raises:
        ValueError: the field holds numbers.
    """
    found = [value for value in message.get(field, ()) if type(value) is bytes]
    if len(found) != len(message.get(field, ())):
        raise ValueError(f"field {field} holds a number")
    return found


def part(message: Message, field: int) -> bytes:
    """Read a field of bytes or of one message.

    Args:
        message: the message.
        field: number of the field.

    Returns:
        The bytes; none if the field is left out.

    Raises:
        ValueError: the field holds a number, or there are several.
    """
    return _only(parts(message, field), b"", field)


def integers(message: Message, field: int) -> list[int]:
    """Read a field of signed 64-bit integers, packed or not.

    Args:
        message: the message.
        field: number of the field.

    Returns:
        The integers in order.

    Raises:
        ValueError: a packed part ends in the middle of an integer, or the field holds other numbers.
    """
    values = message.get(field, ())
    if any(isinstance(value, Fixed) for value in values):
        raise ValueError(f"field {field} holds no integer")
    return [one for value in values for one in _signed(value)]


def integer(message: Message, field: int, default: int = 0) -> int:
    """Read a field of one signed 64-bit integer.

    Args:
        message: the message.
        field: number of the field.
        default: its value if it is left out.

    Returns:
        The integer.

    Raises:
        ValueError: the field holds something else, or there are several.
    """
    value = _only(message.get(field, ()), default, field)
    if not isinstance(value, int):
        raise ValueError(f"field {field} holds no integer")  # noqa: TRY004 - the file is wrong
    return _to_signed(value)


def floats(message: Message, field: int, code: str = "f") -> list[float]:
    """Read a field of floating-point numbers, packed or not.

    Args:
        message: the message.
        field: number of the field.
        code: `f` for 4 bytes each, `d` for 8.

    Returns:
        The numbers in order.

    Raises:
        ValueError: a part holds no whole number of them, or the field holds other numbers.
    """
    size = struct.calcsize(code)
    numbers: list[float] = []
    for value in message.get(field, ()):
        if isinstance(value, int) or (isinstance(value, Fixed) and len(value) != size):
            raise ValueError(f"field {field} holds a number of another form")
        if len(value) % size:
            raise ValueError(f"field {field} ends in the middle of a number")
        numbers += struct.unpack(f"<{len(value) // size}{code}", value)
    return numbers


def single_float(message: Message, field: int) -> float:
    """Read a field of one number of 4 bytes.

    Args:
        message: the message, with the field.
        field: number of the field.

    Returns:
        The number.

    Raises:
        ValueError: the field holds something else, or there are several.
    """
    value = _only(message[field], 0, field)
    if not isinstance(value, Fixed):
        raise ValueError(f"field {field} holds no number of 4 bytes")  # noqa: TRY004 - the file is wrong
    return floats({field: [value]}, field)[0]


def _only(values: Sequence[_T], default: _T, field: int) -> _T:
    if len(values) > 1:
        raise ValueError(f"field {field} holds one value and is written {len(values)} times")
    return values[0] if values else default


def _varint(content: bytes, position: int) -> tuple[int, int]:
    value = 0
    for shift in range(_MAX_VARINT_BYTES):
        if position >= len(content):
            raise ValueError("it ends in the middle of a number")
        byte = content[position]
        position += 1
        value |= (byte & 0x7F) << (7 * shift)
        if byte < 0x80 and value < 1 << 64:
            return value, position
    raise ValueError("it holds a number of more than 64 bits")


def _signed(value: int | bytes) -> Iterator[int]:
    if isinstance(value, int):
        yield _to_signed(value)
        return
    position = 0
    while position < len(value):
        one, position = _varint(value, position)
        yield _to_signed(one)


def _to_signed(value: int) -> int:
    return value - (1 << 64) if value >= 1 << 63 else value
