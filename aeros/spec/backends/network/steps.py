"""Network as a list of steps on vectors, translated from an ONNX graph of few operators.

Gemm, MatMul, Add, Sub, Mul and Div with constants; Add and Sub of two values; Relu, Tanh, Sigmoid, Clip;
Concat, Flatten, Reshape, Identity and Constant. Every value is one vector: a batch has one row. All other
operators are refused, so nothing is claimed of a network that is not understood.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

from aeros.spec.backends.network.onnx_file import OnnxGraph, Operation, Tensor

Rows = tuple[tuple[float, ...], ...]


class UnsupportedNetworkError(Exception):
    """The network has an operator or a shape that no bound is proved of; the message says which."""


@dataclass(frozen=True)
class Linear:
    """target = weights · source + bias.

    Attributes:
        target: name of the vector that it makes.
        source: name of the vector that it takes.
        weights: a row for each component of the target.
        bias: a number for each component of the target.
    """

    target: str
    source: str
    weights: Rows
    bias: tuple[float, ...]

    @cached_property
    def absolute_weights(self) -> Rows:
        """The absolute values of the weights."""
        return tuple(tuple(map(abs, row)) for row in self.weights)


@dataclass(frozen=True)
class Sum:
    """target = first + sign * second, component by component.

    Attributes:
        target: name of the vector that it makes.
        first: name of the first vector that it takes.
        second: name of the second.
        sign: 1 or -1.
    """

    target: str
    first: str
    second: str
    sign: float


@dataclass(frozen=True)
class Scale:
    """target = factors * source + offsets, component by component.

    Attributes:
        target: name of the vector that it makes.
        source: name of the vector that it takes.
        factors: a factor for each component.
        offsets: what is added to each component.
    """

    target: str
    source: str
    factors: tuple[float, ...]
    offsets: tuple[float, ...]


@dataclass(frozen=True)
class Clip:
    """target = min(max(source, lower), upper); `Relu` has the ends 0 and infinity.

    Attributes:
        target: name of the vector that it makes.
        source: name of the vector that it takes.
        lower: least value of each component.
        upper: greatest value of each component.
    """

    target: str
    source: str
    lower: float
    upper: float


@dataclass(frozen=True)
class Smooth:
    """target = function(source), for `tanh` or `sigmoid`, which increase.

    Attributes:
        target: name of the vector that it makes.
        source: name of the vector that it takes.
        function: name of the function.
    """

    target: str
    source: str
    function: str


@dataclass(frozen=True)
class Join:
    """target = all sources, one after the other.

    Attributes:
        target: name of the vector that it makes.
        sources: names of the vectors that it takes.
    """

    target: str
    sources: tuple[str, ...]


Step = Linear | Sum | Scale | Clip | Smooth | Join


@dataclass(frozen=True)
class Network:
    """Network as steps.

    Attributes:
        inputs: size of each input, by name.
        outputs: name of the vector of each output, by the output's name.
        steps: the steps, in order.
        is_double: True if it computes in 64-bit floating point, False for 32 bits.
    """

    inputs: Mapping[str, int]
    outputs: Mapping[str, str]
    steps: tuple[Step, ...]
    is_double: bool

    @property
    def has_smooth(self) -> bool:
        """Tell whether a step is not piecewise linear."""
        return any(isinstance(step, Smooth) for step in self.steps)


def translate(graph: OnnxGraph, inputs: Mapping[str, int]) -> Network:
    """Translate a graph to steps.

    Args:
        graph: the graph.
        inputs: size of each input, by name.

    Returns:
        The network.

    Raises:
        UnsupportedNetworkError: an operator or its use is not supported.
    """
    translator = _Translator(graph, inputs)
    for node in graph.nodes:
        translator.translate(node)
    for name in graph.outputs:
        if name not in translator.size:
            raise UnsupportedNetworkError(f"its output `{name}` does not depend on an input")
    doubles = {one.is_double for one in graph.constants.values() if one.numbers and one.shape}
    doubles |= {shape.element == 11 for shape in (*graph.inputs.values(), *graph.outputs.values())}
    return Network(
        inputs,
        {name: translator.alias.get(name, name) for name in graph.outputs},
        tuple(translator.steps),
        doubles == {True},
    )


class _Translator:
    def __init__(self, graph: OnnxGraph, inputs: Mapping[str, int]) -> None:
        self.steps: list[Step] = []
        self.size: dict[str, int] = dict(inputs)
        self.alias: dict[str, str] = {}
        self._constants = dict(graph.constants)
        for name, tensor in graph.constants.items():
            if not all(map(math.isfinite, tensor.numbers)):
                raise UnsupportedNetworkError(f"the constant `{name}` holds a number that is not finite")

    def translate(self, node: Operation) -> None:
        handler = _HANDLERS.get(node.operator)
        if handler is None or len(node.outputs) != 1:
            raise UnsupportedNetworkError(
                f"it has the operator `{node.operator}`; bounds are proved of {', '.join(_HANDLERS)}"
            )
        (output,) = node.outputs
        if output in self.size or output in self._constants:
            raise UnsupportedNetworkError(f"it defines `{output}` twice")
        handler(self, node)

    def _vector(self, name: str) -> str:
        """Return the vector that a value stands for.

        Raises:
            UnsupportedNetworkError: the value is not computed before.
        """
        name = self.alias.get(name, name)
        if name not in self.size:
            raise UnsupportedNetworkError(f"`{name}` is used before it is computed")
        return name

    def _constant(self, node: Operation, position: int) -> Tensor | None:
        if position >= len(node.inputs) or not node.inputs[position]:
            return None  # left out, and no constant without a name
        return self._constants.get(node.inputs[position])

    def _add(self, node: Operation, step: Step, size: int) -> None:
        self.steps.append(step)
        self.size[node.outputs[0]] = size

    def gemm(self, node: Operation) -> None:
        weights, bias = self._constant(node, 1), self._constant(node, 2)
        if weights is None or len(weights.shape) != 2 or _number(node, "transA", 0.0):
            raise UnsupportedNetworkError(f"`{node.operator}` with weights that are not constant")
        alpha, beta = _number(node, "alpha", 1.0), _number(node, "beta", 1.0)
        if (alpha, beta) != (1.0, 1.0) or (len(node.inputs) > 2 and bias is None):
            raise UnsupportedNetworkError("`Gemm` with an alpha or beta other than 1, or a bias not constant")
        rows = _rows(weights, transposed=not _number(node, "transB", 0.0))
        self._linear(node, rows, _spread(bias, len(rows)) if bias else (0.0,) * len(rows))

    def matmul(self, node: Operation) -> None:
        weights = self._constant(node, 1)
        if weights is None or len(weights.shape) != 2:
            raise UnsupportedNetworkError("`MatMul` with a matrix that is not constant")
        rows = _rows(weights, transposed=True)
        self._linear(node, rows, (0.0,) * len(rows))

    def _linear(self, node: Operation, rows: Rows, bias: tuple[float, ...]) -> None:
        source = self._vector(node.inputs[0])
        if any(len(row) != self.size[source] for row in rows):
            raise UnsupportedNetworkError(f"`{node.operator}` of a batch with more than one row")
        self._add(node, Linear(node.outputs[0], source, rows, bias), len(rows))

    def arithmetic(self, node: Operation) -> None:
        first, second = self._constant(node, 0), self._constant(node, 1)
        subtracts, scales = node.operator == "Sub", node.operator in ("Mul", "Div")
        if first is None and second is None and not scales:
            left, right = map(self._vector, node.inputs)
            if self.size[left] != self.size[right]:
                raise UnsupportedNetworkError(f"`{node.operator}` of vectors of different sizes")
            self._add(node, Sum(node.outputs[0], left, right, -1.0 if subtracts else 1.0), self.size[left])
            return
        constant = second if first is None else first
        if constant is None or (node.operator == "Div" and first is not None):
            raise UnsupportedNetworkError(f"`{node.operator}` of two values that depend on inputs")
        source = self._vector(node.inputs[1 if first is not None else 0])
        size = self.size[source]
        numbers = _spread(constant, size)
        ones, zeros = (1.0,) * size, (0.0,) * size
        if node.operator == "Div":
            # 1/c is rounded, which the bounds of `Scale` cover only where it is exact.
            if not all(one and math.frexp(one)[0] in (0.5, -0.5) for one in numbers):
                raise UnsupportedNetworkError("`Div` by a number that is no power of 2; write `Mul`")
            numbers = tuple(1.0 / one for one in numbers)
        if scales:
            step = Scale(node.outputs[0], source, numbers, zeros)
        elif subtracts and first is not None:
            step = Scale(node.outputs[0], source, (-1.0,) * size, numbers)
        else:
            step = Scale(
                node.outputs[0], source, ones, tuple(-one for one in numbers) if subtracts else numbers
            )
        self._add(node, step, size)

    def relu(self, node: Operation) -> None:
        self._clip(node, 0.0, math.inf)

    def clip(self, node: Operation) -> None:
        ends = []
        for position, word, open_end in ((1, "min", -math.inf), (2, "max", math.inf)):
            given = position < len(node.inputs) and node.inputs[position] != ""
            constant = self._constant(node, position)
            if given and (constant is None or len(constant.numbers) != 1):
                raise UnsupportedNetworkError("`Clip` with an end that is not constant")
            ends.append(constant.numbers[0] if constant else _number(node, word, open_end))
        self._clip(node, *ends)

    def _clip(self, node: Operation, lower: float, upper: float) -> None:
        source = self._vector(node.inputs[0])
        self._add(node, Clip(node.outputs[0], source, lower, upper), self.size[source])

    def smooth(self, node: Operation) -> None:
        source = self._vector(node.inputs[0])
        self._add(node, Smooth(node.outputs[0], source, node.operator.lower()), self.size[source])

    def concat(self, node: Operation) -> None:
        sources = tuple(map(self._vector, node.inputs))
        if _number(node, "axis", 0.0) not in (1.0, -1.0):
            raise UnsupportedNetworkError("`Concat` along another axis than the last")
        self._add(node, Join(node.outputs[0], sources), sum(self.size[one] for one in sources))

    def same(self, node: Operation) -> None:
        """One vector under another name: shapes change and the order of the numbers does not."""
        self.alias[node.outputs[0]] = self._vector(node.inputs[0])
        self.size[node.outputs[0]] = self.size[self.alias[node.outputs[0]]]

    def constant(self, node: Operation) -> None:
        value = node.attributes.get("value")
        if not isinstance(value, Tensor):
            raise UnsupportedNetworkError("`Constant` of another form than a tensor")
        self._constants[node.outputs[0]] = value


_HANDLERS: Final = {
    "Gemm": _Translator.gemm,
    "MatMul": _Translator.matmul,
    "Add": _Translator.arithmetic,
    "Sub": _Translator.arithmetic,
    "Mul": _Translator.arithmetic,
    "Div": _Translator.arithmetic,
    "Relu": _Translator.relu,
    "Clip": _Translator.clip,
    "Tanh": _Translator.smooth,
    "Sigmoid": _Translator.smooth,
    "Concat": _Translator.concat,
    "Flatten": _Translator.same,
    "Reshape": _Translator.same,
    "Identity": _Translator.same,
    "Constant": _Translator.constant,
}


def _number(node: Operation, name: str, default: float) -> float:
    value = node.attributes.get(name, default)
    if not isinstance(value, float):
        raise UnsupportedNetworkError(f"`{node.operator}` with a `{name}` that is no number")
    return value


def _rows(matrix: Tensor, *, transposed: bool) -> Rows:
    """Return the rows of a matrix, or of its transpose."""
    height, width = matrix.shape
    if transposed:
        return tuple(matrix.numbers[at::width] for at in range(width))
    return tuple(matrix.numbers[at * width : (at + 1) * width] for at in range(height))


def _spread(tensor: Tensor, size: int) -> tuple[float, ...]:
    """Return a number for each component: a constant of one number holds for all.

    Raises:
        UnsupportedNetworkError: the constant has another shape.
    """
    numbers: Sequence[float] = tensor.numbers
    if len(numbers) not in (1, size) or any(one != 1 for one in tensor.shape[:-1]):
        raise UnsupportedNetworkError(f"a constant of the shape {tensor.shape} with a vector of {size}")
    return tuple(numbers) * (size if len(numbers) == 1 else 1)
