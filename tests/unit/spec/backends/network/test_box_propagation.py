from __future__ import annotations

import math
import random
from dataclasses import replace
from decimal import Decimal
from typing import Any

import pytest

from aeros.models.interface import ValueInterface
from aeros.models.onnx_session import OnnxSession
from aeros.spec.backends.network.box_propagation import bound_vectors, propagate, rounding_errors
from aeros.spec.backends.network.steps import Clip, Join, Linear, Network, Scale, Smooth, Step, Sum
from tests.unit.spec.backends.network.networks import content_of, network_of, random_layers, rounded


@pytest.mark.parametrize("activation", ["Relu", "Tanh"])
@pytest.mark.parametrize("seed", range(3))
def test_onnxruntime_stays_in_the_box_of_a_point_and_of_a_box(seed: int, activation: str) -> None:
    layers = random_layers(seed, activation=activation)
    network = network_of(layers)
    value = {"x": ValueInterface((3,), 1.0, "1", -9, 9)}, {"y": ValueInterface((2,), 1.0, "1", -9, 9)}
    session = OnnxSession("n.onnx", content_of(layers), *value)
    draw = random.Random(seed)  # noqa: S311 - weights and points, no secrets
    box = propagate(network, {"x": ([-1.0] * 3, [1.0] * 3)})["y"]
    for _ in range(200):
        x = [rounded(draw.uniform(-1, 1)) for _ in range(3)]
        found = session.evaluate({"x": tuple(x)})["y"]
        point = propagate(network, {"x": (x, list(x))})["y"]
        for ends in (point, box):
            assert all(low <= one <= high for low, one, high in zip(ends[0], found, ends[1], strict=True))
        assert all(high - low < 1e-3 for low, high in zip(*point, strict=True))


def test_every_step_holds_its_exact_result_and_little_more() -> None:
    steps = (
        Scale("a", "x", (-2.0, 0.5), (1.0, 0.0)),
        Sum("b", "a", "x", -1.0),
        Clip("c", "b", -1.0, 4.0),
        Join("d", ("c", "x")),
        Linear("e", "d", ((1.0, -2.0, 0.0, 0.5), (0.0, 1.0, 0.0, -3.0)), (0.25, 7.0)),
    )
    network = Network({"x": 2}, {"d": "d", "e": "e"}, steps, is_double=True)
    found = propagate(network, {"x": ([0.0, 1.0], [1.0, 2.0])})
    assert found.keys() == {"d", "e"}
    low, high = found["d"]
    assert low == pytest.approx([-1.0, -1.0, 0.0, 1.0])
    assert high == pytest.approx([1.0, 0.0, 1.0, 2.0])
    low, high = found["e"]
    assert low == pytest.approx([-0.25, 0.0])
    assert high == pytest.approx([4.25, 4.0])


HUGE = 2.0**20
LOST = Scale("lost", "x", (1.0,), (-HUGE,))
"""Near zero for x near `HUGE`, and as wrong as a sum of such numbers may be."""


def margins(steps: tuple[Step, ...], low: float, high: float, *, is_double: bool) -> tuple[float, float]:
    """Return the error of rounding of the last step, and the width of its box, in units of roundoff."""
    network = Network({"x": 1}, {"y": steps[-1].target}, steps, is_double)
    vectors = bound_vectors(network, {"x": ([low], [high])})
    (least,), (greatest,) = vectors[steps[-1].target]
    unit = 2.0**-53 if is_double else 2.0**-24
    return rounding_errors(network, vectors)[steps[-1].target][0] / unit, (greatest - least) / unit


@pytest.mark.parametrize("is_double", [True, False])
@pytest.mark.parametrize(
    ("steps", "x", "error", "width"),
    [
        # (4 n + 16) for n terms
        ((Linear("y", "x", ((HUGE,),), (0.0,)),), 1.0, 20, 40),
        ((Linear("y", "x", ((-HUGE,),), (0.0,)),), -3.0, 60, 120),
        ((Linear("y", "x", ((0.0,),), (-HUGE,)),), 1.0, 20, 40),
        ((Linear("y", "x", ((1.0,),), (-HUGE,)),), HUGE, 40, 80),
        # 4 of the result of an operation, and 4 of the product that is rounded before, or of what bounds it
        ((Scale("y", "x", (-HUGE,), (0.0,)),), 1.0, 8, 16),
        ((Scale("y", "x", (1.0,), (-HUGE,)),), HUGE, 4, 8),
        ((Scale("y", "x", (0.0,), (-HUGE,)),), 1.0, 12, 8),
        ((Sum("y", "x", "x", 1.0),), HUGE, 8, 16),
        # The error of what comes before.
        ((LOST, Linear("y", "lost", ((-7.0,),), (0.0,))), HUGE, 28, 56),
        ((LOST, Scale("y", "lost", (-7.0,), (0.0,))), HUGE, 28, 56),
        ((LOST, Scale("more", "x", (9.0,), (-9.0 * HUGE,)), Sum("y", "more", "lost", -1.0)), HUGE, 40, 80),
        ((LOST, Scale("more", "x", (9.0,), (-9.0 * HUGE,)), Sum("y", "lost", "more", 1.0)), HUGE, 40, 80),
        (
            (LOST, Join("both", ("x", "lost")), Linear("y", "both", ((0.0, 3.0),), (0.0,))),
            HUGE,
            12,
            24,
        ),
        ((Join("both", ("x", "x")), Linear("y", "both", ((0.0, 3.0),), (0.0,))), HUGE, 72, 144),
        ((LOST, Clip("y", "lost", -HUGE, HUGE)), HUGE, 4, 8),
    ],
)
def test_margins_are_those_of_the_numbers_whose_rounding_they_bound(
    steps: tuple[Step, ...], x: float, error: float, width: float, *, is_double: bool
) -> None:
    """In units of the roundoff of `HUGE`; the factors are in the description of `box_propagation`."""
    found = margins(steps, x, x, is_double=is_double)
    assert found == pytest.approx((error * HUGE, width * HUGE), rel=1e-5)


@pytest.mark.parametrize(
    ("step", "error", "width"),
    [
        (Linear("y", "x", ((0.0,),), (0.0,)), 2, 4),
        (Scale("y", "x", (0.0,), (0.0,)), 1, 4),
        (Sum("y", "x", "x", 1.0), 1, 2),
    ],
)
def test_numbers_near_0_have_the_error_of_the_least_number(step: Step, error: int, width: int) -> None:
    least = 2.0**-149
    found = margins((step,), 0.0, 0.0, is_double=False)
    assert found == pytest.approx((error * least * 2.0**24, width * least * 2.0**24), rel=1e-5, abs=0.0)


@pytest.mark.parametrize(("low", "high"), [(-3.0, 1.0), (-1.0, 3.0)])
@pytest.mark.parametrize(
    "step",
    [Linear("y", "x", ((HUGE,),), (0.0,)), Scale("y", "x", (-HUGE,), (0.0,)), Sum("y", "x", "x", 1.0)],
    ids=["linear", "scale", "sum"],
)
def test_errors_are_those_of_the_end_of_a_box_that_is_farther_from_zero(
    step: Step, low: float, high: float
) -> None:
    error, _ = margins((step,), low, high, is_double=False)
    of_low, of_high = (margins((step,), one, one, is_double=False)[0] for one in (low, high))
    assert error == pytest.approx(max(of_low, of_high))


@pytest.mark.parametrize(
    "step",
    [
        Linear("y", "x", ((HUGE,),), (-3.0,)),
        Linear("y", "x", ((-HUGE,),), (3.0,)),
        Scale("y", "x", (HUGE,), (-HUGE,)),
        Scale("y", "x", (-HUGE,), (HUGE,)),
        Sum("y", "x", "x", 1.0),
        Sum("y", "x", "x", -1.0),
        Clip("y", "x", -2.0, 2.0),
        Smooth("y", "x", "tanh"),
    ],
)
def test_the_box_of_a_box_holds_those_of_all_its_parts(step: Step) -> None:
    network = Network({"x": 1}, {"y": "y"}, (step,), is_double=False)
    narrow = (1.0, 1.0 + 3 * 2.0**-52)  # whose middle is rounded
    for low, high in ((-3.0, 1.0), (-1.0, 3.0), (1.0, 5.0), (-5.0, -1.0), narrow):
        (least,), (most,) = propagate(network, {"x": ([low], [high])})["y"]
        middle = (low + high) / 2
        for start, end in ((low, low), (middle, middle), (high, high), (low, middle), (middle, high)):
            (lower,), (upper,) = propagate(network, {"x": ([start], [end])})["y"]
            assert least <= lower <= upper <= most


@pytest.mark.parametrize(("name", "function"), [("tanh", math.tanh), ("sigmoid", None)])
@pytest.mark.parametrize("x", [-800.0, -700.0, -2.0, 0.0, 0.5, 800.0])
def test_smooth_steps_are_within_their_margin_of_the_function(name: str, function: Any, x: float) -> None:
    network = Network({"x": 1}, {"y": "y"}, (Smooth("y", "x", name),), is_double=True)
    (low,), (high,) = propagate(network, {"x": ([x - 1.0], [x + 1.0])})["y"]
    exact = function or (lambda one: float(1 / (1 + Decimal(-one).exp())))
    assert low == pytest.approx(exact(x - 1.0) - 2.0**-20, abs=1e-12)
    assert high == pytest.approx(exact(x + 1.0) + 2.0**-20, abs=1e-12)


def test_rounding_errors_grow_with_the_numbers() -> None:
    network = network_of(random_layers(0))
    small, large = (
        rounding_errors(network, bound_vectors(network, {"x": ([-s] * 3, [s] * 3)}))[network.outputs["y"]][0]
        for s in (1.0, 1000.0)
    )
    assert 0.0 < small < 1e-3
    assert 100 * small < large


def test_vectors_of_other_lengths_are_refused_and_not_cut_off() -> None:
    two = Linear("y", "x", ((1.0,), (2.0,)), (1.0,))
    one, pair = ([0.0], [1.0]), ([0.0, 0.0], [1.0, 1.0])
    network = Network({"x": 1}, {"y": "y"}, (two,), is_double=True)
    with pytest.raises(ValueError, match="argument 3 is shorter"):
        bound_vectors(network, {"x": one})
    whole = replace(network, steps=(Linear("y", "x", ((1.0,), (2.0,)), (1.0, 1.0)),))
    for box in (([0.0], [1.0, 2.0]), ([0.0, 0.0], [1.0])):
        with pytest.raises(ValueError, match="argument 2 is"):
            bound_vectors(whole, {"x": box})
    with pytest.raises(ValueError, match="argument 2 is shorter"):
        rounding_errors(network, {"x": one, "y": pair})
    scaled = replace(network, steps=(Scale("y", "x", (1.0,), (1.0,)),))
    with pytest.raises(ValueError, match="argument 2 is longer"):
        rounding_errors(scaled, {"x": one, "y": pair})
    for factors, offsets in (((1.0, 1.0), (1.0,)), ((1.0,), (1.0, 1.0))):
        with pytest.raises(ValueError, match="argument 2 is"):
            rounding_errors(
                replace(network, steps=(Scale("y", "x", factors, offsets),)), {"x": pair, "y": pair}
            )


@pytest.mark.parametrize(
    ("value", "size"), [(-1e4, 0.0), (-700.5, 0.0), (0.0, 0.5), (2.0, 0.8807970779778823)]
)
def test_a_sigmoid_is_between_0_and_1(value: float, size: float) -> None:
    network = Network({"x": 1}, {"y": "y"}, (Smooth("y", "x", "sigmoid"),), is_double=True)
    (low,), (high,) = propagate(network, {"x": ([value], [value])})["y"]
    assert low < size < high
    assert high - low < 1e-4
