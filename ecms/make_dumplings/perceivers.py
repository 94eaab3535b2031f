"""State of the dumplings: wrappers and fillings in pictures, and the force of the press on what is in it.

One wrapper is worked on at a time: one in the pot that is not cooked yet, else one on the press, else any.
Cooked dumplings stay in the pot and are counted.

A plate of the wrapper is the plane through its points and the rectangle around them: plates are told apart
by their colour, and the fold is the angle of their planes. From the side, what shows between the plates is in
the dumpling. All lengths in metres, angles in radians, in the world frame; the bench is level, so a picture
in which it slopes is of a tilted camera, and is levelled first.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import acos, atan2, cos, dist, pi, sin, sqrt
from typing import Any, NamedTuple

import numpy as np

from aeros.perception import (
    Mask,
    Perception,
    Picture,
    Points,
    Rectangle,
    View,
    believe_height,
    estimate,
    has_dominant_colour,
    has_red_ratios,
    level_ground,
    min_area_rectangle,
    separate_parts,
    smooth_colours,
    trim_to_plane,
    upper_points,
    without_specks,
    wrap_heading,
)

Place = tuple[float, float, float]

Values = dict[str, tuple[Any, ...]]
"""Value and uncertainty of each variable; the value alone if it is certain."""

HINGE_TO_PLATE = 0.022
"""Distance of the middle of plate A from the wrapper's hinge, m."""

PLATE_HALF = (0.021, 0.028, 0.003)
"""Half edges of a plate, m."""

CLOSED_HEIGHT = 0.025
"""Height of the outside of plate B above the middle of plate A when closed, m."""

CLOSED_MIDDLE, CLOSED_ROOM = (HINGE_TO_PLATE, 0.0, 0.011), (0.05, 0.05, 0.04)
"""Middle of a closed wrapper from its hinge, along, across and up, and half of the room that it is looked for
in, m."""

OFF_SIDE = 0.02
"""Greatest distance of a wrapper in a picture from the side from where it was seen from above, m."""

CLOSED_FOLD = 160.0 * pi / 180.0
"""Least fold of a closed wrapper, rad."""

SAME_SIZE = 0.08
"""Difference of a wrapper's size from the usual one, as a share of it, that the picture makes."""

SIZES = (0.8, 1.3)
"""Least and greatest size of a wrapper over the usual one."""

LARGEST = 1.12
"""Greatest size of a wrapper that the press closes over the usual one: one of 1.2 is 34 mm thick when it is
closed, and lid and bed are 28 mm apart, so that the lid pushes it out."""

SQUARELY = 0.12
"""Greatest difference of the ratio of its sides from that of a plate, as a share, where all of it shows."""

LEVEL = 0.95
"""Least vertical part of the normal of a plate that does not look too short."""

FILLING_HEIGHT = 0.017
"""Height of the filling, m."""

ON_PLATE_WITHIN = 0.006
"""Greatest distance of a filling on the plate from its height at rest, m."""

ON_PRESS_WITHIN = (0.04, 0.015)
"""Greatest distance of the hinge from its place on the press, level and in height, m."""

ALIGNED_WITHIN = (0.008, 0.010, 0.006)
"""Greatest distance of an aligned hinge from its place along x, y and z, m."""

ALIGNED_YAW = 8.0 * pi / 180.0
"""Greatest heading of an aligned wrapper, rad."""

POT_HALF, POT_DEPTH = (0.08, 0.085), 0.05
"""Half of the pot's inner length and width, m, and from its floor to its surveyed opening."""

COOKING_TIME = 5.0
"""Time in the pot after which a dumpling is cooked, s."""

SEALING_LOAD = 3.0
"""Load on the press's bed above which the lid presses on a closed wrapper, N. Wrapper and filling weigh
1.3 N; from 3 N on, more than 1 N is on the filling, which seals."""

MAX_HEIGHT = 0.20
"""Greatest height of an object on the bench, m: above it is the arm."""

NEAR_BENCH = 0.045
"""Greatest height of a point that the bench is fitted to, m: stands are 50 mm high."""

OFF_BENCH = 0.004
"""Greatest distance from its plane of such a point, m: the pot's floor is 5 mm up."""

MIN_BENCH = 1000
"""Least number of pixels of the bench: a picture with fewer shows no bench."""

UNNOTICED = 0.012
"""Greatest displacement of a camera that nobody notices, m: a bench that is seen higher or lower by more
is."""

MIN_PIXELS = 25
"""Least number of pixels of an object: fewer are noise, or an object that is mostly hidden."""

MIN_FILLING_PIXELS = 6
"""Least number of pixels of the filling between the plates of a filled wrapper."""

MIN_PATCH = 4
"""Least number of pixels of a patch of one colour: fewer are noise."""

MIN_GREEN = 30
"""Least green of a pixel of the filling (of 255): darker ones have no colour that noise leaves."""

MIN_BRIGHTNESS = 60
"""Least red of a pixel of a plate (of 255)."""

PLATE_COLOURS = (((0.75, 1.1), 0.5), ((0.42, 0.72), 0.4))
"""Colours of plates A and B: bounds of green over red, and upper bound of blue over red."""

GREEN_DOMINANCE = 1.3
"""Least ratio of green to red and to blue in a pixel of the filling."""

MIN_VISIBLE_AREA = 0.6
"""Least visible share of a plate's area at which its rectangle locates the plate."""

EDGE_ON_WIDTH = 0.015
"""Width of a plate's rectangle below which it stands on its edge, m."""

PLANE_TOLERANCE = 0.003
"""Greatest distance of a plate's points from its plane, m; farther ones are on its sides."""

UNCERTAINTY = 0.004
"""Standard uncertainty of a place, m: a pixel is 3 mm."""

ANGLE_UNCERTAINTY = 0.06
"""Standard uncertainty of a heading and of the fold, rad."""

BETWEEN_HEIGHTS = 0.045
"""Height between things that lie on the bench and things on press, trays and stands, m."""

SAME_PLATE = 0.04
"""Distance of two parts of one colour below which they are of one plate, m: it is 42 mm long."""

PLATES_APART = 0.056
"""Greatest distance of the middles of a wrapper's plates, m: 44 mm if it is open, and plates of two wrappers
side by side are as far apart as they are wide."""

FILLING_APART = 0.05
"""Greatest distance of a filling from the middle of the wrapper that it may be in, level, m."""

NEAR_PRESS = 0.06
"""Greatest distance of the hinge of a wrapper on the press, or nearly so, from its place, level, m."""

OVER_EDGE = 0.03
"""Depth of the hinge below its place from which a wrapper lies beside the press, m."""

SETTLED_WITHIN = 0.045
"""Points nearer than this to the middle of a cooked dumpling, level, are of it, m."""

SETTLED_PIXELS = 120
"""Least number of pixels of another dumpling in the pot beside a cooked one, which may have been bumped: half
of its top."""

UNSEEN = (
    "filling_position",
    "filling_yaw",
    "filling_has_room",
    "other_filling_position",
    "wrapper_position",
    "wrapper_yaw",
    "wrapper_fold",
    "wrapper_has_room",
    "other_wrapper_position",
    "press_free",
    "blocker_position",
    "blocker_yaw",
    "blocker_is_filling",
    "aside_place",
    "pot_place",
    "push_start",
    "push_end",
    "push_yaw",
    "dough_on_workspace",
    "filling_on_workspace",
    "wrapper_aligned",
)
"""Variables that are unknown where the last picture from above does not show what they are of."""

GONE = ("dough_on_workspace", "filling_on_workspace", "wrapper_aligned", "dumpling_wrapped")
"""Variables that are false once the last dumpling is in the pot."""

EMPTY = ("dough_on_workspace", "filling_on_workspace", "wrapper_aligned")
"""Variables that are false once the wrapper on the press is found to be shut without a filling."""

MOST_PRESSES = 2
"""Times that the lid comes down on a wrapper that then lies open, after which it is known not to fold."""

MOST_TRIES = 6
"""Pictures after which a wrapper that stays where it is gives way to another: the hand does not get it."""

LID_OVER = 0.03
"""Distance of the handle from the press's hinge, towards +x, from which the lid is over the wrapper, m."""

OUTLINE = 0.005
"""Distance from the outline of a thing within which a point is still of it, m."""

STIRRED = 0.008
"""Displacement of a dumpling in the pot after which it may have been out of it, m."""

OVER_BENCH = 0.006
"""Height over the bench above which something lies there, m."""

WRAPPER_HALF, FILLING_HALF = (0.043, 0.028), (0.011, 0.011)
"""Half the length and width of an open wrapper around its hinge, and of the filling, m."""

LOWEST = 0.012
"""Height of the lowest grasp, m."""

BED = ((-0.05, 0.05), 0.03)
"""Where a filling lies on the press, from where the hinge belongs: along x, and to either side, m."""

ASIDES = (tuple(0.38 + 0.04 * step for step in range(6)), tuple(-0.30 + 0.04 * step for step in range(16)))
"""Places along x and y on the bench where things that are in the way may be put, m."""

ASIDE_HEIGHT, SPARE = 0.02, 0.012
"""Height of the tool there, and free space around the largest thing, m."""

PUSH_HEIGHT = 0.02
"""Height of the tool that pushes a thing which is at least 17 mm high, m: the hand is over stands and pot."""

PUSHED_HEIGHT = 0.03
"""Greatest height of the middle of a thing on the bench that fingers push, m."""

STRAIGHT = 0.2
"""Heading below which a filling is gripped as if it lay straight, rad: as few pixels show it."""

ON_SIDE = 0.0042
"""Height over that of a filling that lies flat above which it lies on its side, m: it is 22 mm high then, and
not 17 mm."""

GRASPS = ((0.28, 0.62), (-0.36, 0.37))
"""Where the tool may be along x and y, m."""

REACH = ((0.31, 0.62), (-0.36, 0.37), (-0.03, 0.20))
"""Where a thing is that the hand can grip, or push to where it can, along x, y and z, m."""

HELD_HALF, HELD_OVER_BASE = 0.06, 0.057
"""Half the width of the largest object that the hand may hold, along the last joint's axes, which are turned
by 45 degrees, and height of the tool from which that is over what the arm stands on, m."""

BASE_FRONT, LOW_X = 0.27, 0.28
"""Front end of what the arm stands on, with the clearance of motions, and least x of an empty hand, m."""

MOST_HEADING = 1.7
"""Greatest heading of a hand that grips, rad."""

PUSHES = tuple(0.02 * step for step in range(1, 11))
"""Lengths of pushes to try, m."""

FINGERS_HALF, PUSH_AWAY = 0.015, 0.012
"""Half the thickness of both fingers when they are closed, and how far from a thing they come down, m."""


class HandPart(NamedTuple):
    """A part of the hand, on both sides of the tool point.

    Attributes:
        thick: how far it reaches along the hand's heading, m.
        wide: from where to where it reaches along the way of the fingers, m.
        from_height: height of its lower end over the tool point, m.
    """

    thick: float
    wide: tuple[float, float]
    from_height: float


PALM = HandPart(0.037, (-1.0, 0.107), 0.036)
OPEN_HAND = (PALM, HandPart(0.014, (0.024, 0.058), -0.009))
CLOSED_HAND = (PALM, HandPart(0.014, (-1.0, 0.018), -0.009))
"""A hand with its fingers open, or together; with some millimetres to spare."""


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
        """Where a hand grips it: across its hinge, or a closed one across its plates."""
        return self.middle if self.fold is not None and self.is_closed else self.hinge

    def carries(self, filling: Place) -> bool:
        """Return True if a filling's middle is over plate A, about as high as it rests there."""
        above = filling[2] - self.hinge[2] - PLATE_HALF[2] - FILLING_HEIGHT / 2
        return self.is_under(filling) and abs(above) < ON_PLATE_WITHIN

    def is_under(self, filling: Place) -> bool:
        """Return True if a filling's middle is over plate A, at any height."""
        along, across = _in_frame(np.array((filling,)), self.middle, self.yaw)
        within = (np.abs(along) < PLATE_HALF[0] * self.size) & (np.abs(across) < PLATE_HALF[1] * self.size)
        return bool(within.all())


class Plate(NamedTuple):
    """A plate: its points, the rectangle around them, the height of its middle, and its normal."""

    points: Points
    rectangle: Rectangle
    height: float
    normal: tuple[float, float, float]

    @property
    def is_mostly_visible(self) -> bool:
        """True if its rectangle locates it."""
        whole = 4.0 * PLATE_HALF[0] * PLATE_HALF[1]
        return self.rectangle.length * self.rectangle.width > MIN_VISIBLE_AREA * whole

    @property
    def scale(self) -> float | None:
        """Its size over the usual one; None unless all of it shows."""
        sides = (self.rectangle.length, self.rectangle.width)
        length, width = max(sides) / (2.0 * PLATE_HALF[1]), min(sides) / (2.0 * PLATE_HALF[0])
        if abs(self.normal[2]) < LEVEL or not 1.0 - SQUARELY < width / length < 1.0 + SQUARELY:
            return None
        scale = sqrt(length * width)
        if not SIZES[0] < scale < SIZES[1]:
            return None
        return 1.0 if abs(scale - 1.0) < SAME_SIZE else scale

    @property
    def is_on_edge(self) -> bool:
        """True if it stands on its edge."""
        return min(self.rectangle.length, self.rectangle.width) < EDGE_ON_WIDTH


@dataclass(frozen=True)
class Piece:
    """A wrapper that is followed from picture to picture.

    Attributes:
        wrapper: as it was seen last.
        looks: number of pictures that showed it.
        unseen: number of pictures since, which did not.
        is_wrapped: it is a dumpling: it was pressed, seen filled from the side, and not seen open since.
        is_pressed: the lid has pressed on it with a load that seals.
        was_open: it was seen open, so that it has hidden no filling from the start.
        is_shut: it is closed and empty, and no hand of this robot opens it.
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
    was_open: bool = False
    is_shut: bool = False
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
        return _is_within_reach(self.wrapper.grip)

    @property
    def is_too_large(self) -> bool:
        """True if the press does not close over it."""
        return self.wrapper.size > LARGEST and not self.is_wrapped

    @property
    def is_useless(self) -> bool:
        """True if it is no dumpling, and none can be made of it."""
        return self.is_shut or self.is_stiff or self.is_too_large


@dataclass(frozen=True)
class Bench:
    """All that pictures have shown of wrappers and fillings on the bench.

    Attributes:
        pieces: the wrappers, but for those of cooked dumplings.
        settled: middles of the cooked dumplings in the pot.
        most_fillings: the largest number of fillings that was seen, those in cooked dumplings included.
        is_shown: the last picture shows the bench itself.
        lift: height of the bench, surveyed as 0.
        work: number of the wrapper that is worked on.
        fillings: those that the last picture shows.
        surroundings: points (n, 3) of it that are over the bench.
        press: where a hinge belongs on the press.
        pot: middle of the pot's opening.
        is_pressed: the lid has pressed since the last picture with a load that seals.
        is_lid_over: it was over the wrapper since then.
        is_held: the hand may hold something.
        count: number of dumplings that are asked for.
    """

    pieces: tuple[Piece, ...] = ()
    settled: tuple[Place, ...] = ()
    most_fillings: int = 0
    is_shown: bool = False
    lift: float = 0.0
    work: int | None = None
    fillings: tuple[Filling, ...] = ()
    surroundings: Points = field(default_factory=lambda: np.empty((0, 3)))
    press: Place | None = None
    pot: Place | None = None
    is_pressed: bool = False
    is_lid_over: bool = False
    is_held: bool = False
    count: int = 1

    @property
    def in_work(self) -> Piece | None:
        """The wrapper that is worked on."""
        return None if self.work is None else self.pieces[self.work]

    @property
    def hidden(self) -> int:
        """Number of fillings that no picture shows any more."""
        return self.most_fillings - len(self.settled) - len(self.fillings)

    def felt(self, view: View) -> "Bench":
        """Note load and lid of the press, whether the hand may hold something, and how much is asked for."""
        is_pressed = any(one.value > SEALING_LOAD for one in view.samples["press_force"])
        handle, press = (view.readings.get(name) for name in ("press_handle_position", "press_position"))
        is_over = handle is not None and press is not None and handle[0] - press[0] > LID_OVER
        return replace(
            self,
            is_pressed=self.is_pressed or is_pressed,
            is_lid_over=self.is_lid_over or is_over,
            is_held=view.readings.get("holding") is not False,
            count=int(view.readings.get("count") or 1),
        )

    def seen_from_side(self, picture: Picture) -> "Bench":
        """Judge if the wrapper in work is a dumpling, or shut without a filling."""
        piece = self.in_work
        if piece is None or not piece.wrapper.is_closed:
            return self
        filled = _shows_filling(picture, piece.wrapper)
        is_pressed = piece.is_pressed or self.is_pressed
        new = replace(
            piece,
            is_pressed=is_pressed,
            is_wrapped=filled is True and is_pressed,
            is_shut=piece.is_shut or (filled is None and is_pressed),
        )
        pieces = tuple(new if one is piece else one for one in self.pieces)
        return replace(self, pieces=pieces, is_pressed=False)

    def seen_from_above(self, picture: Picture, press: Place | None, pot: Place | None) -> "Bench":
        """Follow what a picture from above shows, with the surveyed fixtures."""
        points, seen_lift = _level(picture)
        lift = self.lift if seen_lift is None else seen_lift
        bench = replace(
            self,
            is_shown=seen_lift is not None,
            lift=lift,
            press=_raised(press, lift),
            pot=_raised(pot, lift),
        )
        shown = _look_from_above(picture, points, self.settled, bench.pot)
        flat = points.reshape(-1, 3)
        around = flat[(flat[:, 2] > lift + OVER_BENCH) & (flat[:, 2] < MAX_HEIGHT)]
        bench = replace(bench, fillings=tuple(shown.fillings), surroundings=around)
        bench = bench.followed(shown.wrappers).counted().timed(picture.time)
        settled = [
            one.wrapper.middle
            for one in bench.pieces
            if one.is_wrapped
            and one.in_pot_since is not None
            and picture.time - one.in_pot_since >= COOKING_TIME
        ]
        if settled:
            before = bench.in_work
            pieces = tuple(one for one in bench.pieces if one.wrapper.middle not in settled)
            work = pieces.index(before) if before in pieces else None
            bench = replace(bench, pieces=pieces, work=work, settled=(*bench.settled, *settled))
            shown = _look_from_above(picture, points, bench.settled, bench.pot)
            bench = replace(bench, fillings=tuple(shown.fillings))
        return replace(bench, work=bench.chosen())

    def values(self) -> Values:
        """Return value and uncertainty of what is known of the wrapper and the filling in work."""
        return {**self.remaining_values(), **self.place_values(), **self.push_values()}

    def followed(self, wrappers: list[Wrapper]) -> "Bench":
        """Find each wrapper among those of before: what has not moved first."""
        ways = sorted(
            (dist(piece.wrapper.middle, one.middle), i, k)
            for i, piece in enumerate(self.pieces)
            for k, one in enumerate(wrappers)
        )
        found: dict[int, int] = {}
        for _, i, k in ways:
            if i not in found and k not in found.values():
                found[i] = k
        pieces: list[Piece] = []
        work = None
        for i, piece in enumerate(self.pieces):
            is_in_work = i == self.work
            pressed = replace(piece, is_pressed=piece.is_pressed or (is_in_work and self.is_pressed))
            seen = None if i not in found else wrappers[found[i]]
            if seen is None and piece.looks == 1:
                continue  # what was seen once and never again was no wrapper
            if is_in_work:
                work = len(pieces)
            if seen is None:
                pieces.append(replace(pressed, unseen=piece.unseen + 1, in_pot_since=None))
                continue
            is_left = is_in_work and dist(seen.hinge, piece.wrapper.hinge) < STIRRED
            tries = piece.tries + 1 if is_left and not self.is_on_press(piece) else 0
            if seen.scale is None:
                seen = seen.scaled(piece.wrapper.scale)
            shown = replace(pressed, wrapper=seen, unseen=0, looks=piece.looks + 1, tries=tries)
            if not seen.is_closed:
                is_perched = self.is_perched(seen) and not self.is_perched(piece.wrapper)
                presses = piece.presses + int(is_in_work and self.is_lid_over) + int(is_perched)
                shown = replace(
                    shown, is_wrapped=False, is_pressed=False, is_shut=False, was_open=True, presses=presses
                )
            pieces.append(shown)
        pieces += [
            Piece(one, was_open=not one.is_closed)
            for k, one in enumerate(wrappers)
            if k not in found.values()
        ]
        is_pressed = self.is_pressed and self.work is None
        return replace(self, pieces=tuple(pieces), work=work, is_pressed=is_pressed, is_lid_over=False)

    def counted(self) -> "Bench":
        """Count fillings: when all are seen elsewhere, a closed wrapper has none."""
        free = sum(
            not any(self.is_inside(one.middle, piece) for piece in self.pieces) for one in self.fillings
        )
        most = max(self.most_fillings, len(self.settled) + free)
        pieces = list(self.pieces)
        for i, piece in enumerate(self.pieces):
            is_known = piece.is_wrapped or piece.was_open
            if is_known and piece.wrapper.is_closed and most <= len(self.settled) + free:
                pieces[i] = replace(piece, is_wrapped=False, is_shut=piece.wrapper.fold is not None)
        return replace(self, pieces=tuple(pieces), most_fillings=most)

    def timed(self, time: float) -> "Bench":
        """Time wrappers in the pot: one that has moved there may have been out of it."""
        pieces = list(self.pieces)
        for i, piece in enumerate(self.pieces):
            at, since, before = piece.wrapper.middle, piece.in_pot_since, piece.in_pot_at
            if piece.unseen or not self.is_whole_in_pot(piece):
                pieces[i] = replace(piece, in_pot_since=None)
            elif since is None or before is None or dist(at, before) > STIRRED:
                pieces[i] = replace(piece, in_pot_since=time, in_pot_at=at)
        return replace(self, pieces=tuple(pieces))

    def is_inside(self, filling: Place, piece: Piece) -> bool:
        """Return True if a filling that is seen is within a dumpling, as where one on its edge is open."""
        wrapper = piece.wrapper
        along, across = _in_frame(np.array((filling,)), wrapper.middle, wrapper.yaw)
        above = filling[2] - wrapper.hinge[2]
        size = wrapper.size
        is_low = above < (wrapper.hinge[2] - self.lift if wrapper.fold is None else CLOSED_HEIGHT * size)
        is_within = (np.abs(along) < PLATE_HALF[0] * size + OUTLINE) & (
            np.abs(across) < PLATE_HALF[1] * size + OUTLINE
        )
        return piece.is_wrapped and is_low and bool(is_within.all())

    def is_whole_in_pot(self, piece: Piece) -> bool:
        """Return True if a wrapper is in the pot and no filling lies at it, but outside of the pot."""
        spilt = [
            one.middle
            for one in self.fillings
            if _is_near(one.middle, piece.wrapper) and not self.is_inside(one.middle, piece)
        ]
        return _is_in_pot(piece.wrapper.middle, self.pot) and all(_is_in_pot(one, self.pot) for one in spilt)

    def chosen(self) -> int | None:
        """Choose the wrapper that is worked on: a dumpling, one on the press, or the one of before."""
        before = self.in_work
        if before is not None and (before.unseen == 1 or (before.unseen and self.is_held)):
            return self.work  # a picture that misses it is none without it, and the hand may hold it

        def rank(number: int) -> tuple[bool, bool, int, bool, bool, float]:
            one = self.pieces[number]
            place = self.press if before is None else before.wrapper.hinge
            moved = 0.0 if place is None else dist(one.wrapper.hinge[:2], place[:2])
            has_room = self.has_wrapper_room(one)
            is_possible = not one.is_useless and one.is_within_reach and (has_room or bool(self.push_of(one)))
            return (
                not is_possible,
                not one.is_wrapped,
                one.tries // MOST_TRIES,
                not self.is_on_press(one),
                not has_room,
                moved,
            )

        seen = (number for number, one in enumerate(self.pieces) if not one.unseen)
        return min(seen, key=rank, default=None)

    def filling_in_work(self) -> Filling | None:
        """Choose the filling that is worked on: at the wrapper, or one that can be gripped, near the pot."""

        def rank(one: Filling) -> tuple[bool, bool, bool, bool, float]:
            near = self.in_work is not None and _is_near(one.middle, self.in_work.wrapper)
            from_pot = 0.0 if self.pot is None else dist(one.middle[:2], self.pot[:2])
            has_room = self.filling_heading(one) is not None
            return self.is_on_side(one), not near, not _is_within_reach(one.middle), not has_room, from_pot

        return min(self.fillings, key=rank, default=None)

    def is_on_side(self, filling: Filling) -> bool:
        """Return True if a filling lies on its side, on bench or wrapper, and another one can be laid.

        The plates do not close on it, and a hand that points down cannot turn it over.
        """
        return self.is_too_high(filling) and any(
            one is not filling
            and not self.is_too_high(one)
            and _is_within_reach(one.middle)
            and self.filling_heading(one) is not None
            for one in self.fillings
        )

    def is_too_high(self, filling: Filling) -> bool:
        """Return True if a filling on bench or wrapper is higher than one that lies flat."""
        wrapper = None if self.in_work is None or self.in_work.unseen else self.in_work.wrapper
        is_laid = wrapper is not None and wrapper.is_under(filling.middle)
        ground = wrapper.hinge[2] + PLATE_HALF[2] if wrapper is not None and is_laid else self.lift
        return ON_SIDE < filling.middle[2] - ground - FILLING_HEIGHT / 2.0 < FILLING_HEIGHT

    def place_values(self) -> Values:
        """Return the values of places, and what follows from them.

        Dough and filling stay "on the workspace" as parts of the dumpling, and so does a filling that a
        closed wrapper hides: then fewer fillings are seen than there are. A wrapper on its edge may be open:
        it counts as filled only if it was seen wrapped before.
        """
        values: Values = {}
        filling, piece, press = self.filling_in_work(), self.in_work, self.press
        others = [one.middle for one in self.fillings if one is not filling]
        if others:
            values["other_filling_position"] = (others[0], UNCERTAINTY)
        if filling is not None:
            heading = self.filling_heading(filling)
            values["filling_position"] = (filling.middle, UNCERTAINTY)
            values["filling_has_room"] = (heading is not None,)
            values["filling_yaw"] = (filling.yaw if heading is None else heading, ANGLE_UNCERTAINTY)
        pot_place = self.pot_place()
        if pot_place is not None:
            values["pot_place"] = (pot_place, UNCERTAINTY)
        besides = [one for one in self.pieces if one is not piece and not one.unseen]
        if besides:
            values["other_wrapper_position"] = (besides[0].wrapper.grip, UNCERTAINTY)
        values |= self.press_values()
        if piece is not None and piece.unseen and piece.is_wrapped and self.is_held:
            values |= dict.fromkeys(
                ("dough_on_workspace", "filling_on_workspace", "dumpling_wrapped"), (True,)
            )
        if piece is None or piece.unseen:
            return values
        wrapper, fold = piece.wrapper, piece.wrapper.fold
        is_inside = filling is not None and _is_near(filling.middle, wrapper)
        is_hidden = (self.hidden > 0 and not piece.is_shut) or not self.fillings
        is_hidden = is_hidden and not is_inside and wrapper.is_closed and fold is not None
        values |= {
            "wrapper_position": (wrapper.hinge, UNCERTAINTY),
            "wrapper_yaw": (wrapper.yaw, ANGLE_UNCERTAINTY),
            "wrapper_scale": (wrapper.size, SAME_SIZE / 2.0),
            "wrapper_has_room": (self.has_wrapper_room(piece),),
            "filling_on_workspace": (
                piece.is_wrapped or is_hidden or (filling is not None and wrapper.carries(filling.middle)),
            ),
            "dumpling_wrapped": (piece.is_wrapped,),
        }
        if fold is not None:
            values["wrapper_fold"] = (fold, ANGLE_UNCERTAINTY)
        if press is not None:
            dx, dy, dz = (a - b for a, b in zip(wrapper.hinge, press, strict=True))
            on_press = dist((dx, dy), (0.0, 0.0)) < ON_PRESS_WITHIN[0] and abs(dz) < ON_PRESS_WITHIN[1]
            is_dough = on_press and not piece.is_shut
            values["dough_on_workspace"] = (piece.is_wrapped or is_dough,)
            near = all(abs(off) < within for off, within in zip((dx, dy, dz), ALIGNED_WITHIN, strict=True))
            values["wrapper_aligned"] = (near and abs(wrapper.yaw) < ALIGNED_YAW and is_dough,)
        return values

    def press_values(self) -> Values:
        """Return if something has to be taken from the press first, where it is, and a place for it."""
        if self.press is None:
            return {}
        values: Values = {"press_free": (True,)}
        near = [one for one in self.pieces if not one.unseen and self.is_on_press(one)]
        for one in near:
            is_perched = self.is_perched(one.wrapper) and not one.is_wrapped
            if one is not self.in_work or is_perched:
                values["press_free"] = (False,)
                values["blocker_position"] = (one.wrapper.grip, UNCERTAINTY)
                values["blocker_yaw"] = (wrap_heading(one.wrapper.yaw, pi), ANGLE_UNCERTAINTY)
                values["blocker_is_filling"] = (False,)
        for filling in self.fillings:
            dx, dy, dz = (a - b for a, b in zip(filling.middle, self.press, strict=True))
            is_at_bed = BED[0][0] < dx < BED[0][1] and abs(dy) < BED[1] and dz > -OVER_BENCH
            if is_at_bed and (not near or self.is_on_side(filling)):
                values["press_free"] = (False,)
                values["blocker_position"] = (filling.middle, UNCERTAINTY)
                values["blocker_yaw"] = (filling.yaw, ANGLE_UNCERTAINTY)
                values["blocker_is_filling"] = (True,)
        aside = None if values["press_free"] == (True,) else self.aside_place()
        if aside is not None:
            values["aside_place"] = (aside, UNCERTAINTY)
        return values

    def aside_place(self) -> Place | None:
        """Return the free place on the bench, for a wrapper or a filling, that is nearest to the press."""
        press = self.press
        if press is None:
            return None
        spots = [(x, y, self.lift + ASIDE_HEIGHT) for x in ASIDES[0] for y in ASIDES[1]]
        for spot in sorted(spots, key=lambda one: dist(one[:2], press[:2])):
            along, across = _in_frame(self.surroundings, spot, 0.0)
            is_occupied = (np.abs(along) < WRAPPER_HALF[0] + SPARE) & (
                np.abs(across) < WRAPPER_HALF[1] + SPARE
            )
            if not is_occupied.any() and _has_room(self.surroundings, (spot[0], spot[1], LOWEST), 0.0):
                return spot
        return None

    def pot_place(self) -> Place | None:
        """Return where a dumpling is let go into the pot: beside those there, where least is in its way."""
        if self.pot is None:
            return None
        x, y, z = self.pot
        aside = (-0.038, 0.040) if self.count > 1 else (0.0, 0.045)
        first = aside[min(len(self.settled), 1)]
        low = self.surroundings[self.surroundings[:, 2] > z - POT_DEPTH + OVER_BENCH]

        def crowd(place: Place) -> int:
            along, across = _in_frame(low, place, 0.0)
            half = (PLATE_HALF[0] + OUTLINE, OPEN_HAND[1].wide[1])
            crowded = (np.abs(along) < half[0]) & (np.abs(across) < half[1])
            return max(int(crowded.sum()) - MIN_PIXELS, 0)  # fewer are noise

        places = [(x + dx, y + dy, z) for dx in (first, 0.0, -0.045, 0.045) for dy in (0.0, 0.035, -0.035)]
        return min(places, key=crowd)

    def remaining_values(self) -> Values:
        """Return if enough wrappers and fillings are left, and what is the matter with the others."""
        lost = [one for one in self.pieces if one.unseen > 1]
        kept = [one for one in self.pieces if one.unseen <= 1]
        far = [one for one in kept if not one.is_within_reach]
        near = [one for one in kept if one.is_within_reach]
        useless = [one for one in near if one.is_useless]
        tight = [one for one in near if not one.is_useless and self.is_stuck(one)]
        far_fillings = [one for one in self.fillings if not _is_within_reach(one.middle)]
        tight_fillings = [
            one for one in self.fillings if one not in far_fillings and self.is_filling_stuck(one)
        ]
        closed = sum(one.wrapper.is_closed and not one.is_shut for one in near)
        hidden = min(self.hidden, closed)
        usable = len(self.fillings) - len(far_fillings) - len(tight_fillings) + hidden
        wrappers = len(near) - len(useless) - len(tight)
        needed = self.count - len(self.settled)
        values: Values = {
            "wrappers_suffice": (wrappers + int(self.is_held) >= needed,),
            "fillings_suffice": (usable + int(self.is_held) >= needed,),
            "wrappers_lost": (len(lost),),
            "wrappers_out_of_reach": (len(far),),
            "wrappers_shut": (sum(one.is_shut and not one.is_too_large for one in useless),),
            "wrappers_too_large": (sum(one.is_too_large for one in useless),),
            "wrappers_not_folding": (sum(not (one.is_shut or one.is_too_large) for one in useless),),
            "wrappers_without_room": (len(tight),),
            "fillings_lost": (self.hidden - hidden,),
            "fillings_out_of_reach": (len(far_fillings),),
            "fillings_without_room": (len(tight_fillings),),
        }
        for one in (*tight, *useless, *far, *lost):
            values["wrapper_last_seen"] = (one.wrapper.hinge, UNCERTAINTY)
        return values

    def is_stuck(self, piece: Piece) -> bool:
        """Return True if a hand has no room at a wrapper, and no push gives it room."""
        return not self.has_wrapper_room(piece) and not self.push_of(piece)

    def is_filling_stuck(self, filling: Filling) -> bool:
        """Return True if a hand has no room at a filling that it needs, and no push gives it room."""
        is_laid = any(one.wrapper.carries(filling.middle) for one in self.pieces)
        return not is_laid and self.filling_heading(filling) is None and not self.push_of_filling(filling)

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

    def has_wrapper_room(self, piece: Piece) -> bool:
        """Return True if a hand can grip a wrapper where it is."""
        wrapper = piece.wrapper
        if self.is_on_press(piece):
            return True  # fingers pass its sides
        if piece.is_wrapped and _is_in_pot(wrapper.middle, self.pot):
            return True  # it stays there
        if wrapper.fold is None:
            return False  # nobody grips it across the hinge while it stands on its edge
        around = self.without(wrapper.grip, wrapper.yaw, wrapper.half)
        return _has_room(around, wrapper.grip, wrapper.yaw)

    def filling_heading(self, filling: Filling) -> float | None:
        """Return the heading at which a hand has room to grip a filling: it is square."""
        around = self.without(filling.middle, filling.yaw, FILLING_HALF)
        for heading in _square_headings(filling.yaw):
            if _has_room(around, filling.middle, heading):
                return heading
        return None

    def without(self, middle: Place, yaw: float, half: tuple[float, float]) -> Points:
        """Return the surroundings without a thing and what lies on it."""
        along, across = _in_frame(self.surroundings, middle, yaw)
        return self.surroundings[(np.abs(along) > half[0] + OUTLINE) | (np.abs(across) > half[1] + OUTLINE)]

    def push_values(self) -> Values:
        """Return a push that gives a hand room at the wrapper, or else at the filling, if it has none."""
        piece, filling = self.in_work, self.filling_in_work()
        if piece is not None and not piece.unseen and not self.has_wrapper_room(piece):
            return self.push_of(piece)
        if filling is not None and self.filling_heading(filling) is None:
            return self.push_of_filling(filling)
        return {}

    def push_of(self, piece: Piece) -> Values:
        """Return a push that gives a hand room at a wrapper; none if there is none."""
        wrapper = piece.wrapper
        height = LOWEST if wrapper.fold is not None and not wrapper.is_closed else PUSH_HEIGHT
        return self.push_along_side(wrapper.grip, wrapper.yaw, (*wrapper.half, height), (wrapper.yaw,))

    def push_of_filling(self, filling: Filling) -> Values:
        """Return a push that gives a hand room at a filling; none if there is none."""
        size = (*FILLING_HALF, PUSH_HEIGHT)
        return self.push_along_side(filling.middle, filling.yaw, size, _square_headings(filling.yaw))

    def push_along_side(
        self, middle: Place, yaw: float, size: tuple[float, float, float], grips: tuple[float, ...]
    ) -> Values:
        """Return the shortest push along a side of a thing on the bench to where a hand has room to grip it.

        Args:
            middle: of the thing.
            yaw: its heading.
            size: half its length and width, and the height of the tool that pushes it.
            grips: headings of a hand that may grip it.
        """
        half = size[:2]
        if middle[2] > self.lift + PUSHED_HEIGHT:
            return {}
        around = self.without(middle, yaw, half)
        for length in PUSHES:
            for side in range(4):
                way = yaw + side * pi / 2.0
                u, v = cos(way), sin(way)
                out, wide = half[side % 2], half[1 - side % 2]
                end = (middle[0] + length * u, middle[1] + length * v, middle[2])
                if not any(_has_room(around, end, one) for one in grips):
                    continue
                along, across = _in_frame(around, middle, way)
                is_in_way = (
                    (along > 0.0) & (along < length + out + OUTLINE) & (np.abs(across) < wide + OUTLINE)
                )
                if is_in_way.any():
                    continue
                start = -(out + FINGERS_HALF + PUSH_AWAY)
                first, last = (
                    (middle[0] + at * u, middle[1] + at * v, self.lift + size[2])
                    for at in (start, length - out - FINGERS_HALF)
                )
                for heading in (wrap_heading(way, pi), wrap_heading(way + pi / 2.0, pi)):
                    if all(_has_room(around, one, heading, CLOSED_HAND, LOW_X) for one in (first, last)):
                        return {
                            "push_start": (first, UNCERTAINTY),
                            "push_end": (last, UNCERTAINTY),
                            "push_yaw": (heading, ANGLE_UNCERTAINTY),
                        }
        return {}


def see_dumpling(view: View) -> Perception:
    """Follow the dumplings: what pictures show now, and what they and the press have shown before.

    A picture from the side decides if the wrapper that was seen from above is a dumpling. A wrapper that is
    seen open is none any more, and neither is a closed one when all fillings are seen elsewhere. A dumpling
    that two pictures show at one place in the pot, long enough apart, is cooked; then the work on the next
    wrapper begins. A wrapper that no hand can make a dumpling of is not worked on while there is another.
    """
    bench = Bench()
    known: dict[str, Any] = {}
    seen: dict[str, float] = {}
    while True:
        bench = bench.felt(view)
        for name in ("overhead", "side"):
            picture = view.pictures.get(name)
            if picture is None or picture.time <= seen.get(name, -1.0):
                continue
            seen[name] = picture.time
            if name == "side":
                bench = bench.seen_from_side(picture)
                piece = bench.in_work
                known["dumpling_wrapped"] = estimate(
                    piece is not None and piece.is_wrapped, time=picture.time
                )
                if piece is not None and piece.is_shut:
                    known |= {one: estimate(False, time=picture.time) for one in EMPTY}
                continue
            press, pot = (view.readings.get(one) for one in ("press_position", "pot_position"))
            cooked = len(bench.settled)
            bench = bench.seen_from_above(picture, press, pot)
            known |= dict.fromkeys(UNSEEN)
            found = bench.values() | {
                "dumpling_cooked": (bool(bench.settled),),
                "dumplings_cooked": (len(bench.settled),),
            }
            if bench.is_shown:
                found["bench_lift"] = (bench.lift, UNCERTAINTY)
            if bench.work is None and bench.pieces:
                found["dumpling_wrapped"] = (False,)  # a dumpling that two pictures miss is none to work with
            if bench.work is None and len(bench.settled) > cooked:
                # What was in the press is in the pot.
                found |= dict.fromkeys(GONE, (False,))
            known |= {one: estimate(*value, time=picture.time) for one, value in found.items()}
        view = yield known.copy()


def _is_near(filling: Place, wrapper: Wrapper) -> bool:
    return dist(filling[:2], wrapper.middle[:2]) < FILLING_APART


def _is_within_reach(place: Place) -> bool:
    """Return True if the hand, or a push towards it, can reach a thing there."""
    return all(low < at < high for at, (low, high) in zip(place, REACH, strict=True))


def _square_heading(face: Points) -> float:
    """Return the heading of a small square, from its few points (n, 3): that of their fourth moment.

    All points count, whereas the rectangle around them turns with a single one at a corner.
    """
    x, y = (face[:, :2] - face[:, :2].mean(axis=0)).T
    real, imaginary = (x**4 - 6.0 * x**2 * y**2 + y**4).sum(), (4.0 * x * y * (x**2 - y**2)).sum()
    yaw = atan2(-imaginary, -real) / 4.0
    return 0.0 if abs(yaw) < STRAIGHT else yaw


def _square_headings(yaw: float) -> tuple[float, ...]:
    """Return the headings at which a hand may grip a thing that is square."""
    return tuple(one for one in (yaw, yaw + pi / 2.0, yaw - pi / 2.0) if abs(one) <= MOST_HEADING)


def _in_frame(points: Points, middle: Place, yaw: float) -> tuple[Points, Points]:
    """Return how far points (n, 3) are from a place along a heading, and across it, each (n,)."""
    away = points[:, :2] - np.array(middle[:2])
    return away @ np.array((cos(yaw), sin(yaw))), away @ np.array((-sin(yaw), cos(yaw)))


def _has_room(
    points: Points,
    place: Place,
    yaw: float,
    hand: tuple[HandPart, ...] = OPEN_HAND,
    least_x: float | None = None,
) -> bool:
    """Return True if a hand at `yaw` that grips at a place meets none of points (n, 3), nor the carriage.

    What the hand lifts counts as the largest that it may hold: low and near the carriage is no room for it.
    """
    x, y, z = place[0], place[1], max(place[2], LOWEST)
    if least_x is None:
        corner = HELD_HALF * (abs(cos(yaw + pi / 4.0)) + abs(sin(yaw + pi / 4.0)))
        least_x = BASE_FRONT + corner if z < HELD_OVER_BASE else LOW_X
    if not (x > least_x and GRASPS[0][0] < x < GRASPS[0][1] and GRASPS[1][0] < y < GRASPS[1][1]):
        return False
    along, across = _in_frame(points, place, yaw)
    along, across, above = np.abs(along), np.abs(across), points[:, 2] - z
    return not any(
        (
            (along < part.thick)
            & (across > part.wide[0])
            & (across < part.wide[1])
            & (above > part.from_height)
        ).sum()
        >= MIN_PATCH
        for part in hand
    )


def _raised(place: Place | None, lift: float) -> Place | None:
    return None if place is None else (place[0], place[1], place[2] + lift)


def _level(picture: Picture) -> tuple[Points, float | None]:
    """Return the points of a level picture from above, and the height of the bench, surveyed as 0.

    The height is None if the picture shows no bench.
    """
    points = picture.points()
    level = level_ground(picture, np.abs(points[:, :, 2]) < NEAR_BENCH, OFF_BENCH, MIN_BENCH)
    if level is None:
        return points, None
    height = believe_height(level.height, 0.0, UNNOTICED)
    return level.points + np.array((0.0, 0.0, height - level.height)), height


def _is_in_pot(place: Place, opening: Place | None) -> bool:
    if opening is None:
        return False
    dx, dy, dz = (a - b for a, b in zip(place, opening, strict=True))
    return abs(dx) < POT_HALF[0] and abs(dy) < POT_HALF[1] and -POT_DEPTH < dz < 0.0


class Shown(NamedTuple):
    """Wrappers and fillings that a picture from above shows; not those of cooked dumplings."""

    wrappers: list[Wrapper]
    fillings: list[Filling]


def _look_from_above(picture: Picture, seen: Points, settled: Sequence[Place], pot: Place | None) -> Shown:
    """Find wrappers and fillings in a picture in which the arm hides nothing.

    Args:
        picture: from above.
        seen: its points, levelled by the bench.
        settled: middles of the cooked dumplings in the pot, whose points are left out.
        pot: the middle of the pot's opening.
    """
    points, dough, glazed, green = _coloured(picture, seen)
    is_settled = np.zeros(len(points), np.bool_)
    for x, y, _ in settled:
        is_settled |= np.hypot(points[:, 0] - x, points[:, 1] - y) < SETTLED_WITHIN
    dough, glazed, green = (mask & ~is_settled for mask in (dough, glazed, green))
    shape = picture.rgb.shape[:2]
    fillings = []
    for part in separate_parts(green.reshape(shape), MIN_PIXELS):
        face = upper_points(points[part.reshape(-1)])
        around = min_area_rectangle(face[:, :2])
        place = (around.x, around.y, float(np.median(face[:, 2])) - FILLING_HEIGHT / 2.0)
        fillings.append(Filling(place, _square_heading(face)))
    wrappers = []
    for a, b in _paired(points, _plates_of(points, dough, shape), _plates_of(points, glazed, shape)):
        wrapper = _wrapper(_plate(points[a]), _plate(points[b]))
        if wrapper is None:
            continue
        is_remainder = bool(settled) and int((a | b).sum()) < SETTLED_PIXELS
        if not (is_remainder and _is_in_pot(wrapper.middle, pot)):
            wrappers.append(wrapper)
    return Shown(wrappers, fillings)


def _plates_of(points: Points, mask: Mask, shape: tuple[int, ...]) -> list[Mask]:
    """Separate the points of one colour into plates: parts that are near each other are of one."""
    plates: list[Mask] = []
    # In a picture, a plate on the press may touch one on the bench behind it.
    is_high = points[:, 2] > BETWEEN_HEIGHTS
    layers = [(mask & layer).reshape(shape) for layer in (is_high, ~is_high)]
    for part in (one for layer in layers for one in separate_parts(layer, MIN_PIXELS)):
        one = part.reshape(-1)
        middle = points[one].mean(axis=0)
        near = [plate for plate in plates if dist(points[plate].mean(axis=0), middle) < SAME_PLATE]
        plates = [plate for plate in plates if not any(plate is other for other in near)]
        for plate in near:
            one = one | plate
        plates.append(one)
    return plates


def _paired(points: Points, plates_a: list[Mask], plates_b: list[Mask]) -> list[tuple[Mask, Mask]]:
    """Find the two plates of each wrapper, the nearest first; of a hidden one the mask is empty."""
    ways = sorted(
        (dist(points[a].mean(axis=0), points[b].mean(axis=0)), i, k)
        for i, a in enumerate(plates_a)
        for k, b in enumerate(plates_b)
    )
    pairs: dict[int, int] = {}
    for away, i, k in ways:
        if away < PLATES_APART and i not in pairs and k not in pairs.values():
            pairs[i] = k
    none = np.zeros(len(points), np.bool_)
    found = [(a, plates_b[pairs[i]] if i in pairs else none) for i, a in enumerate(plates_a)]
    return found + [(none, b) for k, b in enumerate(plates_b) if k not in pairs.values()]


def _shows_filling(picture: Picture, wrapper: Wrapper) -> bool | None:
    """Return True if a picture from the side shows filling between the plates, and none outside.

    Returns:
        None if it shows the wrapper and no filling at all in it or at it.
    """
    points, dough, glazed, green = _coloured(picture, picture.points())
    c, s = cos(wrapper.yaw), sin(wrapper.yaw)
    away = (points - np.array(wrapper.hinge)) @ np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
    away /= wrapper.size
    # Both cameras are a little off: its plates are where the other one has seen the wrapper.
    plates = away[
        (dough | glazed) & (np.abs(away - np.array(CLOSED_MIDDLE)) < np.array(CLOSED_ROOM)).all(axis=1)
    ]
    off = np.zeros(3)
    if len(plates) >= MIN_PIXELS:
        low, high = np.percentile(plates, (1.0, 99.0), axis=0)
        off = (low + high) / 2.0 - np.array(CLOSED_MIDDLE)
    if float(np.abs(off).max()) > OFF_SIDE:
        return False
    along, across, above = (away[green] - off).T
    near = (along > -0.01) & (along < 2.0 * HINGE_TO_PLATE + 0.01) & (np.abs(across) < PLATE_HALF[1] + 0.01)
    between = near & (above > 0.0) & (above < CLOSED_HEIGHT)
    inside = (along < HINGE_TO_PLATE + PLATE_HALF[0]) & (np.abs(across) < PLATE_HALF[1])
    if len(plates) >= MIN_PIXELS and not between.any():
        return None
    return int((between & inside).sum()) >= MIN_FILLING_PIXELS and not bool((between & ~inside).any())


def _coloured(picture: Picture, seen: Points) -> tuple[Points, Mask, Mask, Mask]:
    """Return the points of a picture, and masks of those on plate A, on plate B and on the filling.

    What is too small is noise.
    """
    # Between a plate and what lies on it, a median has the colour of neither.
    rgb, smooth = picture.rgb, smooth_colours(picture.rgb)
    low = seen[:, :, 2] < MAX_HEIGHT
    colours = [
        low & has_red_ratios(rgb, green, (None, bluest), MIN_BRIGHTNESS) for green, bluest in PLATE_COLOURS
    ]
    colours.append(low & has_dominant_colour(smooth, 1, GREEN_DOMINANCE, MIN_GREEN))
    dough, glazed, green = (without_specks(mask, MIN_PATCH).reshape(-1) for mask in colours)
    return seen.reshape(-1, 3), dough, glazed, green


def _plate(points: Points) -> Plate | None:
    """Fit a plate to points, without the points on its sides."""
    if len(points) < MIN_PIXELS:
        return None
    plane, face = trim_to_plane(points, PLANE_TOLERANCE, MIN_PIXELS)
    around = min_area_rectangle(face[:, :2])
    return Plate(face, around, plane.height_at(around.x, around.y), plane.normal)


def _wrapper(a: Plate | None, b: Plate | None) -> Wrapper | None:
    """Estimate a wrapper from what shows of its plates: of a plate that is hidden, its size is not known."""
    scales = [one.scale for one in (a, b) if one is not None and one.scale is not None]
    scale = sum(scales) / len(scales) if scales else None
    wrapper = _wrapper_of_size(a, b, scale or 1.0)
    return None if wrapper is None else wrapper.scaled(scale)


def _wrapper_of_size(a: Plate | None, b: Plate | None, size: float) -> Wrapper | None:
    if a is not None and b is not None and _covers(b, a):
        a = None
    if a is None:
        return None if b is None else _wrapper_from_one_plate(b, CLOSED_HEIGHT, size, is_closed=True)
    if b is None:
        return _wrapper_from_one_plate(a, PLATE_HALF[2], size, is_closed=False)
    if a.is_on_edge or b.is_on_edge:
        return _wrapper_on_edge(a, b)
    away = (a.rectangle.x - b.rectangle.x, a.rectangle.y - b.rectangle.y)
    best = a if a.is_mostly_visible else b
    # The sides of a tilted plate look too short; the line between the plates is across the hinge.
    across_hinge = atan2(away[1], away[0])
    heading = across_hinge + wrap_heading(best.rectangle.heading - across_hinge, pi / 2.0)
    way, side = np.array((cos(heading), sin(heading))), np.array((-sin(heading), cos(heading)))
    near, far = float((a.points[:, :2] @ way).min()), float((b.points[:, :2] @ way).max())
    visible = best.points if best.is_mostly_visible else np.concatenate((a.points, b.points))
    across = visible[:, :2] @ side
    u, v = (near + far) / 2.0, float(across.min() + across.max()) / 2.0
    x, y = (u * way + v * side).tolist()
    fold = acos(max(-1.0, min(1.0, sum(p * q for p, q in zip(a.normal, b.normal, strict=True)))))
    return Wrapper((x, y, a.height - PLATE_HALF[2] * size), wrap_heading(heading, 2.0 * pi), fold)


def _covers(b: Plate, a: Plate) -> bool:
    """Return True if plate B hides plate A but for its edges, as when they are folded together."""
    apart = dist((a.rectangle.x, a.rectangle.y), (b.rectangle.x, b.rectangle.y))
    return b.is_mostly_visible and b.height - a.height > HINGE_TO_PLATE / 2.0 and apart < PLATE_HALF[1]


def _wrapper_from_one_plate(plate: Plate, above: float, size: float, *, is_closed: bool) -> Wrapper:
    """Estimate the wrapper from the only visible plate: the upper one if closed, the lower one if open."""
    if plate.is_on_edge:
        return _wrapper_on_edge(plate, plate)
    heading = plate.rectangle.shorter_heading
    if cos(heading) < 0.0:
        heading += pi
    x = plate.rectangle.x - HINGE_TO_PLATE * size * cos(heading)
    y = plate.rectangle.y - HINGE_TO_PLATE * size * sin(heading)
    tilt = acos(min(1.0, abs(plate.normal[2])))
    fold = pi - tilt if is_closed else 0.0
    return Wrapper((x, y, plate.height - above * size), wrap_heading(heading, 2.0 * pi), fold)


def _wrapper_on_edge(a: Plate, b: Plate) -> Wrapper:
    """Estimate a wrapper on its edge: its middle is half as high as its top; its fold is not visible."""
    away = (a.rectangle.x - b.rectangle.x, a.rectangle.y - b.rectangle.y)
    are_apart = dist(away, (0.0, 0.0)) > PLATE_HALF[0] / 2.0
    heading = atan2(away[1], away[0]) if are_apart else a.rectangle.shorter_heading
    top = max(float(plate.points[:, 2].max()) for plate in (a, b))
    middle = ((a.rectangle.x + b.rectangle.x) / 2.0, (a.rectangle.y + b.rectangle.y) / 2.0, top / 2.0)
    return Wrapper(middle, wrap_heading(heading, 2.0 * pi), None)
