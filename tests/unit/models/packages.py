"""Packages of models for tests."""

from __future__ import annotations

from aeros.models.interface import CheckedBound, ModelKind, ModelPackage, ValueInterface
from aeros.models.onnx_writer import Layer, write_onnx

LEVELS = b"level [mm],volume\n0,0\n10,0.1\n20,0.4\n"


def value(
    lower: float, upper: float, unit: str = "1", factor: float = 1.0, shape: tuple[int, ...] = ()
) -> ValueInterface:
    return ValueInterface(shape, factor, unit, lower, upper)


def gauge(content: bytes = LEVELS, file: str = "gauge.csv") -> ModelPackage:
    """A table from a level in millimetres to a volume."""
    level, volume = value(0.0, 0.02, "mm", 0.001), value(0.0, 1.0)
    return ModelPackage("gauge", "table", file, content, {"level": level}, {"volume": volume})


def doubling(
    *bounds: CheckedBound, kind: ModelKind = "onnx", slope: float = 2.0, upper: float = 10.0
) -> ModelPackage:
    """A network with two numbers, y = slope * x, in degrees that are 0.5 in SI."""
    layers = [Layer([[slope, 0.0], [0.0, slope]], [0.0, 0.0])]
    angle = value(-1.0, 1.0, "half", 0.5, (2,))
    turned = value(-upper, upper, "half", 0.5, (2,))
    content = write_onnx("doubling", ("angle", 2), "turned", layers)
    return ModelPackage(
        "doubling", kind, "doubling.onnx", content, {"angle": angle}, {"turned": turned}, bounds
    )
