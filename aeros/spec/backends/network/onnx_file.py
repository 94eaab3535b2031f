"""Graph of an ONNX file: nodes, constants, inputs and outputs, as they are written.

Source: onnx/onnx.proto of ONNX 1.23. Field numbers are quoted where they are read.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import isnan, prod
from typing import Final, TypeVar

from aeros.spec.backends.network.protobuf import (
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

_FLOAT: Final = 1
_INT64: Final = 7
_DOUBLE: Final = 11
_T = TypeVar("_T")


class OnnxFileError(ValueError):
    """The bytes are no ONNX file that can be read; the message says why."""


@dataclass(frozen=True)
class Tensor:
    """A constant.

    Attributes:
        shape: its dimensions.
        numbers: its numbers, the last dimension fastest.
        is_double: True for 64-bit floating-point numbers.
    """

    shape: tuple[int, ...]
    numbers: tuple[float, ...]
    is_double: bool = False


@dataclass(frozen=True)
class Operation:
    """One operation.

    Attributes:
        operator: name of the operator, with its domain in front if it is not ONNX's own.
        inputs: names of the values that it takes; empty for one that is left out.
        outputs: names of the values that it makes.
        attributes: its attributes: a number, a tuple of integers, or a constant.
    """

    operator: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    attributes: Mapping[str, float | tuple[int, ...] | Tensor]


@dataclass(frozen=True)
class ValueShape:
    """Type of an input or output of the graph.

    Attributes:
        element: number of the element type in ONNX; 1 is float32, 11 is float64.
        dimensions: its dimensions; None for one that is open.
    """

    element: int
    dimensions: tuple[int | None, ...]

    @property
    def is_number(self) -> bool:
        """Tell whether its elements are floating-point numbers of 32 or 64 bits."""
        return self.element in (_FLOAT, _DOUBLE)


@dataclass(frozen=True)
class OnnxGraph:
    """The graph of a file.

    Attributes:
        nodes: operations in the order of the file, in which each follows what it takes.
        constants: constants by name.
        inputs: inputs by name, without constants.
        outputs: outputs by name.
    """

    nodes: tuple[Operation, ...]
    constants: Mapping[str, Tensor]
    inputs: Mapping[str, ValueShape]
    outputs: Mapping[str, ValueShape]


def read_onnx(content: bytes) -> OnnxGraph:
    """Read the graph of an ONNX file.

    Args:
        content: bytes of the file.

    Returns:
        The graph.

    Raises:
        OnnxFileError: the bytes are no ONNX file, it has no graph, its numbers are in other files, or another
            reader may give it another meaning.
    """
    try:
        model = read_message(content)
        if not model.get(7):  # ModelProto.graph
            raise OnnxFileError("it holds no graph, so it is no ONNX file")  # noqa: TRY301
        graph = read_message(part(model, 7))
        if model.get(25) or graph.get(15):  # ModelProto.functions, GraphProto.sparse_initializer
            raise OnnxFileError("it holds functions or sparse constants, which no bound is proved of")  # noqa: TRY301
        constants = _by_name(map(_named_tensor, parts(graph, 5)))  # GraphProto.initializer
        inputs = _by_name(map(_value, parts(graph, 11)))  # GraphProto.input
        return OnnxGraph(
            tuple(map(_node, parts(graph, 1))),  # GraphProto.node
            constants,
            {name: shape for name, shape in inputs.items() if name not in constants},
            _by_name(map(_value, parts(graph, 12))),  # GraphProto.output
        )
    except OnnxFileError:
        raise
    except (ValueError, struct.error) as error:
        raise OnnxFileError(f"it is no well-formed ONNX file: {error}") from error


def _by_name(named: Iterable[tuple[str, _T]]) -> dict[str, _T]:
    found: dict[str, _T] = {}
    for name, one in named:
        if name in found:
            raise OnnxFileError(f"it defines `{name}` twice")
        found[name] = one
    return found


def _node(content: bytes) -> Operation:
    node = read_message(content)  # input = 1, output = 2, op_type = 4, attribute = 5, domain = 7
    domain, operator = text(node, 7), text(node, 4)
    name = operator if domain in ("", "ai.onnx") else f"{domain}.{operator}"
    attributes = _by_name(map(_attribute, parts(node, 5)))
    return Operation(name, tuple(texts(node, 1)), tuple(texts(node, 2)), attributes)


def _attribute(content: bytes) -> tuple[str, float | tuple[int, ...] | Tensor]:
    attribute = read_message(content)  # name = 1, f = 2, i = 3, t = 5, ints = 8
    name = text(attribute, 1)
    if sum(number in attribute for number in (2, 3, 5, 8)) > 1:
        raise OnnxFileError(f"the attribute `{name}` has values of several types")
    if 5 in attribute:
        return name, _named_tensor(part(attribute, 5))[1]
    if 2 in attribute:
        return name, single_float(attribute, 2)
    if 3 in attribute:
        return name, float(integer(attribute, 3))
    return name, tuple(integers(attribute, 8))


def _named_tensor(content: bytes) -> tuple[str, Tensor]:
    # dims = 1, data_type = 2, float_data = 4, int64_data = 7, name = 8, raw_data = 9, double_data = 10,
    # data_location = 14, which is 0 for the file itself
    tensor = read_message(content)
    name, shape = text(tensor, 8), tuple(integers(tensor, 1))
    type_ = integer(tensor, 2)
    if integer(tensor, 14):
        raise OnnxFileError(f"the numbers of `{name}` are in another file, which no certificate covers")
    code = {_FLOAT: "f", _INT64: "q", _DOUBLE: "d"}.get(type_)
    if code is None:
        return name, Tensor(shape, ())  # of a type that no bound is proved of
    if 9 in tensor:
        raw = part(tensor, 9)
        numbers = tuple(map(float, struct.unpack(f"<{len(raw) // struct.calcsize(code)}{code}", raw)))
    elif type_ == _INT64:
        numbers = tuple(map(float, integers(tensor, 7)))
    else:
        numbers = tuple(floats(tensor, 4 if type_ == _FLOAT else 10, code))
    if len(numbers) != prod(shape):
        raise OnnxFileError(f"`{name}` has {len(numbers)} numbers, which do not fill its shape {shape}")
    if any(map(isnan, numbers)):  # infinity may be a bound of Clip
        raise OnnxFileError(f"`{name}` holds what is not a number (NaN)")
    return name, Tensor(shape, numbers, type_ == _DOUBLE)


def _value(content: bytes) -> tuple[str, ValueShape]:
    value = read_message(content)  # name = 1, type = 2
    tensor = read_message(part(read_message(part(value, 2)), 1))  # TypeProto.tensor_type
    dimensions = map(read_message, parts(read_message(part(tensor, 2)), 1))  # TensorShapeProto.dim
    sizes = (integer(one, 1) if 1 in one else None for one in dimensions)  # dim_value
    return text(value, 1), ValueShape(integer(tensor, 1), tuple(sizes))
