"""Captions show the verdict by its colour, values against their bounds, and the camera's picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageDraw

from aeros.sim.film import overlay as overlay_module
from aeros.sim.film.captions import STATUS_TEXTS, Caption, Detection, Gauge, Status
from aeros.sim.film.overlay import (
    AMBER,
    DETECTED,
    GREEN,
    GREY,
    RED,
    STATUS_COLOURS,
    Overlay,
    gauge_colour,
    legible,
    mark_detections,
)
from aeros.sim.geometry import Camera
from tests.described import described
from tests.reports_in_full import compare_with_section

BLANK = np.full((720, 1280, 3), 255, dtype=np.uint8)


@pytest.mark.parametrize("status", STATUS_TEXTS)
def test_the_badge_has_the_colour_of_the_verdict(status: Status) -> None:
    long = "why " * 200
    drawn = Overlay((1280, 720), long).draw(BLANK, Caption(status, long, long, long, long), "1.0 s")
    assert drawn.shape == BLANK.shape
    assert tuple(drawn[640, 24]) == STATUS_COLOURS[status]
    assert (BLANK == 255).all()
    # Long texts end before the gauges.
    assert (drawn[600:690, 814:828].max(axis=(0, 1)) < 120).all()


@pytest.mark.parametrize(
    ("value", "bound", "is_upper", "colour"),
    [
        (0.1, 0.2, True, GREEN),
        (0.19, 0.2, True, AMBER),
        (0.21, 0.2, True, RED),
        (2.0, 0.9, False, GREEN),
        (1.0, 0.9, False, AMBER),
        (0.8, 0.9, False, RED),
        (0.0, 0.9, False, RED),
        (0.0, 0.0, True, GREEN),
        (0.1, 0.0, True, RED),
        (None, 0.9, False, GREY),
        (0.1, None, True, GREY),
    ],
)
def test_a_gauge_is_red_beyond_its_bound_and_amber_near_it(
    value: float | None, bound: float | None, is_upper: bool, colour: tuple[int, int, int]
) -> None:
    gauge = Gauge("speed", value, bound, is_upper, "m/s", 1.0)
    assert gauge_colour(gauge) == colour
    drawn = Overlay((1280, 720), "").draw(BLANK, Caption(gauges=(gauge,)), "")
    assert value is None or tuple(drawn[601, 968]) == colour


def test_the_picture_of_a_camera_is_in_the_corner() -> None:
    inset = ("camera `top`", Image.new("RGB", (200, 150), (1, 2, 3)))
    overlay = Overlay((1280, 720), "")
    assert tuple(overlay.draw(BLANK, Caption(), "", [inset, inset])[300, 1200]) == (1, 2, 3)
    assert overlay.inset_size()[0] < 300


def test_detections_are_marked_where_the_camera_sees_them() -> None:
    camera = Camera((0.4, 0.0, 1.0), (0.4, 0.0, 0.0), (1.0, 0.0, 0.0), 50.0, 320, 240)
    black = Image.new("RGB", (320, 240))
    behind, aside, ahead = (0.4, 0.0, 2.0), (5.0, 0.0, 0.0), (0.4, 0.0, 0.0)
    detections = [Detection("thing", place) for place in (behind, aside, ahead)]
    marked = np.asarray(mark_detections(black, camera, detections, 1.0))
    rows, columns = np.nonzero(marked.sum(axis=2) > 0)
    assert (abs(rows - 120) < 40).all()
    assert (abs(columns - 160) < 40).all()
    assert tuple(marked[113, 160]) == DETECTED
    small = np.asarray(mark_detections(black, camera, detections, 0.5))
    assert 0 < (small.sum(axis=2) > 0).sum() < (marked.sum(axis=2) > 0).sum() / 3


def test_texts_are_in_letters_that_the_font_has() -> None:
    assert legible("a \u2192 b\n\u2265 1\u00d72 \u4e16") == "a -> b >= 1x2 ?"


class _Font:
    """A font whose letters are all half as wide as high."""

    def __init__(self, size: int) -> None:
        self.size = size

    def getlength(self, text: str) -> float:
        return len(text) * self.size / 2

    def __str__(self) -> str:
        return f"font {self.size}"


@pytest.mark.parametrize("size", [(1280, 720), (640, 360)])
def test_everything_that_is_drawn_on_a_picture(
    size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[str] = []

    class Draw:
        def __init__(self, image: Image.Image, mode: str = "") -> None:
            drawn.append(f"{image.size} {mode}")

        def __getattr__(self, name: str) -> Any:
            return lambda *given, **named: drawn.append(f"{name} {described(given)} {described(named)}")

    monkeypatch.setattr(overlay_module, "_font_of", _Font)
    monkeypatch.setattr(ImageDraw, "Draw", Draw)
    gauges = (
        Gauge("speed", 0.15, 0.2, True, "m/s", 0.5),
        Gauge("person", 12.0, 0.9, False, "m", 3.0),
        Gauge("force", 30.0, None, True, "N", 20.0),
        Gauge("not shown", 1.0, 1.0, True, "m", 1.0),
    )
    of_action = Caption(
        "allowed", "reached", "speed limit", "dumpling.wrap", "wrap a dumpling", gauges=gauges
    )
    empty = Caption(gauges=(Gauge("person", None, None, False, "m", 3.0),))
    overlay = Overlay(size, "make dumplings")
    picture = np.zeros((size[1], size[0], 3), dtype=np.uint8)
    insets = [(name, Image.new("RGB", overlay.inset_size())) for name in ("top", "wrist")]
    for caption in (of_action, empty):
        overlay.draw(picture, caption, "12.5 s", insets)
    long = "one of many words " * 8
    cut = Caption("denied", long, long, long, long)
    Overlay(size, long).draw(picture, cut, "0.0 s")
    camera = Camera((0.4, 0.0, 1.0), (0.4, 0.0, 0.0), (1.0, 0.0, 0.0))
    found = [Detection("dumpling", (0.45, 0.05, 0.02)), Detection("bowl", (0.3, -0.1, 0.0))]
    mark_detections(Image.new("RGB", (320, 240)), camera, found, 1.5)
    expected = Path(__file__).with_name("overlay.txt")
    compare_with_section(expected, f"{size[0]} x {size[1]}", "\n".join(drawn) + "\n")
