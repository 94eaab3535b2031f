from __future__ import annotations

import random

import pytest

from aeros.models.interface import ValueInterface
from aeros.models.onnx_session import OnnxSession
from aeros.spec.backends.network.box_propagation import bound_vectors, propagate, rounding_errors
from aeros.spec.backends.network.steps import Clip, Join, Network, Scale, Sum
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
    )
    network = Network({"x": 2}, {"d": "d"}, steps, is_double=True)
    low, high = propagate(network, {"x": ([0.0, 1.0], [1.0, 2.0])})["d"]
    assert low == pytest.approx([-1.0, -1.0, 0.0, 1.0])
    assert high == pytest.approx([1.0, 0.0, 1.0, 2.0])


def test_rounding_errors_grow_with_the_numbers() -> None:
    network = network_of(random_layers(0))
    small, large = (
        rounding_errors(network, bound_vectors(network, {"x": ([-s] * 3, [s] * 3)}))[network.outputs["y"]][0]
        for s in (1.0, 1000.0)
    )
    assert 0.0 < small < 1e-3
    assert 100 * small < large
