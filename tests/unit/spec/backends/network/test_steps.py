from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest

from aeros.spec.backends.network.onnx_file import OnnxGraph, Operation, Tensor, ValueShape
from aeros.spec.backends.network.steps import (
    Clip,
    Join,
    Linear,
    Scale,
    Smooth,
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
    powers = Tensor((1, 2), (-4.0, 0.25))
    assert step(node("Div", "x", "c"), c=powers) == Scale("y", "x", (-0.25, 4.0), (0.0, 0.0))


def test_two_values_are_added_and_joined() -> None:
    assert step(node("Sub", "x", "z")) == Sum("y", "x", "z", -1.0)
    assert step(node("Add", "z", "x")) == Sum("y", "z", "x", 1.0)
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


def test_ends_of_a_clip_may_be_attributes() -> None:
    assert step(node("Clip", "x", min=-1.0, max=0.5)) == Clip("y", "x", -1.0, 0.5)
    assert step(node("Clip", "x")) == Clip("y", "x", -math.inf, math.inf)


def test_functions_that_increase_become_smooth_steps() -> None:
    network = translate(graph(node("Sigmoid", "x")), {"x": 2, "z": 2})
    assert network.steps == (Smooth("y", "x", "sigmoid"),)
    assert network.has_smooth


def test_vectors_have_the_sizes_of_their_steps() -> None:
    """Each constant of one number is spread over a vector that earlier steps have made."""
    both = Operation("Concat", ("x", "z"), ("both",), {"axis": 1.0})
    joined = translate(graph(both, node("Mul", "both", "c"), c=TWO), {"x": 2, "z": 3})
    assert joined.steps[-1] == Scale("y", "both", (2.0,) * 5, (0.0,) * 5)
    wide = Tensor((2, 3), (1.0,) * 6)
    for first in (
        Operation("MatMul", ("x", "w"), ("a",), {}),
        Operation("Gemm", ("x", "w"), ("a",), {}),
        Operation("Relu", ("z",), ("a",), {}),
        Operation("Tanh", ("z",), ("a",), {}),
        Operation("Identity", ("z",), ("a",), {}),
        Operation("Sub", ("z", "z"), ("a",), {}),
        Operation("Sub", ("z", "c"), ("a",), {}),
        Operation("Mul", ("c", "z"), ("a",), {}),
    ):
        found = translate(graph(first, node("Add", "a", "c"), c=TWO, w=wide), {"x": 2, "z": 3}).steps[-1]
        assert isinstance(found, Scale)
        assert found.offsets == (2.0,) * 3


def test_vectors_of_different_sizes_are_not_added() -> None:
    with pytest.raises(UnsupportedNetworkError, match=r"^`Add` of vectors of different sizes$"):
        translate(graph(node("Add", "x", "z")), {"x": 2, "z": 3})


def test_an_output_is_made_by_one_step_of_one_output() -> None:
    lost = replace(graph(node("Relu", "x")), outputs={"w": PAIR})
    with pytest.raises(UnsupportedNetworkError, match=r"^its output `w` does not depend on an input$"):
        translate(lost, {"x": 2, "z": 2})
    with pytest.raises(UnsupportedNetworkError, match="the operator `Relu`"):
        translate(graph(Operation("Relu", ("x",), ("y", "w"), {})), {"x": 2, "z": 2})


@pytest.mark.parametrize(
    ("constant", "ends", "is_double"),
    [(True, 11, True), (False, 11, False), (True, 1, False), (False, 1, False)],
)
def test_a_network_is_double_if_all_its_numbers_are(constant: bool, ends: int, is_double: bool) -> None:
    pair = ValueShape(ends, (1, 2))
    one = replace(
        graph(node("Add", "x", "c"), c=Tensor((2,), (1.0, 2.0), is_double=constant)),
        inputs={"x": pair},
        outputs={"y": pair},
    )
    assert translate(one, {"x": 2}).is_double is is_double
    others = {"e": Tensor((), (1.0,), is_double=not constant), "n": Tensor((0,), (), is_double=not constant)}
    assert translate(replace(one, constants={**one.constants, **others}), {"x": 2}).is_double is is_double
    without = replace(one, nodes=(node("Relu", "x"),), constants={})
    assert translate(without, {"x": 2}).is_double is (ends == 11)


def test_a_constant_without_a_name_is_not_one_that_is_left_out() -> None:
    nameless = {"": Tensor((2,), (5.0, 6.0)), "w": Tensor((2, 2), (1.0, 2.0, 3.0, 4.0))}
    product = step(node("Gemm", "x", "w"), **nameless)
    assert product == Linear("y", "x", ((1.0, 3.0), (2.0, 4.0)), (0.0, 0.0))
    assert step(node("Clip", "x", "", ""), **nameless) == Clip("y", "x", -math.inf, math.inf)


@pytest.mark.parametrize(
    ("shape", "is_spread"),
    [
        ((2,), True),
        ((1, 2), True),
        ((1, 1, 2), True),
        ((2, 1), False),
        ((2, 1, 1), False),
        ((1, 2, 1), False),
    ],
)
def test_a_constant_has_its_numbers_along_the_last_dimension(shape: tuple[int, ...], is_spread: bool) -> None:
    numbers = Tensor(shape, (5.0, 6.0))
    if is_spread:
        assert step(node("Add", "x", "c"), c=numbers) == Scale("y", "x", (1.0, 1.0), (5.0, 6.0))
    else:
        cause = f"a constant of the shape {shape} with a vector of 2"
        with pytest.raises(UnsupportedNetworkError, match=f"^{re.escape(cause)}$"):
            step(node("Add", "x", "c"), c=numbers)


def test_other_shapes_of_one_vector_are_the_vector() -> None:
    renamed = Operation("Identity", ("x",), ("a",), {}), Operation("Reshape", ("a",), ("b",), {})
    for one in (
        node("Relu", "b"),
        node("Concat", "a", "b", axis=1.0),
        node("Add", "b", "x"),
        node("Tanh", "a"),
        node("Flatten", "b"),
    ):
        found = translate(graph(*renamed, one), {"x": 2, "z": 2})
        plain = replace(one, inputs=tuple("x" for _ in one.inputs))
        assert found == translate(graph(plain), {"x": 2, "z": 2})
    network = translate(graph(node("Flatten", "x")), {"x": 2, "z": 2})
    assert network.steps == ()
    assert network.outputs == {"y": "x"}


@pytest.mark.parametrize(
    ("one", "cause"),
    [
        (
            node("Softmax", "x"),
            "it has the operator `Softmax`; bounds are proved of Gemm, MatMul, Add, Sub, Mul, Div, Relu, "
            "Clip, Tanh, Sigmoid, Concat, Flatten, Reshape, Identity, Constant",
        ),
        (node("Mul", "x", "z"), "`Mul` of two values that depend on inputs"),
        (node("Div", "x", "c"), "`Div` by a number that is no power of 2; write `Mul`"),
        (node("Gemm", "x", "z"), "`Gemm` with weights that are not constant"),
        (
            node("Gemm", "x", "w", alpha=2.0),
            "`Gemm` with an alpha or beta other than 1, or a bias not constant",
        ),
        (
            node("Gemm", "x", "w", beta=2.0),
            "`Gemm` with an alpha or beta other than 1, or a bias not constant",
        ),
        (node("Gemm", "x", "w", "z"), "`Gemm` with an alpha or beta other than 1, or a bias not constant"),
        (node("Gemm", "x", "c"), "`Gemm` with weights that are not constant"),
        (node("Gemm", "x", "tall"), "`Gemm` of a batch with more than one row"),
        (node("Div", "c", "x"), "`Div` of two values that depend on inputs"),
        (node("Div", "x", "zero"), "`Div` by a number that is no power of 2; write `Mul`"),
        (node("MatMul", "x", "c"), "`MatMul` with a matrix that is not constant"),
        (node("Concat", "x", "z"), "`Concat` along another axis than the last"),
        (node("Gemm", "x", "w", transA=(1,)), "`Gemm` with a `transA` that is no number"),
        (node("Gemm", "x", "w", transA=1.0), "`Gemm` with weights that are not constant"),
        (node("MatMul", "x", "z"), "`MatMul` with a matrix that is not constant"),
        (node("Clip", "x", "z"), "`Clip` with an end that is not constant"),
        (node("Concat", "x", "z", axis=0.0), "`Concat` along another axis than the last"),
        (node("Relu", "missing"), "`missing` is used before it is computed"),
        (node("Add", "x", "wide"), "a constant of the shape (1, 3) with a vector of 2"),
        (node("Constant", value=(1,)), "`Constant` of another form than a tensor"),
        (replace(node("Relu", "x"), outputs=("z",)), "it defines `z` twice"),
        (replace(node("Relu", "x"), outputs=("c",)), "it defines `c` twice"),
        (replace(node("Constant", value=TWO), outputs=("c",)), "it defines `c` twice"),
        (replace(node("Identity", "x"), outputs=("x",)), "it defines `x` twice"),
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
    with pytest.raises(UnsupportedNetworkError) as refused:
        step(one, **constants)
    assert str(refused.value) == cause


def test_a_constant_that_is_not_finite_is_refused() -> None:
    with pytest.raises(
        UnsupportedNetworkError, match=r"^the constant `c` holds a number that is not finite$"
    ):
        step(node("Add", "x", "c"), c=Tensor((1,), (math.nan,)))
