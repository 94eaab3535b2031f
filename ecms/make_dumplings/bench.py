"""The bench: all that pictures have shown of wrappers and fillings, and what follows at once."""

from dataclasses import dataclass, field
from math import dist

import numpy as np

from aeros.perception import Points

from .hand import in_frame
from .measures import CLOSED_HEIGHT, ON_PRESS_WITHIN, OUTLINE, PLATE_HALF, Place
from .wrappers import Filling, Piece, Wrapper, is_in_pot, is_near

LEANING = 0.015
"""Least distance of a settled dumpling's middle from the pot's sides, m: less than half of its width, so one
that lies flat in the pot keeps it."""

NEAR_PRESS = 0.06
"""Greatest distance of the hinge of a wrapper on the press, or nearly so, from its place, level, m."""

OVER_EDGE = 0.03
"""Depth of the hinge below its place from which a wrapper lies beside the press, m."""


@dataclass(frozen=True)
class Bench:
    """All that pictures have shown of wrappers and fillings on the bench.

    Attributes:
        pieces: the wrappers, but for those of cooked dumplings.
        settled: middles of the cooked dumplings in the pot.
        most_fillings: the largest number of fillings that was seen, those in cooked dumplings included.
        is_shown: the last picture shows the bench itself.
        hidden_place: middle of the largest part of it that this picture does not show, as behind a high box;
            None if each part is too small for a wrapper.
        lift: height of the bench, surveyed as 0.
        work: number of the wrapper that is worked on.
        fillings: those that the last picture shows.
        surroundings: points (n, 3) of it that are over the bench.
        press: where a hinge belongs on the press.
        pot: middle of the pot's opening.
        is_pressed: the lid has pressed since the last picture with a load that seals.
        is_lid_over: it was over the wrapper since then.
        is_lid_open: it is open.
        is_held: the hand may hold something.
        holds_filling: its fingers are as far apart as a filling is wide.
        count: number of dumplings that are asked for.
    """

    pieces: tuple[Piece, ...] = ()
    settled: tuple[Place, ...] = ()
    most_fillings: int = 0
    is_shown: bool = False
    hidden_place: Place | None = None
    lift: float = 0.0
    work: int | None = None
    fillings: tuple[Filling, ...] = ()
    surroundings: Points = field(default_factory=lambda: np.empty((0, 3)))
    press: Place | None = None
    pot: Place | None = None
    is_pressed: bool = False
    is_lid_over: bool = False
    is_lid_open: bool = False
    is_held: bool = False
    holds_filling: bool = False
    count: int = 1

    @property
    def in_work(self) -> Piece | None:
        """The wrapper that is worked on."""
        return None if self.work is None else self.pieces[self.work]

    @property
    def hidden(self) -> int:
        """Number of fillings that no picture shows any more, and that the hand does not hold."""
        return self.most_fillings - len(self.settled) - len(self.fillings) - int(self.holds_filling)

    @property
    def may_hold_wrapper(self) -> bool:
        """True if the hand may hold a wrapper."""
        return self.is_held and not self.holds_filling

    def is_inside(self, filling: Place, piece: Piece) -> bool:
        """Return True if a filling that is seen is within a dumpling, as where one on its edge is open."""
        wrapper = piece.wrapper
        along, across = in_frame(np.array((filling,)), wrapper.middle, wrapper.yaw)
        above = filling[2] - wrapper.hinge[2]
        size = wrapper.size
        is_low = above < (wrapper.hinge[2] - self.lift if wrapper.fold is None else CLOSED_HEIGHT * size)
        is_within = (np.abs(along) < PLATE_HALF[0] * size + OUTLINE) & (
            np.abs(across) < PLATE_HALF[1] * size + OUTLINE
        )
        return piece.is_wrapped and is_low and bool(is_within.all())

    def is_whole_in_pot(self, piece: Piece) -> bool:
        """Return True if a wrapper is in the pot and no filling lies at it, but outside of the pot.

        The middle of one that leans at the pot from outside may be measured within it, near its side.
        """
        spilt = [
            one.middle
            for one in self.fillings
            if is_near(one.middle, piece.wrapper) and not self.is_inside(one.middle, piece)
        ]
        return is_in_pot(piece.wrapper.middle, self.pot, LEANING) and all(
            is_in_pot(one, self.pot) for one in spilt
        )

    def is_perched(self, wrapper: Wrapper) -> bool:
        """Return True if a wrapper on the press lies too high, as on a filling: so it does not fold."""
        if self.press is None or dist(wrapper.hinge[:2], self.press[:2]) > NEAR_PRESS:
            return False
        return wrapper.hinge[2] - self.press[2] > ON_PRESS_WITHIN[1]

    def is_on_press(self, piece: Piece) -> bool:
        """Return True if a wrapper lies on the press, or nearly so."""
        if self.press is None:
            return False
        away, above = dist(piece.wrapper.hinge[:2], self.press[:2]), piece.wrapper.hinge[2] - self.press[2]
        return away < NEAR_PRESS and above > -OVER_EDGE
