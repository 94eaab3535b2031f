"""Packages of models for tests."""

from __future__ import annotations

from fractions import Fraction

from aeros.models.interface import CheckedBound, ModelKind, ModelPackage, ValueInterface
from aeros.models.onnx_writer import Layer, write_onnx
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.expr.units import DIMENSIONLESS, parse_unit
from aeros.spec.model.models import ModelBound, ModelValue, ModuleModel

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


def gauge_and_tent() -> tuple[ModuleModel, ModuleModel]:
    """The table `gauge.csv`, and the network `tent.onnx` with a bound that is checked at run time."""
    span, millimetre = SourceSpan(Source("ecm.yaml", ""), 0, 0), parse_unit("mm")
    assert millimetre is not None
    level = ModelValue("level", (), millimetre, (Fraction(0), Fraction(1, 50)), span)
    volume = ModelValue("volume", (), DIMENSIONLESS, (Fraction(0), Fraction(1)), span)
    x = ModelValue("x", (1,), DIMENSIONLESS, (Fraction(0), Fraction(2)), span)
    y = ModelValue("y", (1,), DIMENSIONLESS, (Fraction(-1), Fraction(2)), span)
    low = ModelBound(
        "low", {"x": ((Fraction(0), Fraction(2)),)}, {"y": ((Fraction(0), Fraction(3, 4)),)}, True, span
    )
    return (
        ModuleModel("gauge", "table", "gauge.csv", {"level": level}, {"volume": volume}, (), span, span),
        ModuleModel("tent", "onnx", "tent.onnx", {"x": x}, {"y": y}, (low,), span, span),
    )
