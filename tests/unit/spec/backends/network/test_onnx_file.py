from __future__ import annotations

import math
import struct
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.backends.network.onnx_file import OnnxFileError, read_onnx
from tests.unit.spec.backends.network.networks import TENT, content_of


def test_a_graph_is_read_as_it_was_written() -> None:
    graph = read_onnx(content_of(TENT))
    assert [node.operator for node in graph.nodes] == ["Gemm", "Relu", "Gemm"]
    assert graph.constants["w1"].numbers == (1.0, -2.0)
    assert graph.constants["w1"].shape == (1, 2)
    assert graph.nodes[0].attributes == {"transB": 1.0}
    assert list(graph.inputs) == ["x"]
    assert graph.outputs["y"].dimensions == (1, 1)
    assert graph.outputs["y"].is_number


@pytest.mark.parametrize("content", [b"", b"\x08\x08", b"no network at all", content_of(TENT)[:-40]])
def test_other_bytes_are_refused(content: bytes) -> None:
    with pytest.raises(OnnxFileError, match="it "):
        read_onnx(content)


def test_numbers_in_another_file_are_refused() -> None:
    # TensorProto with a name (8) and data_location (14) EXTERNAL, as the initializer (5) of a graph (7)
    tensor = b"\x10\x01\x42\x01w\x70\x01"
    graph = b"\x2a" + bytes([len(tensor)]) + tensor
    with pytest.raises(OnnxFileError, match="another file, which no certificate covers"):
        read_onnx(b"\x3a" + bytes([len(graph)]) + graph)


@pytest.mark.parametrize(("number", "is_refused"), [(math.nan, True), (math.inf, False)])
def test_weights_that_are_no_numbers_are_refused(number: float, is_refused: bool) -> None:
    content = content_of(TENT)
    assert content.count(struct.pack("<f", -2.0)) == 1
    changed = content.replace(struct.pack("<f", -2.0), struct.pack("<f", number))
    if is_refused:
        with pytest.raises(OnnxFileError, match=r"`w1` holds what is not a number \(NaN\)"):
            read_onnx(changed)
    else:
        assert read_onnx(changed).constants["w1"].numbers == (1.0, math.inf)


@given(st.integers(0, len(content_of(TENT)) - 1), st.integers(0, 255))
def test_a_changed_byte_is_read_or_refused(at: int, byte: int) -> None:
    content = bytearray(content_of(TENT))
    content[at] = byte
    with suppress(OnnxFileError):
        assert read_onnx(bytes(content)) is not None
