"""Small networks for tests."""

from __future__ import annotations

import random
import struct
from itertools import pairwise

from aeros.models.onnx_writer import Layer, write_onnx
from aeros.spec.backends.network.onnx_file import read_onnx
from aeros.spec.backends.network.steps import Network, translate


def rounded(number: float) -> float:
    return float(struct.unpack("f", struct.pack("f", number))[0])


def random_layers(seed: int, sizes: tuple[int, ...] = (3, 8, 8, 2), activation: str = "Relu") -> list[Layer]:
    draw = random.Random(seed)  # noqa: S311 - weights and points, no secrets
    layers = []
    for number, (size, rows) in enumerate(pairwise(sizes)):
        weights = [[rounded(draw.gauss(0.0, 0.5)) for _ in range(size)] for _ in range(rows)]
        bias = [rounded(draw.gauss(0.0, 0.1)) for _ in range(rows)]
        last = number == len(sizes) - 2
        layers.append(Layer(weights, bias, "" if last else activation, (-1.0, 1.0) if last else None))
    return layers


def content_of(layers: list[Layer]) -> bytes:
    return write_onnx("net", ("x", len(layers[0].weights[0])), "y", layers)


def network_of(layers: list[Layer]) -> Network:
    content = content_of(layers)
    return translate(read_onnx(content), {"x": len(layers[0].weights[0])})


TENT = [Layer([[1.0], [1.0]], [0.0, -1.0], "Relu"), Layer([[1.0, -2.0]], [0.0])]
"""y = x for x up to 1, and falls by 1 for each 1 beyond; boxes alone bound it by 2 x - 1 too loosely."""
