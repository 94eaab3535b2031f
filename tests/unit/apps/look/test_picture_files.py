"""PNG files of pictures, read again by Pillow."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from aeros.apps.look.picture_files import save_colours, save_depth
from tests.unit.runtime.perception.perceiving import picture


def test_colours_are_saved_pixel_by_pixel(tmp_path: Path) -> None:
    taken = picture(size=(8, 6))
    save_colours(taken, tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as image:
        assert (image.size, image.mode) == ((8, 6), "RGB")
        assert image.tobytes() == taken.rgb


def test_near_is_white_far_is_black_and_so_is_what_has_no_depth(tmp_path: Path) -> None:
    depth = np.array([0.5, 1.0, np.inf, 1.5], np.float32)
    taken = replace(picture(size=(2, 2)), depth=depth.tobytes())
    saved = save_depth(taken, tmp_path / "d.png")
    assert saved is not None
    assert saved[1:] == (0.5, 1.5)
    with Image.open(tmp_path / "d.png") as image:
        assert (image.size, image.mode) == ((2, 2), "L")
        assert list(image.tobytes()) == [255, 128, 0, 0]


def test_an_even_depth_is_white_and_a_camera_without_depth_has_no_file(tmp_path: Path) -> None:
    even = replace(picture(size=(2, 1)), depth=np.array([1.0, 1.0], np.float32).tobytes())
    save_depth(even, tmp_path / "e.png")
    with Image.open(tmp_path / "e.png") as image:
        assert list(image.tobytes()) == [255, 255]
    assert save_depth(replace(even, depth=None), tmp_path / "n.png") is None
    assert not (tmp_path / "n.png").exists()
