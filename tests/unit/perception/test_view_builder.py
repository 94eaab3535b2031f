"""Views are built from bytes without copying them, and cannot change them."""

from __future__ import annotations

import numpy as np
import pytest

from aeros.perception.view import Sample
from aeros.perception.view_builder import PictureData, build_view

DATA = PictureData(
    "mast", 1.5, (2, 1), bytes(range(6)), np.array([1.0, 2.0], np.float32).tobytes(),
    (0.0, 0.0, 2.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 45.0, (4, 2),
)  # fmt: skip


def test_a_view_has_pictures_by_camera_and_samples_by_name() -> None:
    view = build_view(2.0, {"force": 3.0}, {"force": [(1.0, 2.0), (1.5, 4.0)]}, [DATA])
    picture = view.pictures["mast"]
    assert (view.time, view.readings, picture.time) == (2.0, {"force": 3.0}, 1.5)
    assert view.samples == {"force": (Sample(1.0, 2.0), Sample(1.5, 4.0))}
    assert picture.rgb.tolist() == [[[0, 1, 2], [3, 4, 5]]]
    assert picture.depth is not None
    assert picture.depth.tolist() == [[1.0, 2.0]]
    assert (picture.eye, picture.field_of_view, picture.full_size) == ((0.0, 0.0, 2.0), 45.0, (4, 2))


def test_a_picture_is_the_memory_it_was_built_from_and_read_only() -> None:
    memory = bytearray(DATA.rgb)
    picture = build_view(
        0.0, {}, {}, [DATA._replace(rgb=memoryview(memory).toreadonly(), depth=None)]
    ).pictures["mast"]
    memory[0] = 99
    assert picture.rgb[0, 0, 0] == 99
    assert picture.depth is None
    with pytest.raises(ValueError, match="read-only"):
        picture.rgb[0, 0, 0] = 1
