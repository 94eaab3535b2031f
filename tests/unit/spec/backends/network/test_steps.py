from __future__ import annotations

import math
from dataclasses import replace

import pytest

from aeros.spec.backends.network.onnx_file import OnnxGraph, Operation, Tensor, ValueShape
from aeros.spec.backends.network.steps import (
    Clip,
    Join,
    Linear,
    Scale,
    Step,
    Sum,
    UnsupportedNetworkError,
    translate,
)
from tests.unit.spec.backends.network.networks import TENT, network_of

TWO = Tensor((1,), (2.0,))
PAIR = ValueShape(1, (1, 2))


def graph(*nodes: Operation, **constants: Tensor) -> OnnxGraph:
    return OnnxGraph(nodes, constants, {"x": PAIR, "z": PAIR}, {nodes[-1].outputs[0]: PAIR})


def node(operator: str, *inputs: str, **attributes: float | tuple[int, ...] | Tensor) -> Operation:
    return Operation(operator, inputs, ("y",), attributes)


def step(one: Operation, **constants: Tensor) -> Step:
    return translate(graph(one, **constants), {"x": 2, "z": 2}).steps[-1]


def test_layers_become_steps() -> None:
    network = network_of(TENT)
    assert [type(one) for one in network.steps] == [Linear, Clip, Linear]
    assert network.steps[1] == Clip("relu0", "gemm0", 0.0, math.inf)
    assert not network.is_double
    assert not network.has_smooth


def test_arithmetic_with_constants_becomes_one_scale() -> None:
    ones = (1.0, 1.0)
    assert step(node("Add", "x", "c"), c=TWO) == Scale("y", "x", ones, (2.0, 2.0))
    assert step(node("Sub", "x", "c"), c=TWO) == Scale("y", "x", ones, (-2.0, -2.0))
    assert step(node("Sub", "c", "x"), c=TWO) == Scale("y", "x", (-1.0, -1.0), (2.0, 2.0))
    assert step(node("Mul", "c", "x"), c=TWO) == Scale("y", "x", (2.0, 2.0), (0.0, 0.0))
    assert step(node("Div", "x", "c"), c=TWO) == Scale("y", "x", (0.5, 0.5), (0.0, 0.0))


def test_two_values_are_added_and_joined() -> None:
    assert step(node("Sub", "x", "z")) == Sum("y", "x", "z", -1.0)
    assert step(node("Concat", "x", "z", axis=-1.0)) == Join("y", ("x", "z"))


def test_a_matrix_product_takes_columns() -> None:
    matrix = Tensor((2, 2), (1.0, 2.0, 3.0, 4.0))
    found = step(node("MatMul", "x", "w"), w=matrix)
    assert found == Linear("y", "x", ((1.0, 3.0), (2.0, 4.0)), (0.0, 0.0))


def test_a_gemm_takes_columns_or_rows_and_a_bias_of_one_or_of_each() -> None:
    matrix, pair = Tensor((2, 2), (1.0, 2.0, 3.0, 4.0)), Tensor((2,), (5.0, 6.0))
    columns, rows = ((1.0, 3.0), (2.0, 4.0)), ((1.0, 2.0), (3.0, 4.0))
    assert step(node("Gemm", "x", "w"), w=matrix) == Linear("y", "x", columns, (0.0, 0.0))
    assert step(node("Gemm", "x", "w", transB=1.0), w=matrix) == Linear("y", "x", rows, (0.0, 0.0))
    assert step(node("Gemm", "x", "w", "c"), w=matrix, c=TWO) == Linear("y", "x", columns, (2.0, 2.0))
    assert step(node("Gemm", "x", "w", "c"), w=matrix, c=pair) == Linear("y", "x", columns, (5.0, 6.0))


def test_a_constant_may_be_a_node() -> None:
    constant = Operation("Constant", (), ("c",), {"value": TWO})
    network = translate(graph(constant, node("Mul", "x", "c")), {"x": 2, "z": 2})
    assert network.steps == (Scale("y", "x", (2.0, 2.0), (0.0, 0.0)),)


def test_ends_of_a_clip_may_be_left_out() -> None:
    assert step(node("Clip", "x", "", "c"), c=replace(TWO, shape=())) == Clip("y", "x", -math.inf, 2.0)


def test_other_shapes_of_one_vector_are_the_vector() -> None:
    network = translate(graph(node("Flatten", "x")), {"x": 2, "z": 2})
    assert network.steps == ()
    assert network.outputs == {"y": "x"}


@pytest.mark.parametrize(
    ("one", "cause"),
    [
        (node("Softmax", "x"), "the operator `Softmax`"),
        (node("Mul", "x", "z"), "two values that depend on inputs"),
        (node("Div", "x", "c"), "no power of 2"),
        (node("Gemm", "x", "z"), "weights that are not constant"),
        (node("Gemm", "x", "w", alpha=2.0), "alpha or beta"),
        (node("Gemm", "x", "w", beta=2.0), "alpha or beta"),
        (node("Gemm", "x", "w", "z"), "a bias not constant"),
        (node("Gemm", "x", "c"), "weights that are not constant"),
        (node("Gemm", "x", "tall"), "a batch with more than one row"),
        (node("Div", "c", "x"), "two values that depend on inputs"),
        (node("Div", "x", "zero"), "no power of 2"),
        (node("MatMul", "x", "c"), "matrix that is not constant"),
        (node("Concat", "x", "z"), "another axis"),
        (node("Gemm", "x", "w", transA=(1,)), "`transA` that is no number"),
        (node("Gemm", "x", "w", transA=1.0), "weights that are not constant"),
        (node("MatMul", "x", "z"), "matrix that is not constant"),
        (node("Clip", "x", "z"), "end that is not constant"),
        (node("Concat", "x", "z", axis=0.0), "another axis"),
        (node("Relu", "missing"), "before it is computed"),
        (node("Add", "x", "wide"), "with a vector of 2"),
        (node("Constant", value=(1,)), "another form than a tensor"),
    ],
)
def test_anything_else_is_refused(one: Operation, cause: str) -> None:
    constants = {
        "c": Tensor((1,), (3.0,)),
        "w": Tensor((2, 2), (1.0, 0.0, 0.0, 1.0)),
        "tall": Tensor((3, 1), (1.0, 1.0, 1.0)),
        "zero": Tensor((1,), (0.0,)),
        "wide": Tensor((1, 3), (1.0, 1.0, 1.0)),
    }
    with pytest.raises(UnsupportedNetworkError, match=cause):
        step(one, **constants)


def test_a_constant_that_is_not_finite_is_refused() -> None:
    with pytest.raises(UnsupportedNetworkError, match="not finite"):
        step(node("Add", "x", "c"), c=Tensor((1,), (math.nan,)))
