"""Masks of the pixels that have a colour."""

from __future__ import annotations

import colorsys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.perception.colours import (
    has_colour_of,
    has_dominant_colour,
    has_hsv_colour,
    has_red_ratios,
    is_lit_for,
    to_hsv,
)

CHANNEL = st.integers(0, 255)
COLOUR = st.tuples(CHANNEL, CHANNEL, CHANNEL)


@given(st.lists(COLOUR, min_size=1, max_size=20))
def test_hsv_is_that_of_the_standard_library(colours: list[tuple[int, int, int]]) -> None:
    converted = to_hsv(np.array(colours, np.uint8))
    for colour, (hue, saturation, value) in zip(colours, converted, strict=True):
        expected = colorsys.rgb_to_hsv(*(part / 255.0 for part in colour))
        apart = abs(hue - 360.0 * expected[0]) % 360.0
        assert min(apart, 360.0 - apart) < 1e-9
        assert (saturation, value) == pytest.approx(expected[1:])
        assert 0.0 <= hue < 360.0


@pytest.mark.parametrize(
    ("colour", "channel", "found"),
    [
        ((200, 90, 90), 0, True),
        ((200, 101, 0), 0, False),
        ((50, 0, 0), 0, False),  # too dark
        ((0, 200, 90), 1, True),
        ((0, 90, 200), 2, True),
        ((0, 200, 90), 2, False),
    ],
)
def test_a_dominant_channel_is_brighter_than_both_others(
    colour: tuple[int, int, int], channel: int, found: bool
) -> None:
    picture = np.full((2, 3, 3), colour, np.uint8)
    mask = has_dominant_colour(picture, channel, 2.0, 50.0)
    assert mask.shape == (2, 3)
    assert mask.all() == mask.any() == found


@pytest.mark.parametrize(
    ("colour", "found"),
    [((200, 150, 50), True), ((200, 100, 50), False), ((200, 150, 110), False), ((40, 30, 10), False)],
)
def test_a_yellow_pixel_has_much_green_and_little_blue(colour: tuple[int, int, int], found: bool) -> None:
    assert bool(has_red_ratios(np.array(colour), (0.6, None), (None, 0.5), 60.0)) == found


def test_ratios_have_bounds_on_both_sides() -> None:
    colours = np.array([[100, 50, 30], [100, 80, 30], [100, 50, 10]], np.uint8)
    assert has_red_ratios(colours, (0.4, 0.7), (0.2, 0.4), 0.0).tolist() == [True, False, False]


def test_a_range_of_hues_may_go_through_red() -> None:
    colours = np.array([[200, 20, 40], [200, 40, 20], [20, 200, 20], [100, 95, 95], [20, 2, 4]], np.uint8)
    assert has_hsv_colour(colours, (340.0, 20.0)).tolist() == [True, True, False, False, False]
    assert has_hsv_colour(colours, (100.0, 140.0)).tolist() == [False, False, True, False, False]


@pytest.mark.parametrize("colour", [(0.8, 0.1, 0.08), (0.15, 0.3, 0.75), (0.9, 0.8, 0.1), (0.1, 0.6, 0.2)])
def test_a_surface_has_its_colour_in_any_light_and_no_other(colour: tuple[float, float, float]) -> None:
    shades = np.array([[round(255 * one * light) for one in colour] for light in (0.5, 0.7, 1.0)], np.uint8)
    assert has_colour_of(shades, colour).all()
    grey, turned = np.array([[128, 128, 128], [20, 20, 20]], np.uint8), shades[:, [1, 2, 0]]
    assert not has_colour_of(grey, colour).any()
    assert not has_colour_of(turned, colour).any()


def test_a_greyish_surface_is_found_by_its_brightness() -> None:
    shades = np.array([[130, 128, 126], [70, 72, 70], [180, 180, 185]], np.uint8)
    others = np.array([[150, 135, 112], [250, 250, 250], [30, 30, 30], [20, 30, 120]], np.uint8)
    assert has_colour_of(shades, (0.5, 0.5, 0.5)).all()
    assert not has_colour_of(others, (0.5, 0.5, 0.5)).any()
    assert has_colour_of(np.array([[8, 14, 10], [20, 18, 15]], np.uint8), (0.05, 0.05, 0.05)).all()
    assert not has_colour_of(shades, (0.05, 0.05, 0.05)).any()


@pytest.mark.parametrize(
    "colour", [(0.8, 0.1, 0.08), (0.15, 0.3, 0.75), (0.4, 0.1, 0.1), (0.5, 0.5, 0.5), (0, 0, 0)]
)
@pytest.mark.parametrize("surface", [0.3, 1.0])
def test_where_a_pixel_is_lit_a_surface_would_show_its_colour(
    colour: tuple[float, float, float], surface: float
) -> None:
    lights = np.linspace(0.0, 1.0, 101)
    pixels = np.rint(255.0 * surface * lights[:, None] * np.ones(3)).astype(np.uint8)
    of_it = np.rint(255.0 * lights[:, None] * np.array(colour)).astype(np.uint8)
    lit = is_lit_for(pixels, colour)
    assert not (lit & ~has_colour_of(of_it, colour)).any()
    assert lit[-1] == (surface == 1.0 or colour == (0.8, 0.1, 0.08))
    assert not lit[:20].any()
