"""Colour segmentation: masks of the pixels that have a colour, by ratios of channels or by hue.

Ratios between channels change less with the light than the channels do. Colours have any shape (…, 3),
red, green and blue from 0 to 255; a mask has the shape (…).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Bounds = tuple[float | None, float | None]
"""Lower and upper bound, both exclusive; None for no bound."""

Mask = NDArray[np.bool_]

_DARKEST: Final = 60.0 / 255.0
"""Least value of a pixel whose hue is believed, in [0, 1]."""

_GREYISH: Final = 0.15
"""Saturation below which a colour has no hue."""

_GREY_SPREAD: Final = 0.12
"""Greatest saturation of a pixel of a greyish surface, but for noise."""

_BRIGHTNESS: Final = (0.5, 1.5)
"""Least and greatest brightness of a pixel over that of a greyish surface, in white light and in shade."""

_DARK_NOISE: Final = 0.03
"""Noise of brightness, which counts where a surface is dark."""

_FULL_LIGHT: Final = 0.6
"""Brightness from which a pixel is in full light, in [0, 1]: a floor of 0.75 in light of 0.8."""

_HUE_TOLERANCE: Final = 20.0
"""Greatest difference of hues of one surface, degrees: coloured light and noise shift them."""


def has_dominant_colour(rgb: NDArray[Any], channel: int, ratio: float, brightness: float) -> Mask:
    """Find the pixels in which one channel is much brighter than the two others.

    Args:
        rgb: colours (…, 3), 0 to 255.
        channel: the channel: 0 red, 1 green, 2 blue.
        ratio: least ratio of the channel to each of the others, exclusive.
        brightness: least value of the channel, exclusive.

    Returns:
        Mask (…).
    """
    colours = np.asarray(rgb, np.float64)
    first, second = (colours[..., other] for other in range(3) if other != channel)
    value = colours[..., channel]
    mask: Mask = (value > brightness) & (value > ratio * np.maximum(first, second))
    return mask


def has_red_ratios(rgb: NDArray[Any], green: Bounds, blue: Bounds, brightness: float) -> Mask:
    """Find the pixels of a reddish colour, such as yellow, orange or brown, by their ratios to red.

    Args:
        rgb: colours (…, 3), 0 to 255.
        green: bounds of green over red.
        blue: bounds of blue over red.
        brightness: least red, exclusive.

    Returns:
        Mask (…).
    """
    colours = np.asarray(rgb, np.float64)
    red = colours[..., 0]
    mask: Mask = red > brightness
    for value, (least, most) in ((colours[..., 1], green), (colours[..., 2], blue)):
        if least is not None:
            mask &= value > least * red
        if most is not None:
            mask &= value < most * red
    return mask


def to_hsv(rgb: NDArray[Any]) -> NDArray[np.float64]:
    """Convert colours to hue, saturation and value.

    Args:
        rgb: colours (…, 3), 0 to 255.

    Returns:
        Hue in [0, 360) degrees (0 red, 120 green, 240 blue; 0 for grey), saturation in [0, 1] and value in
        [0, 1]: (…, 3).
    """
    colours = np.asarray(rgb, np.float64) / 255.0
    red, green, blue = (colours[..., channel] for channel in range(3))
    value = colours.max(axis=-1)
    chroma = value - colours.min(axis=-1)
    divisor = np.where(chroma > 0.0, chroma, 1.0)
    sixth = np.where(
        value == red,
        (green - blue) / divisor,
        np.where(value == green, 2.0 + (blue - red) / divisor, 4.0 + (red - green) / divisor),
    )
    hue = np.where(chroma > 0.0, (60.0 * sixth) % 360.0, 0.0)
    saturation = np.where(value > 0.0, chroma / np.where(value > 0.0, value, 1.0), 0.0)
    return np.stack((np.where(hue >= 360.0, 0.0, hue), saturation, value), axis=-1)


def has_hsv_colour(
    rgb: NDArray[Any], hue: tuple[float, float], saturation: float = 0.3, value: float = 0.2
) -> Mask:
    """Find the pixels whose hue is in a range.

    Args:
        rgb: colours (…, 3), 0 to 255.
        hue: first and last hue, degrees; the range goes through 0 if the first is greater.
        saturation: least saturation, in [0, 1]: greyish pixels have no reliable hue.
        value: least value, in [0, 1]: nor have dark ones.

    Returns:
        Mask (…).
    """
    converted = to_hsv(rgb)
    angle = converted[..., 0]
    first, last = hue
    inside = (angle >= first) & (angle <= last) if first <= last else (angle >= first) | (angle <= last)
    mask: Mask = inside & (converted[..., 1] >= saturation) & (converted[..., 2] >= value)
    return mask


def has_colour_of(rgb: NDArray[Any], colour: Sequence[float]) -> Mask:
    """Find the pixels that may show a surface of a colour, in white light of any strength.

    Args:
        rgb: colours (…, 3), 0 to 255.
        colour: the surface's red, green and blue, from 0 to 1.

    Returns:
        Mask (…): hue within 20 degrees of the surface's, and at least half of its saturation. A surface that
        is greyish, with a saturation of less than 0.15, has no hue: of such a one, pixels as little coloured
        that have half to one and a half times its brightness.
    """
    hue, saturation, value = (float(one) for one in to_hsv(np.array([colour]) * 255.0)[0])
    if saturation < _GREYISH:
        colours = np.asarray(rgb, np.float64)
        brightest = colours.max(axis=-1) / 255.0
        spread = brightest - colours.min(axis=-1) / 255.0
        low, high = (share * value for share in _BRIGHTNESS)
        grey: Mask = (brightest >= low - _DARK_NOISE) & (brightest <= high + _DARK_NOISE)
        grey &= spread <= _GREY_SPREAD * brightest + _DARK_NOISE
        return grey
    around = ((hue - _HUE_TOLERANCE) % 360.0, (hue + _HUE_TOLERANCE) % 360.0)
    return has_hsv_colour(rgb, around, saturation / 2.0, _DARKEST)


def is_lit_for(rgb: NDArray[Any], colour: Sequence[float]) -> Mask:
    """Find the pixels with enough light to show a surface of a colour, if it were there.

    No surface reflects more light than it gets, so a bright pixel is well lit. A dark pixel may be a dark
    surface in good light; it counts as too dark.

    Args:
        rgb: colours (…, 3), 0 to 255.
        colour: the surface's red, green and blue, from 0 to 1.

    Returns:
        Mask (…) of the pixels where `has_colour_of` would find the surface. A pixel of 0.6 of white or more
        is always in it; that is enough for surfaces whose brightest channel is 0.4 or more.
    """
    most, least = max(colour), min(colour)
    needed = _BRIGHTNESS[0] if most - least <= _GREYISH * most else min(_FULL_LIGHT, _DARKEST / most)
    lit: Mask = np.asarray(rgb).max(axis=-1) >= 255.0 * needed
    return lit
