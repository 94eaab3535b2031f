"""Wrappers and fillings as they were found, and a wrapper that is followed from picture to picture."""

from dataclasses import dataclass
from math import cos, dist, pi, sin
from typing import NamedTuple

import numpy as np

from .hand import in_frame, is_within_reach
from .measures import FILLING_HEIGHT, HINGE_TO_PLATE, PLATE_HALF, POT_DEPTH, POT_HALF, WRAPPER_HALF, Place

CLOSED_FOLD = 160.0 * pi / 180.0
"""Least fold of a closed wrapper, rad."""

LARGEST = 1.12
"""Greatest size of a wrapper that the press closes over the usual one: one of 1.2 is 34 mm thick when it is
closed, and lid and bed are 28 mm apart, so that the lid pushes it out."""

ON_PLATE_WITHIN = 0.006
"""Greatest distance of a filling on the plate from its height at rest, m."""

FILLING_APART = 0.05
"""Greatest distance of a filling from the middle of the wrapper that it may be in, m."""

MOST_PRESSES = 2
"""Times that the lid comes down on a wrapper that then lies open, after which it is known not to fold."""


class Filling(NamedTuple):
    """A filling that was found: its middle, and the heading of one of its sides."""

    middle: Place
    yaw: float


class Wrapper(NamedTuple):
    """A wrapper that was found: its hinge, the heading of plate A from it, its fold, and its size.

    The fold is 0 open, and None if it is not visible, as of a wrapper on its edge. The scale is its size over
    the usual one; None where no plate shows that.
    """

    hinge: Place
    yaw: float
    fold: float | None
    scale: float | None = None

    @property
    def size(self) -> float:
        """Size over the usual one, which it has where the picture does not show it."""
        return self.scale or 1.0

    @property
    def half(self) -> tuple[float, float]:
        """Half its length and width, around its grip, m."""
        length, width = PLATE_HALF[:2] if self.is_closed else WRAPPER_HALF
        return (length * self.size, width * self.size)

    def scaled(self, scale: float | None) -> "Wrapper":
        """The same wrapper at the same place, of that size."""
        return Wrapper(self.hinge, self.yaw, self.fold, scale)

    @property
    def is_closed(self) -> bool:
        """True unless it is seen to be open."""
        return self.fold is None or self.fold > CLOSED_FOLD

    @property
    def middle(self) -> Place:
        """The middle of plate A."""
        x, y, z = self.hinge
        away = HINGE_TO_PLATE * self.size
        return (x + away * cos(self.yaw), y + away * sin(self.yaw), z)

    @property
    def grip(self) -> Place:
        """Middle of the hand that grips it: across its hinge, or of a closed one across its plates."""
        return self.middle if self.fold is not None and self.is_closed else self.hinge

    def carries(self, filling: Place) -> bool:
        """Return True if a filling's middle is over plate A, about as high as it rests there."""
        above = filling[2] - self.hinge[2] - PLATE_HALF[2] - FILLING_HEIGHT / 2
        return self.is_under(filling) and abs(above) < ON_PLATE_WITHIN

    def is_under(self, filling: Place) -> bool:
        """Return True if a filling's middle is over plate A, at any height."""
        along, across = in_frame(np.array((filling,)), self.middle, self.yaw)
        within = (np.abs(along) < PLATE_HALF[0] * self.size) & (np.abs(across) < PLATE_HALF[1] * self.size)
        return bool(within.all())


@dataclass(frozen=True)
class Piece:
    """A wrapper that is followed from picture to picture.

    Attributes:
        wrapper: as it was seen last.
        looks: number of pictures that showed it.
        unseen: number of pictures since, which did not.
        is_wrapped: it is a dumpling: it was pressed, seen filled from the side, and not seen open since.
        is_pressed: the lid has pressed on it with a load that seals.
        is_pressed_anew: it has since the last picture from the side.
        was_open: it was seen open, so that it has hidden no filling from the start.
        is_shut: it is closed, empty or with a filling that sticks out, and no hand of this robot opens it.
        failures: how often the lid has pressed on it, and then it was closed and no dumpling.
        presses: how often the lid came down on it and left it open, or it came to lie too high for that.
        tries: number of pictures since it moved in which it was in work and not on the press.
        in_pot_since: time of the first picture of it at its place in the pot, s; None outside of it.
        in_pot_at: that place.
    """

    wrapper: Wrapper
    looks: int = 1
    unseen: int = 0
    is_wrapped: bool = False
    is_pressed: bool = False
    is_pressed_anew: bool = False
    was_open: bool = False
    is_shut: bool = False
    failures: int = 0
    presses: int = 0
    tries: int = 0
    in_pot_since: float | None = None
    in_pot_at: Place | None = None

    @property
    def is_stiff(self) -> bool:
        """True if it does not fold: it lies upside down, and the hand, which points down, cannot turn it."""
        return self.presses >= MOST_PRESSES

    @property
    def is_within_reach(self) -> bool:
        """True if the hand can grip it, or push it to where it can."""
        return is_within_reach(self.wrapper.grip)

    @property
    def is_too_large(self) -> bool:
        """True if the press does not close over it."""
        return self.wrapper.size > LARGEST and not self.is_wrapped

    @property
    def is_useless(self) -> bool:
        """True if it is no dumpling, and none can be made of it."""
        return self.is_shut or self.is_stiff or self.is_too_large


def is_near(filling: Place, wrapper: Wrapper) -> bool:
    """Return True if a filling may be in a wrapper."""
    return dist(filling, wrapper.middle) < FILLING_APART


def is_in_pot(place: Place, opening: Place | None, margin: float = 0.0) -> bool:
    """Return True if a place is in the pot with that middle of its opening; False if no pot is known.

    `margin` is its least distance from the pot's sides, m.
    """
    if opening is None:
        return False
    dx, dy, dz = (a - b for a, b in zip(place, opening, strict=True))
    is_within = abs(dx) < POT_HALF[0] - margin and abs(dy) < POT_HALF[1] - margin
    return is_within and -POT_DEPTH < dz < 0.0
