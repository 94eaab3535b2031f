from __future__ import annotations

from aeros.models.interface import ModelPackage
from aeros.models.load import LoadedModel
from aeros.models.onnx_writer import Layer, write_onnx
from tests.unit.models.packages import value

LAYERS = [Layer([[1.0], [-1.0]], [0.0, 0.0], "Relu"), Layer([[1.0, 1.0]], [0.25], clip=(0.0, 2.0))]


def test_onnxruntime_evaluates_the_layers() -> None:
    content = write_onnx("distance", ("x", 1), "y", LAYERS)
    model = LoadedModel(
        ModelPackage(
            "net", "onnx", "n.onnx", content, {"x": value(-9, 9, shape=(1,))}, {"y": value(-9, 9, shape=(1,))}
        )
    )
    assert [model.run(x=(x,))["y"] for x in (-1.0, 0.5, 5.0)] == [(1.25,), (0.75,), (2.0,)]


def test_the_same_layers_give_the_same_bytes() -> None:
    assert write_onnx("a", ("x", 1), "y", LAYERS) == write_onnx("a", ("x", 1), "y", LAYERS)
