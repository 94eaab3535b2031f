from __future__ import annotations

from fractions import Fraction

from aeros.models.interface import CheckedBound
from aeros.spec.expr.units import parse_unit
from aeros.spec.model.models import ModelBound, ModelValue, ModuleModel
from tests.unit.runtime.conftest import SPAN


def test_a_package_has_doubles_inside_of_the_exact_ends() -> None:
    unit = parse_unit("mm")
    assert unit is not None
    third = Fraction(1, 3)
    value = ModelValue("level", (2,), unit, (Fraction(0), third), SPAN)
    bounds = tuple(
        ModelBound(name, {"level": ((Fraction(0), third),) * 2}, {}, checked, SPAN)
        for name, checked in (("proved", False), ("checked", True))
    )
    model = ModuleModel("gauge", "onnx", "g.onnx", {"level": value}, {}, bounds, SPAN, SPAN)
    package = model.package(b"bytes")
    assert value.size == 2
    assert package.content == b"bytes"
    assert package.inputs["level"].factor == 0.001
    assert Fraction(package.inputs["level"].upper) < third
    (bound,) = package.bounds
    assert isinstance(bound, CheckedBound)
    assert bound.name == "checked"
    assert model.package(b"", checked=False).bounds == ()
