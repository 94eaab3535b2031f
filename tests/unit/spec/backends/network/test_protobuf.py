from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.backends.network.protobuf import floats, integers, parts, read_message, texts


def test_fields_of_each_wire_type_are_read() -> None:
    message = read_message(b"\x08\x96\x01" + b"\x12\x03abc" + b"\x1d\x00\x00\x80\x3f" + b"\x21" + bytes(8))
    assert integers(message, 1) == [150]
    assert texts(message, 2) == ["abc"]
    assert floats(message, 3) == [1.0]
    assert parts(message, 4) == [bytes(8)]
    assert integers(message, 9) == []


def test_negative_and_packed_integers_are_read() -> None:
    assert integers(read_message(b"\x08" + b"\xff" * 9 + b"\x01"), 1) == [-1]
    assert integers(read_message(b"\x0a\x03\x01\x96\x01"), 1) == [1, 150]


@pytest.mark.parametrize("content", [b"\x08", b"\x12\x05ab", b"\x0b", b"\x08" + b"\xff" * 11])
def test_bytes_that_end_early_are_refused(content: bytes) -> None:
    with pytest.raises(ValueError, match="it "):
        read_message(content)


@given(st.binary(max_size=60))
def test_any_bytes_are_read_or_refused(content: bytes) -> None:
    with suppress(ValueError):
        assert read_message(content) is not None
