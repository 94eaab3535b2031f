from __future__ import annotations

import math
import struct
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.backends.network.onnx_file import OnnxFileError, Tensor, read_onnx
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


def field(number: int, content: bytes) -> bytes:
    return bytes([number << 3 | 2, len(content)]) + content


def tensor(type_: int, *fields: bytes) -> Tensor:
    """Read a constant (5) of two numbers: its dims (1), data_type (2) and name (8), then its numbers."""
    content = b"\x08\x02" + bytes([0x10, type_]) + field(8, b"w") + b"".join(fields)
    return read_onnx(field(7, field(5, content))).constants["w"]


def test_numbers_are_read_of_each_type_packed_or_as_bytes() -> None:
    numbers = (0.5, -3.0)
    floats, doubles = struct.pack("<2f", *numbers), struct.pack("<2d", *numbers)
    assert tensor(1, field(4, floats)) == tensor(1, field(9, floats)) == Tensor((2,), numbers)
    assert tensor(11, field(10, doubles)) == tensor(11, field(9, doubles))
    assert tensor(11, field(9, doubles)) == Tensor((2,), numbers, is_double=True)
    whole = tensor(7, field(9, struct.pack("<2q", 7, -3)))
    assert (
        whole == tensor(7, field(7, b"\x07" + b"\xfd" + b"\xff" * 8 + b"\x01")) == Tensor((2,), (7.0, -3.0))
    )
    assert tensor(10).numbers == (), "a type that no bound is proved of"
    with pytest.raises(OnnxFileError, match=r"`w` has 1 numbers, which do not fill its shape \(2,\)"):
        tensor(1, field(4, floats[:4]))


@pytest.mark.parametrize(("domain", "name"), [("", "Relu"), ("ai.onnx", "Relu"), ("ms", "ms.Relu")])
def test_an_operator_of_another_domain_has_its_name(domain: str, name: str) -> None:
    node = field(1, b"x") + field(2, b"y") + field(4, b"Relu") + field(7, domain.encode())
    (found,) = read_onnx(field(7, field(1, node))).nodes
    assert (found.operator, found.inputs, found.outputs) == (name, ("x",), ("y",))


def test_attributes_are_numbers_lists_or_constants() -> None:
    ends = struct.pack("<f", 2.5)
    constant = b"\x10\x01" + field(8, b"w") + field(9, ends)
    written = {
        "alpha": (b"\x15" + ends, 2.5),
        "axis": (b"\x18" + b"\xff" * 9 + b"\x01", -1.0),
        "value": (field(5, constant), Tensor((), (2.5,))),
        "shape": (field(8, b"\x03\x04"), (3, 4)),
    }
    attributes = b"".join(field(5, field(1, name.encode()) + one) for name, (one, _) in written.items())
    (found,) = read_onnx(field(7, field(1, field(4, b"Gemm") + attributes))).nodes
    assert found.attributes == {name: expected for name, (_, expected) in written.items()}


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
