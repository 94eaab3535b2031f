"""Room to grip a wrapper or a filling, and pushes that give it room."""

from math import cos, pi, sin

import numpy as np

from aeros.perception import Points, wrap_heading

from .bench import Bench
from .hand import CLOSED_HAND, has_room, in_frame, is_within_reach, square_headings
from .measures import (
    ANGLE_UNCERTAINTY,
    FILLING_HALF,
    FILLING_HEIGHT,
    LOWEST,
    OUTLINE,
    PLATE_HALF,
    POT_HALF,
    UNCERTAINTY,
    Place,
    Values,
)
from .wrappers import Filling, Piece

PUSH_HEIGHT = 0.02
"""Height of the tool that pushes a thing which is at least 17 mm high, m: the hand is over stands and pot."""

PUSHED_HEIGHT = 0.03
"""Greatest height of the middle of a thing on the bench that fingers push, m."""

ON_SIDE = 0.0042
"""Height over that of a filling that lies flat above which it lies on its side, m: it is 22 mm high then, and
not 17 mm."""

PUSHES = tuple(0.02 * step for step in range(1, 11))
"""Lengths of pushes to try, m."""

RIM, RIM_STEP = 0.005, 0.002
"""Thickness of the pot's sides, and distance of the points that stand for their upper edges, m."""

PUSH_SHARES = tuple(step / 10.0 for step in range(11))
"""Places on the way of the fingers that push, which are at most 25 mm apart, as shares of it."""

FINGERS_HALF, PUSH_AWAY = 0.015, 0.012
"""Half the thickness of both fingers when they are closed, and how far from a thing they come down, m."""


def is_on_side(bench: Bench, filling: Filling) -> bool:
    """Return True if a filling lies on its side, on bench or wrapper, and another one can be laid.

    The plates do not close on it, and a hand that points down cannot turn it over.
    """
    return is_too_high(bench, filling) and any(
        one is not filling
        and not is_too_high(bench, one)
        and is_within_reach(one.middle)
        and filling_heading(bench, one) is not None
        for one in bench.fillings
    )


def is_too_high(bench: Bench, filling: Filling) -> bool:
    """Return True if a filling on bench or wrapper is higher than one that lies flat."""
    wrapper = None if bench.in_work is None or bench.in_work.unseen else bench.in_work.wrapper
    is_laid = wrapper is not None and wrapper.is_under(filling.middle)
    ground = wrapper.hinge[2] + PLATE_HALF[2] if wrapper is not None and is_laid else bench.lift
    return ON_SIDE < filling.middle[2] - ground - FILLING_HEIGHT / 2.0 < FILLING_HEIGHT


def is_stuck(bench: Bench, piece: Piece) -> bool:
    """Return True if a hand has no room at a wrapper, and no push gives it room."""
    return not has_wrapper_room(bench, piece) and not push_of(bench, piece)


def is_filling_stuck(bench: Bench, filling: Filling) -> bool:
    """Return True if a hand has no room at a filling that it needs, and no push gives it room."""
    is_laid = any(one.wrapper.carries(filling.middle) for one in bench.pieces)
    return not is_laid and filling_heading(bench, filling) is None and not push_of_filling(bench, filling)


def has_wrapper_room(bench: Bench, piece: Piece) -> bool:
    """Return True if a hand can grip a wrapper where it is."""
    wrapper = piece.wrapper
    if bench.is_on_press(piece):
        return True  # fingers pass its sides
    if piece.is_wrapped and bench.is_whole_in_pot(piece):
        return True  # it stays there
    if wrapper.fold is None:
        return False  # nobody grips it across the hinge while it stands on its edge
    # One that is wrapped is gripped across its plates, even if it seems to be open as it lies askew.
    grip = wrapper.middle if piece.is_wrapped else wrapper.grip
    around = points_without(bench, grip, wrapper.yaw, wrapper.half)
    return has_room(with_rim(bench, around), grip, wrapper.yaw)


def filling_heading(bench: Bench, filling: Filling) -> float | None:
    """Return the heading at which a hand has room to grip a filling: it is square."""
    return next(iter(filling_headings(bench, filling)), None)


def filling_headings(bench: Bench, filling: Filling) -> tuple[float, ...]:
    """Return all headings at which a hand has room to grip a filling, the one as it lies first."""
    around = with_rim(bench, points_without(bench, filling.middle, filling.yaw, FILLING_HALF))
    return tuple(one for one in square_headings(filling.yaw) if has_room(around, filling.middle, one))


def points_without(bench: Bench, middle: Place, yaw: float, half: tuple[float, float]) -> Points:
    """Return the surroundings without a thing and what lies on it."""
    along, across = in_frame(bench.surroundings, middle, yaw)
    return bench.surroundings[(np.abs(along) > half[0] + OUTLINE) | (np.abs(across) > half[1] + OUTLINE)]


def with_rim(bench: Bench, points: Points) -> Points:
    """Return points (n, 3) with those of the pot's rim, of which what leans at it seems to be a part."""
    if bench.pot is None:
        return points
    (x, y, z), u, v = bench.pot, POT_HALF[0] + RIM / 2.0, POT_HALF[1] + RIM / 2.0
    a, b = (np.arange(-half, half + RIM_STEP, RIM_STEP) for half in (u, v))
    edges = [(one, side) for one in a for side in (-v, v)] + [(side, one) for one in b for side in (-u, u)]
    rim = np.array([(x + dx, y + dy, z) for dx, dy in edges])
    return np.concatenate([points, rim])


def push_of(bench: Bench, piece: Piece) -> Values:
    """Return a push that gives a hand room at a wrapper; none if there is none."""
    wrapper = piece.wrapper
    height = LOWEST if wrapper.fold is not None and not wrapper.is_closed else PUSH_HEIGHT
    return push_along_side(bench, wrapper.grip, wrapper.yaw, (*wrapper.half, height), (wrapper.yaw,))


def push_of_filling(bench: Bench, filling: Filling) -> Values:
    """Return a push that gives a hand room at a filling; none if there is none."""
    size = (*FILLING_HALF, PUSH_HEIGHT)
    return push_along_side(bench, filling.middle, filling.yaw, size, square_headings(filling.yaw))


def push_along_side(
    bench: Bench, middle: Place, yaw: float, size: tuple[float, float, float], grips: tuple[float, ...]
) -> Values:
    """Return the shortest push along a side of a thing on the bench to where a hand has room to grip it.

    Args:
        middle: of the thing.
        yaw: its heading.
        size: half its length and width, and the height of the tool that pushes it.
        grips: headings of a hand that may grip it.
    """
    half = size[:2]
    if middle[2] > bench.lift + PUSHED_HEIGHT:
        return {}
    around = points_without(bench, middle, yaw, half)
    solid = with_rim(bench, around)
    for length in PUSHES:
        for side in range(4):
            way = yaw + side * pi / 2.0
            u, v = cos(way), sin(way)
            out, wide = half[side % 2], half[1 - side % 2]
            end = (middle[0] + length * u, middle[1] + length * v, middle[2])
            if not any(has_room(solid, end, one) for one in grips):
                continue
            along, across = in_frame(around, middle, way)
            is_in_way = (along > 0.0) & (along < length + out + OUTLINE) & (np.abs(across) < wide + OUTLINE)
            if is_in_way.any():
                continue
            start = -(out + FINGERS_HALF + PUSH_AWAY)
            first, last = (
                (middle[0] + at * u, middle[1] + at * v, bench.lift + size[2])
                for at in (start, length - out - FINGERS_HALF)
            )
            steps = [tuple(np.add(first, share * np.subtract(last, first)).tolist()) for share in PUSH_SHARES]
            for heading in (wrap_heading(way, pi), wrap_heading(way + pi / 2.0, pi)):
                if all(has_room(solid, one, heading, CLOSED_HAND) for one in steps):
                    return {
                        "push_start": (first, UNCERTAINTY),
                        "push_end": (last, UNCERTAINTY),
                        "push_yaw": (heading, ANGLE_UNCERTAINTY),
                    }
    return {}
