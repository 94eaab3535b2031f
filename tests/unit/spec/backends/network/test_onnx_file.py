from __future__ import annotations

import math
import random
import struct
from collections.abc import Callable
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.models.interface import ModelFileError, ValueInterface
from aeros.models.onnx_session import OnnxSession
from aeros.spec.backends.network.box_propagation import propagate
from aeros.spec.backends.network.onnx_file import OnnxFileError, Tensor, ValueShape, read_onnx
from aeros.spec.backends.network.steps import UnsupportedNetworkError, translate
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


_NO_GRAPH = "it holds no graph, so it is no ONNX file"


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        (b"", _NO_GRAPH),
        (b"\x08\x08", _NO_GRAPH),
        (b"no network at all", "it is no well-formed ONNX file: it has a field of an unknown form"),
        (content_of(TENT)[:-40], "it is no well-formed ONNX file: it ends in the middle of a field"),
    ],
)
def test_other_bytes_are_refused(content: bytes, cause: str) -> None:
    with pytest.raises(OnnxFileError, match=f"^{cause}$"):
        read_onnx(content)


def test_numbers_in_another_file_are_refused() -> None:
    # TensorProto with a name (8) and data_location (14) EXTERNAL, as the initializer (5) of a graph (7)
    tensor = b"\x10\x01\x42\x01w\x70\x01"
    graph = b"\x2a" + bytes([len(tensor)]) + tensor
    with pytest.raises(OnnxFileError, match="another file, which no certificate covers"):
        read_onnx(b"\x3a" + bytes([len(graph)]) + graph)


def field(number: int, content: bytes) -> bytes:
    return varint(number << 3 | 2) + varint(len(content)) + content


def varint(value: int) -> bytes:
    return bytes([value & 0x7F | 0x80]) + varint(value >> 7) if value > 0x7F else bytes([value])


def whole(number: int, value: int) -> bytes:
    return varint(number << 3) + varint(value)


def single(number: int, value: float) -> bytes:
    return varint(number << 3 | 5) + struct.pack("<f", value)


def named(name: str, rest: bytes = b"") -> bytes:
    """An input or output: name (1), type (2), of a tensor (1), with its element (1) and shape (2)."""
    shape = field(2, field(1, whole(1, 1)) * 2)
    return field(1, name.encode()) + field(2, field(1, whole(1, 1) + shape + rest))


def one_product(
    *,
    tensor: bytes = b"",
    attribute: bytes = b"",
    node: bytes = b"",
    graph: bytes = b"",
    model: bytes = b"",
    value: bytes = b"",
) -> bytes:
    """A file of the network y = 2 x, with more fields in a message of each kind."""
    weights = whole(1, 1) * 2 + whole(2, 1) + field(8, b"w") + field(9, struct.pack("<f", 2.0))
    scale = field(1, b"alpha") + single(2, 1.0) + whole(20, 1)
    product = field(1, b"x") + field(1, b"w") + field(2, b"y") + field(4, b"Gemm")
    content = (
        field(1, product + field(5, scale + attribute) + node)
        + field(2, b"g")
        + field(5, weights + tensor)
        + field(11, named("x", value))
        + field(12, named("y"))
    )
    return whole(1, 8) + field(7, content + graph) + field(8, whole(2, 17)) + model


_FIVE = struct.pack("<f", 5.0)
_OTHER = whole(1, 1) * 2 + whole(2, 1) + field(8, b"w") + field(9, _FIVE)
_TWICE = r"field {} holds one value and is written 2 times$"


@pytest.mark.parametrize(
    ("more", "cause"),
    [
        ({"tensor": field(9, _FIVE)}, _TWICE.format(9)),
        ({"tensor": field(8, b"v")}, _TWICE.format(8)),
        ({"tensor": whole(2, 7)}, _TWICE.format(2)),
        ({"tensor": whole(14, (1 << 32) + 1)}, r"^the numbers of `w` are in another file"),
        ({"attribute": single(2, 7.0)}, _TWICE.format(2)),
        ({"attribute": field(2, _FIVE)}, _TWICE.format(2)),
        ({"attribute": whole(3, 7)}, r"^the attribute `alpha` has values of several types$"),
        ({"attribute": field(5, _OTHER)}, r"^the attribute `alpha` has values of several types$"),
        ({"attribute": field(8, b"")}, r"^the attribute `alpha` has values of several types$"),
        ({"attribute": field(1, b"beta")}, _TWICE.format(1)),
        ({"node": field(5, field(1, b"alpha") + single(2, 7.0))}, r"^it defines `alpha` twice$"),
        ({"node": field(5, field(1, b"beta") + field(2, _FIVE))}, r"field 2 holds no number of 4 bytes$"),
        ({"node": field(5, field(1, b"transB") + field(3, b"\x01"))}, r"field 3 holds no integer$"),
        ({"node": field(4, b"MatMul")}, _TWICE.format(4)),
        ({"node": field(7, b"a") * 2}, _TWICE.format(7)),
        ({"graph": field(5, _OTHER)}, r"^it defines `w` twice$"),
        ({"graph": field(11, named("x"))}, r"^it defines `x` twice$"),
        ({"graph": field(12, named("y"))}, r"^it defines `y` twice$"),
        ({"graph": field(15, b"")}, r"^it holds functions or sparse constants"),
        ({"model": field(25, b"")}, r"^it holds functions or sparse constants"),
        ({"model": field(7, b"")}, _TWICE.format(7)),
        ({"value": whole(1, 11)}, _TWICE.format(1)),
        ({"value": field(2, b"")}, _TWICE.format(2)),
    ],
)
def test_a_file_that_other_readers_may_read_otherwise_is_refused(more: dict[str, bytes], cause: str) -> None:
    assert read_onnx(one_product()).constants["w"] == Tensor((1, 1), (2.0,))
    with pytest.raises(OnnxFileError, match=cause):
        read_onnx(one_product(**more))


_PAYLOADS = (
    *(varint(one) for one in (0, 1, 2, 7, 11, (1 << 32) + 1, (1 << 64) - 1)),
    b"\x80" * 9 + b"\x02",
    *(varint(len(one)) + one for one in (b"", b"w", b"x", b"alpha", b"Relu", b"\x01\x01", _FIVE, _OTHER)),
    _FIVE,
    struct.pack("<d", 5.0),
)


def _with_one_more_field(draw: random.Random) -> bytes:
    message = draw.choice(("tensor", "attribute", "node", "graph", "model", "value"))
    key = varint(draw.randint(1, 25) << 3 | draw.choice((0, 1, 2, 5)))
    return one_product(**{message: key + draw.choice(_PAYLOADS)})


def _with_other_bytes(draw: random.Random) -> bytes:
    content = bytearray(one_product())
    content[draw.randrange(len(content))] = draw.choice((0, 1, 2, 7, 15, 63, 64, 128, 255))
    return bytes(content)


@pytest.mark.parametrize("change", [_with_one_more_field, _with_other_bytes])
@pytest.mark.parametrize("count", [300, pytest.param(20_000, marks=pytest.mark.deep)])
def test_onnxruntime_gives_a_file_that_is_read_the_same_meaning(
    change: Callable[[random.Random], bytes], count: int
) -> None:
    """Whatever field is added, and whatever byte is changed, the output is in its proved bounds."""
    draw, judged = random.Random(count), 0  # noqa: S311 - no secrets
    ends = {"x": ValueInterface((1,), 1.0, "1", -9, 9)}, {"y": ValueInterface((1,), 1.0, "1", -9, 9)}
    for _ in range(count):
        content = change(draw)
        try:
            network = translate(read_onnx(content), {"x": 1})
            found = OnnxSession("n.onnx", content, *ends).evaluate({"x": (1.5,)})["y"]
        except (OnnxFileError, UnsupportedNetworkError, ModelFileError):
            continue
        (low,), (high,) = propagate(network, {"x": ([1.5], [1.5])})["y"]
        assert low <= found[0] <= high, content
        judged += 1
    assert judged > count // 10


def tensor(type_: int, *fields: bytes) -> Tensor:
    """Read a constant (5) of two numbers: its dims (1), data_type (2) and name (8), then its numbers."""
    content = whole(1, 2) + whole(2, type_) + field(8, b"w") + b"".join(fields)
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


def test_an_open_dimension_and_a_missing_type_are_read_as_such() -> None:
    dimensions = field(1, whole(1, 3)) + field(1, field(2, b"batch")) + field(1, whole(1, 0))
    values = {
        b"x": field(2, field(1, whole(1, 11) + field(2, dimensions))),
        b"s": field(2, field(1, whole(1, 8))),
        b"m": b"",
    }
    inputs = b"".join(field(11, field(1, name) + type_) for name, type_ in values.items())
    found = read_onnx(field(7, inputs)).inputs
    assert found == {"x": ValueShape(11, (3, None, 0)), "s": ValueShape(8, ()), "m": ValueShape(0, ())}
    assert [one.is_number for one in found.values()] == [True, False, False]
