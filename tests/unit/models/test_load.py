from __future__ import annotations

import math
import sys
from dataclasses import replace
from typing import Any, cast

import pytest

from aeros.models.interface import CheckedBound, ModelFileError, ModelKind
from aeros.models.load import LoadedModel, ModelBoundError, load_models, modules_to_preload
from aeros.skill import ModelError
from tests.unit.models.packages import doubling, gauge, value


def test_a_table_takes_and_gives_si() -> None:
    assert LoadedModel(gauge()).run(level=0.015) == {"volume": pytest.approx(0.25)}


def test_a_network_takes_and_gives_si() -> None:
    assert LoadedModel(doubling()).run(angle=(0.25, -0.5)) == {"turned": (0.5, -1.0)}


def test_a_network_takes_arrays() -> None:
    import numpy as np

    assert LoadedModel(doubling()).run(angle=np.array([0.25, -0.5])) == {"turned": (0.5, -1.0)}


@pytest.mark.parametrize(
    ("inputs", "cause"),
    [
        ({}, "takes `level`, and was given nothing"),
        ({"height": 0.01}, "takes `level`, and was given `height`"),
        ({"level": 0.03}, "`level` is 0.03, outside its range 0 to 0.02"),
        ({"level": math.nan}, "`level` is nan, outside its range"),
        ({"level": "0.01"}, "is a `str` where a number is needed"),
        ({"level": True}, "is a `bool` where a number is needed"),
    ],
)
def test_a_value_outside_the_interface_is_an_error(inputs: dict[str, Any], cause: str) -> None:
    with pytest.raises(ModelError, match=cause):
        LoadedModel(gauge()).run(**inputs)


@pytest.mark.parametrize("angle", [0.1, (0.1,), (0.1, 0.2, 0.3), [(0.1, 0.2)]])
def test_a_value_of_another_shape_is_an_error(angle: object) -> None:
    with pytest.raises(ModelError, match="needed"):
        LoadedModel(doubling()).run(angle=angle)


def test_an_output_outside_its_range_is_an_error() -> None:
    with pytest.raises(ModelError, match=r"`turned` is 1, outside its range -0\.5 to 0\.5"):
        LoadedModel(doubling(upper=0.5)).run(angle=(0.5, 0.0))


def test_an_output_outside_a_checked_bound_cannot_be_caught() -> None:
    bound = CheckedBound("slow", {"angle": ((0.0, 1.0), (-1.0, 1.0))}, {"turned": ((-0.6, 0.6), (-3.0, 3.0))})
    model = LoadedModel(doubling(bound))
    assert model.run(angle=(0.25, 1.0))["turned"] == (0.5, 2.0)
    assert model.run(angle=(-0.5, 1.0))["turned"] == (-1.0, 2.0)  # the bound says nothing there
    with pytest.raises(ModelBoundError, match="outside the bound `slow`"):
        model.run(angle=(0.5, 1.0))
    assert not issubclass(ModelBoundError, Exception)


def test_a_file_has_bytes_and_is_not_called() -> None:
    file = LoadedModel(replace(gauge(b"notes"), kind="file", inputs={}, outputs={}))
    assert file.content == b"notes"
    with pytest.raises(ModelError, match="read its `content`"):
        file.run()


@pytest.mark.parametrize(
    ("package", "cause"),
    [
        (replace(doubling(), content=b"\x00"), "onnxruntime refuses `doubling.onnx`"),
        (
            replace(doubling(), inputs={"q": value(0, 1, shape=(2,))}),
            "the inputs of `doubling.onnx` are `angle`",
        ),
        (replace(doubling(), inputs={"angle": value(0, 1, shape=(3,))}), "the input `angle` of"),
        (doubling(kind=cast("ModelKind", "unknown")), "unknown kind"),
    ],
)
def test_a_file_without_the_interface_is_refused(package: Any, cause: str) -> None:
    with pytest.raises(ModelFileError, match=cause):
        load_models([package])


def test_a_missing_library_is_named_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(ModelFileError, match=r"pip install '\.\[learned\]'"):
        load_models([doubling()])


def test_libraries_are_imported_only_for_models_that_need_them() -> None:
    assert modules_to_preload(["file"]) == ()
    assert modules_to_preload(["table"]) == ("aeros.models.table",)
    assert "onnxruntime" in modules_to_preload(["onnx", "table"])
