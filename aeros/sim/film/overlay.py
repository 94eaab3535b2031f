"""Draw captions over a picture: the verdict with its reason, gauges, and the picture of a camera."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from functools import lru_cache
from math import radians, tan
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from aeros.sim.film.captions import STATUS_TEXTS, Caption, Detection, Gauge, Status
from aeros.sim.geometry import Camera, camera_axes, subtract

Colour = tuple[int, int, int]

GREEN: Final[Colour] = (46, 160, 90)
AMBER: Final[Colour] = (236, 150, 20)
RED: Final[Colour] = (214, 48, 49)
GREY: Final[Colour] = (120, 128, 140)
DETECTED: Final[Colour] = (235, 30, 140)

STATUS_COLOURS: Final[dict[Status, Colour]] = {
    "allowed": GREEN,
    "slowed": AMBER,
    "denied": RED,
    "stopped": RED,
    "waiting": RED,
    "paused": AMBER,
    "reached": GREEN,
    "failed": RED,
    "idle": GREY,
    "unchecked": GREY,
}

_PANEL: Final = (18, 24, 34, 214)
_BRIGHT: Final[Colour] = (245, 247, 250)
_DIM: Final[Colour] = (168, 178, 192)
_TRACK: Final[Colour] = (58, 66, 80)

_HEIGHT: Final = 720
"""Height of a picture for which the sizes below are, pixels."""

_WHOLE: Final = 20.0
"""End of a scale from which on values have no decimals."""

_FAR: Final = 3.0
"""Multiple of the end of a scale beyond which a distance is not told."""

_LABELLED: Final = 0.7
"""Height of a picture over 720 pixels below which detections have no labels: they would cover it."""

_NEAR_BOUND: Final = 0.85
"""Share of a bound above which a gauge is amber."""


class Overlay:
    """Draws captions on pictures of one size.

    Args:
        size: width and height, pixels.
        title: text at the top.
    """

    def __init__(self, size: tuple[int, int], title: str) -> None:
        self._width, self._height = size
        self._unit = self._height / _HEIGHT
        self._title = title

    def draw(
        self,
        picture: NDArray[np.uint8],
        caption: Caption,
        clock: str,
        insets: Sequence[tuple[str, Image.Image]] = (),
    ) -> NDArray[np.uint8]:
        """Draw a caption.

        Args:
            picture: the picture (height, width, 3); it is not changed.
            caption: the caption.
            clock: text about the time.
            insets: labels and pictures of cameras, one below the other.

        Returns:
            The picture with the caption.
        """
        image = Image.fromarray(np.ascontiguousarray(picture)).convert("RGB")
        draw = ImageDraw.Draw(image, "RGBA")
        self._draw_title(draw, clock)
        self._draw_panel(draw, caption)
        top = self._scaled(20)
        for label, inset in insets:
            top = self._draw_inset(image, draw, label, inset, top)
        return np.asarray(image)

    def inset_size(self) -> tuple[int, int]:
        """Compute the size of an inset.

        Returns:
            Its greatest width and height, pixels.
        """
        return self._scaled(272), self._scaled(204)

    # Internals.

    def _scaled(self, length: float) -> int:
        return max(1, round(length * self._unit))

    def _font(self, size: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
        return _font_of(max(9, round(size * self._unit)))

    def _text(
        self, draw: ImageDraw.ImageDraw, place: tuple[float, float], text: str, size: float, colour: Colour
    ) -> None:
        draw.text(place, legible(text), fill=colour, font=self._font(size))

    def _cut(self, text: str, size: float, width: float) -> str:
        """Shorten a text to a width in pixels."""
        font = self._font(size)
        shown = legible(text)
        if font.getlength(shown) <= width:
            return shown
        lengths = range(len(shown) + 1)
        kept = bisect_right(lengths, width, key=lambda length: font.getlength(shown[:length] + "..."))
        return shown[: max(0, kept - 1)].rstrip() + "..."

    def _draw_title(self, draw: ImageDraw.ImageDraw, clock: str) -> None:
        u, margin = self._scaled, self._scaled(20)
        title = self._cut(self._title, 24, 0.5 * self._width)
        width = max(self._font(24).getlength(title), self._font(17).getlength(clock)) + 2 * u(16)
        draw.rounded_rectangle((margin, margin, margin + width, margin + u(70)), u(10), fill=_PANEL)
        self._text(draw, (margin + u(16), margin + u(9)), title, 24, _BRIGHT)
        self._text(draw, (margin + u(16), margin + u(42)), clock, 17, _DIM)

    def _draw_panel(self, draw: ImageDraw.ImageDraw, caption: Caption) -> None:
        u, margin = self._scaled, self._scaled(20)
        left, right = margin, self._width - margin
        top, bottom = self._height - margin - u(126), self._height - margin
        colour = STATUS_COLOURS[caption.status]
        draw.rounded_rectangle((left, top, right, bottom), u(12), fill=_PANEL)
        draw.rounded_rectangle((left, top, left + u(10), bottom), u(5), fill=colour)
        badge, size = STATUS_TEXTS[caption.status], 25
        width = self._font(size).getlength(badge) + u(28)
        draw.rounded_rectangle(
            (left + u(26), top + u(14), left + u(26) + width, top + u(52)), u(8), fill=colour
        )
        self._text(draw, (left + u(40), top + u(18)), badge, size, (255, 255, 255))
        gauges_left = right - u(430)
        room = gauges_left - left - u(46)
        described = self._cut(caption.action, 20, room - width - u(16))
        self._text(draw, (left + u(26) + width + u(16), top + u(22)), described, 20, _BRIGHT)
        self._text(draw, (left + u(26), top + u(62)), self._cut(caption.headline, 20, room), 20, _BRIGHT)
        below = "   ".join(part for part in (caption.skill, caption.rule) if part)
        self._text(draw, (left + u(26), top + u(94)), self._cut(below, 16, room), 16, _DIM)
        for number, gauge in enumerate(caption.gauges[:3]):
            self._draw_gauge(draw, gauge, gauges_left, top + u(14 + 37 * number), u(410))

    def _draw_gauge(
        self, draw: ImageDraw.ImageDraw, gauge: Gauge, left: float, top: float, width: float
    ) -> None:
        u = self._scaled
        bar_left, bar_right = left + u(132), left + width - u(104)
        self._text(draw, (left, top + u(2)), gauge.label, 16, _DIM)
        draw.rounded_rectangle((bar_left, top + u(5), bar_right, top + u(19)), u(5), fill=_TRACK)
        if gauge.value is not None:
            share = min(1.0, max(0.0, gauge.value / gauge.full))
            end = bar_left + max(u(6), share * (bar_right - bar_left))
            draw.rounded_rectangle((bar_left, top + u(5), end, top + u(19)), u(5), fill=gauge_colour(gauge))
            digits = 2 if gauge.full < _WHOLE else 0
            shown = f"{gauge.value:.{digits}f} {gauge.unit}"
            if not gauge.is_upper and gauge.value > _FAR * gauge.full:
                shown = "far"
            self._text(draw, (bar_right + u(10), top + u(1)), shown, 17, _BRIGHT)
        if gauge.bound is not None:
            at = bar_left + min(1.0, max(0.0, gauge.bound / gauge.full)) * (bar_right - bar_left)
            draw.rectangle((at - u(1.5), top, at + u(1.5), top + u(24)), fill=_BRIGHT)

    def _draw_inset(
        self, image: Image.Image, draw: ImageDraw.ImageDraw, label: str, inset: Image.Image, top: int
    ) -> int:
        """Draw an inset; return the height at which the next one is."""
        u, margin = self._scaled, self._scaled(20)
        left = self._width - margin - inset.width
        bottom = top + inset.height + u(34)
        draw.rounded_rectangle((left - u(6), top, self._width - margin + u(6), bottom), u(8), fill=_PANEL)
        image.paste(inset, (left, top + u(6)))
        self._text(draw, (left + u(2), top + inset.height + u(9)), label, 15, _DIM)
        return bottom + u(12)


def mark_detections(
    picture: Image.Image, camera: Camera, detections: Sequence[Detection], unit: float
) -> Image.Image:
    """Mark what was detected in the picture of a camera.

    Args:
        picture: the picture.
        camera: the camera that took it.
        detections: what was detected.
        unit: size of a pixel of a picture 720 pixels high, pixels.

    Returns:
        The picture with a ring and a label at each place that is in it.
    """
    image = picture.copy()
    draw = ImageDraw.Draw(image)
    right, up, ahead = camera_axes(camera)
    scale = image.height / 2.0 / tan(radians(camera.field_of_view) / 2.0)
    for label, position in detections:
        away = subtract(position, camera.eye)
        x, y, z = (sum(a * b for a, b in zip(axis, away, strict=True)) for axis in (right, up, ahead))
        if z <= 0.0:
            continue
        at = (image.width / 2.0 + scale * x / z, image.height / 2.0 - scale * y / z)
        if not (0 <= at[0] < image.width and 0 <= at[1] < image.height):
            continue
        radius = 7.0 * unit
        ring = (at[0] - radius, at[1] - radius, at[0] + radius, at[1] + radius)
        draw.ellipse(ring, outline=DETECTED, width=max(1, round(2 * unit)))
        if unit < _LABELLED:
            continue
        font = _font_of(max(8, round(12 * unit)))
        width = font.getlength(legible(label))
        place = (min(max(0.0, at[0] - width / 2.0), image.width - width), at[1] + radius)
        draw.text(
            place, legible(label), fill=(255, 255, 255), font=font, stroke_width=2, stroke_fill=(20, 20, 30)
        )
    return image


def gauge_colour(gauge: Gauge) -> Colour:
    """Choose the colour of a gauge.

    Args:
        gauge: the gauge.

    Returns:
        Red if the bound is broken, amber near it, else green; grey without a bound.
    """
    if gauge.value is None or gauge.bound is None:
        return GREY
    if gauge.bound <= 0.0:
        return RED if gauge.is_upper and gauge.value > gauge.bound else GREEN
    used = gauge.value / gauge.bound if gauge.is_upper else gauge.bound / max(gauge.value, 1e-9)
    if used > 1.0 + 1e-3:
        return RED
    return AMBER if used > _NEAR_BOUND else GREEN


@lru_cache(maxsize=16)
def _font_of(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


_PLAIN: Final = str.maketrans(
    {"\u2192": "->", "\u2265": ">=", "\u2264": "<=", "\u00d7": "x", "\u2013": "-", "\u2026": "..."}
)


def legible(text: str) -> str:
    """Replace characters that Pillow's font does not have.

    Args:
        text: any text.

    Returns:
        The text in Latin letters, on one line.
    """
    plain = " ".join(text.translate(_PLAIN).split())
    return "".join(one if one < "\u0100" or one in "\u201c\u201d\u2018\u2019" else "?" for one in plain)
