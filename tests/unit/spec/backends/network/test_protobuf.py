from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.backends.network.protobuf import (
    Message,
    floats,
    integer,
    integers,
    part,
    parts,
    read_message,
    single_float,
    text,
    texts,
)

_ONE = b"\x1d\x00\x00\x80\x3f"
"""Field 3, a number of 4 bytes that is 1."""


def test_fields_of_each_wire_type_are_read() -> None:
    message = read_message(b"\x08\x96\x01" + b"\x12\x03abc" + _ONE + b"\x21" + bytes(6) + b"\xf0\x3f")
    assert integers(message, 1) == [150]
    assert texts(message, 2) == ["abc"]
    assert floats(message, 3) == [1.0]
    assert floats(message, 4, "d") == [1.0]
    assert parts(message, 2) == [b"abc"]
    assert (integer(message, 1), text(message, 2), part(message, 2)) == (150, "abc", b"abc")
    assert single_float(message, 3) == 1.0


def test_a_field_that_is_left_out_is_empty() -> None:
    message = read_message(b"")
    assert (integers(message, 1), texts(message, 1), parts(message, 1), floats(message, 1)) == (
        [],
        [],
        [],
        [],
    )
    assert (integer(message, 1), integer(message, 1, 7), text(message, 1), part(message, 1)) == (
        0,
        7,
        "",
        b"",
    )


def test_negative_and_packed_integers_are_read() -> None:
    negative = read_message(b"\x08" + b"\xff" * 9 + b"\x01")
    assert (integers(negative, 1), integer(negative, 1)) == ([-1], -1)
    least = read_message(b"\x08" + b"\x80" * 9 + b"\x01")
    assert integer(least, 1) == -(2**63)
    assert integer(read_message(b"\x08" + b"\xff" * 8 + b"\x7f"), 1) == 2**63 - 1
    packed = read_message(b"\x0a\x03\x01\x96\x01" + b"\x08\x05" + b"\x0a\x0b\x02" + b"\xff" * 9 + b"\x01")
    assert integers(packed, 1) == [1, 150, 5, 2, -1]
    numbers = read_message(_ONE + b"\x1a\x08" + _ONE[1:] * 2)
    assert floats(numbers, 3) == [1.0, 1.0, 1.0]


_SHORT, _UNKNOWN = "it ends in the middle of a field", "it has a field of an unknown form"
_LONG, _CUT = "it holds a number of more than 64 bits", "it ends in the middle of a number"


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        (b"\x08", _CUT),
        (b"\x08\x96", _CUT),
        (b"\x12\x05ab", _SHORT),
        (b"\x1d\x00\x00\x80", _SHORT),
        (b"\x21" + bytes(7), _SHORT),
        (b"\x0b", _UNKNOWN),
        (b"\x0c", _UNKNOWN),
        (b"\x0e", _UNKNOWN),
        (b"\x08" + b"\xff" * 11, _LONG),
        (b"\x08" + b"\x80" * 9 + b"\x02", _LONG),
        (b"\x08" + b"\x80" * 10 + b"\x01", _LONG),
    ],
)
def test_bytes_that_end_early_or_are_of_another_form_are_refused(content: bytes, cause: str) -> None:
    with pytest.raises(ValueError, match=f"^{cause}$"):
        read_message(content)


_SEVERAL = "field {} holds one value and is written 2 times"


@pytest.mark.parametrize(
    ("read", "content", "cause"),
    [
        (parts, b"\x08\x01", "field 1 holds a number"),
        (texts, b"\x0a\x00" + b"\x08\x01", "field 1 holds a number"),
        (parts, b"\x0d" + bytes(4), "field 1 holds a number"),
        (text, b"\x09" + bytes(8), "field 1 holds a number"),
        (text, b"\x0a\x01a" * 2, _SEVERAL.format(1)),
        (part, b"\x0a\x01a" * 2, _SEVERAL.format(1)),
        (integers, b"\x0d" + bytes(4), "field 1 holds no integer"),
        (integers, b"\x0a\x02\x01\x96", _CUT),
        (integer, b"\x08\x01" * 2, _SEVERAL.format(1)),
        (integer, b"\x0a\x01\x01", "field 1 holds no integer"),
        (integer, b"\x0d" + bytes(4), "field 1 holds no integer"),
        (floats, b"\x08\x01", "field 1 holds a number of another form"),
        (floats, b"\x09" + bytes(8), "field 1 holds a number of another form"),
        (floats, b"\x0a\x05" + bytes(5), "field 1 ends in the middle of a number"),
        (single_float, (b"\x0d" + bytes(4)) * 2, _SEVERAL.format(1)),
        (single_float, b"\x09" + bytes(8), "field 1 holds a number of another form"),
        (single_float, b"\x0a\x04" + bytes(4), "field 1 holds no number of 4 bytes"),
        (single_float, b"\x08\x01", "field 1 holds no number of 4 bytes"),
    ],
)
def test_a_field_has_one_meaning_or_none(
    read: Callable[[Message, int], object], content: bytes, cause: str
) -> None:
    with pytest.raises(ValueError, match=f"^{cause}$"):
        read(read_message(content), 1)


@given(st.binary(max_size=60))
def test_any_bytes_are_read_or_refused(content: bytes) -> None:
    with suppress(ValueError):
        assert read_message(content) is not None
