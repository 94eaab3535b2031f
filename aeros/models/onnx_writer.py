"""Writer of small networks in ONNX format, for networks that were trained in NumPy; needs no library.

Layers are written one after the other: `Gemm` with constant weights, then `Relu`, `Tanh` or `Clip`.
Source: onnx/onnx.proto of ONNX 1.23, and protobuf.dev, Encoding.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

_IR_VERSION: Final = 8
_OPSET: Final = 17
_FLOAT: Final = 1
_INTEGER_ATTRIBUTE: Final = 2


@dataclass(frozen=True)
class Layer:
    """Fully connected layer: activation(weights · x + bias).

    Attributes:
        weights: a row for each of its outputs.
        bias: a number for each of its outputs.
        activation: `Relu`, `Tanh`, or empty for none.
        clip: least and greatest value of its outputs; None for no limit.
    """

    weights: Sequence[Sequence[float]]
    bias: Sequence[float]
    activation: str = ""
    clip: tuple[float, float] | None = None


def write_onnx(name: str, inputs: tuple[str, int], output: str, layers: Sequence[Layer]) -> bytes:
    """Write a network. The same layers give the same bytes.

    Args:
        name: name of the graph.
        inputs: name of the input, and the number of its components.
        output: name of the output.
        layers: the layers in order, with numbers that float32 holds.

    Returns:
        Bytes of an ONNX file, with numbers of float32 and a batch of one row.
    """
    nodes: list[bytes] = []
    constants: list[bytes] = []
    value = inputs[0]
    for number, layer in enumerate(layers):
        last = number == len(layers) - 1
        steps = ["Gemm", *([layer.activation] if layer.activation else []), *(["Clip"] if layer.clip else [])]
        constants += [
            _tensor(
                f"w{number}",
                (len(layer.weights), len(layer.weights[0])),
                [one for row in layer.weights for one in row],
            ),
            _tensor(f"b{number}", (len(layer.bias),), layer.bias),
        ]
        for step in steps:
            result = output if last and step == steps[-1] else f"{step.lower()}{number}"
            sources = [value]
            if step == "Gemm":
                sources += [f"w{number}", f"b{number}"]
            elif step == "Clip" and layer.clip is not None:
                sources += [f"low{number}", f"high{number}"]
                low, high = layer.clip
                constants += [_tensor(f"low{number}", (), [low]), _tensor(f"high{number}", (), [high])]
            nodes.append(_node(step, sources, result))
            value = result
    graph = b"".join(
        [
            *(_bytes(1, node) for node in nodes),
            _bytes(2, name.encode()),
            *(_bytes(5, constant) for constant in constants),
            _bytes(11, _value(*inputs)),
            _bytes(12, _value(output, len(layers[-1].bias))),
        ]
    )
    return _integer(1, _IR_VERSION) + _bytes(7, graph) + _bytes(8, _integer(2, _OPSET))


def _node(operator: str, inputs: Iterable[str], output: str) -> bytes:
    parts = [_bytes(1, name.encode()) for name in inputs]
    parts += [_bytes(2, output.encode()), _bytes(3, output.encode()), _bytes(4, operator.encode())]
    if operator == "Gemm":  # rows of the weights are outputs
        attribute = _bytes(1, b"transB") + _integer(3, 1) + _integer(20, _INTEGER_ATTRIBUTE)
        parts.append(_bytes(5, attribute))
    return b"".join(parts)


def _tensor(name: str, shape: Iterable[int], numbers: Sequence[float]) -> bytes:
    raw = struct.pack(f"<{len(numbers)}f", *numbers)
    dimensions = b"".join(_integer(1, size) for size in shape)
    return dimensions + _integer(2, _FLOAT) + _bytes(8, name.encode()) + _bytes(9, raw)


def _value(name: str, size: int) -> bytes:
    shape = b"".join(_bytes(1, _integer(1, dimension)) for dimension in (1, size))
    return _bytes(1, name.encode()) + _bytes(2, _bytes(1, _integer(1, _FLOAT) + _bytes(2, shape)))


def _integer(field: int, value: int) -> bytes:
    return _varint(field << 3) + _varint(value)


def _bytes(field: int, content: bytes) -> bytes:
    return _varint(field << 3 | 2) + _varint(len(content)) + content


def _varint(value: int) -> bytes:
    encoded = bytearray()
    while value > 0x7F:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*encoded, value])
