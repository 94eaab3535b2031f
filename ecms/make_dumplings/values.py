"""Values of the module's variables from all that pictures have shown."""

from math import dist, pi

import numpy as np

from aeros.perception import Points, wrap_heading

from .bench import Bench
from .choice import filling_in_work
from .hand import OPEN_HAND, has_room, in_frame, is_within_reach
from .measures import (
    ANGLE_UNCERTAINTY,
    LOWEST,
    MIN_PIXELS,
    ON_PRESS_WITHIN,
    OUTLINE,
    OVER_BENCH,
    PLATE_HALF,
    POT_DEPTH,
    SAME_SIZE,
    UNCERTAINTY,
    WRAPPER_HALF,
    Place,
    Values,
)
from .room import (
    filling_heading,
    filling_headings,
    has_wrapper_room,
    is_filling_stuck,
    is_on_side,
    is_stuck,
    push_of,
    push_of_filling,
)
from .wrappers import is_near

ALIGNED_WITHIN = (0.008, 0.010, 0.006)
"""Greatest distance of an aligned hinge from its place along x, y and z, m."""

ALIGNED_YAW = 8.0 * pi / 180.0
"""Greatest heading of an aligned wrapper, rad."""

BED = ((-0.05, 0.05), 0.03)
"""Room of a filling on the press, from the place of the hinge: along x, and to either side, m."""

ASIDES = (tuple(0.38 + 0.04 * step for step in range(6)), tuple(-0.30 + 0.04 * step for step in range(16)))
"""Places along x and y on the bench where things that are in the way may be put, m."""

OVER_POT = 0.02
"""Height over the pot's opening from which something lies over it, m: a dumpling on its edge is lower."""

OVER_PRESS = (0.045, 0.065)
"""Heights over the hinge's place from which what is apart from wrappers, or any thing, covers the open press,
m: the handle reaches to 0.02, and a wrapper on its edge to 0.056."""

LAID_OUT = ((-0.115, 0.085), 0.06)
"""Room over the open press, from the place of the hinge: along x, and to either side, m."""

AROUND_DUMPLING = 0.05
"""Radius around the middle of a dumpling that belongs to it, m: one may lie on the pot's edge."""

ASIDE_HEIGHT, SPARE = 0.02, 0.012
"""Height of the tool there, and free space around the largest thing, m."""

BESIDE = ((0.0, 0.0), (0.006, 0.0), (-0.006, 0.0), (0.0, 0.006), (0.0, -0.006))
"""Distances from there at which the hand has room as well, m: edges in a picture are a pixel off."""


def values_of(bench: Bench) -> Values:
    """Return value and uncertainty of what is known of the wrapper and the filling in work."""
    return {**remaining_values(bench), **place_values(bench), **push_values(bench)}


def place_values(bench: Bench) -> Values:
    """Return the values of places, and what follows from them.

    Dough and filling stay "on the workspace" as parts of the dumpling, and so does a filling that a
    closed wrapper hides: then fewer fillings are seen than there are. A wrapper on its edge may be open:
    it counts as filled only if it was seen wrapped before.
    """
    values: Values = {}
    filling, piece, press = filling_in_work(bench), bench.in_work, bench.press
    others = [one.middle for one in bench.fillings if one is not filling]
    if others:
        values["other_filling_position"] = (others[0], UNCERTAINTY)
    if filling is not None:
        headings = filling_headings(bench, filling)
        values["filling_position"] = (filling.middle, UNCERTAINTY)
        values["filling_has_room"] = (bool(headings),)
        values["filling_yaw"] = (next(iter(headings), filling.yaw), ANGLE_UNCERTAINTY)
        values["filling_free_across"] = (len(headings) > 1,)
    values |= covered_values(bench)
    besides = [one for one in bench.pieces if one is not piece and not one.unseen]
    if besides:
        values["other_wrapper_position"] = (besides[0].wrapper.grip, UNCERTAINTY)
    values |= press_values(bench, is_covered=values.get("press_covered") == (True,))
    if piece is not None and piece.unseen and piece.is_wrapped and bench.may_hold_wrapper:
        values |= dict.fromkeys(("dough_on_workspace", "filling_on_workspace", "dumpling_wrapped"), (True,))
    if piece is None or piece.unseen:
        return values
    wrapper, fold = piece.wrapper, piece.wrapper.fold
    is_inside = filling is not None and is_near(filling.middle, wrapper)
    is_hidden = (bench.hidden > 0 and not piece.is_shut) or not bench.fillings
    is_hidden = is_hidden and not is_inside and wrapper.is_closed and fold is not None
    values |= {
        "wrapper_position": (wrapper.hinge, UNCERTAINTY),
        "wrapper_yaw": (wrapper.yaw, ANGLE_UNCERTAINTY),
        "wrapper_scale": (wrapper.size, SAME_SIZE / 2.0),
        "wrapper_has_room": (has_wrapper_room(bench, piece),),
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


def press_values(bench: Bench, *, is_covered: bool) -> Values:
    """Return if something has to be taken from the press first, where it is, and a place for it.

    There is a place, too, where the press is covered: for what the hand holds.
    """
    if bench.press is None:
        return {}
    values: Values = {"press_free": (True,)}
    near = [one for one in bench.pieces if not one.unseen and bench.is_on_press(one)]
    for one in near:
        is_perched = bench.is_perched(one.wrapper) and not one.is_wrapped
        if one is not bench.in_work or is_perched:
            values["press_free"] = (False,)
            values["blocker_position"] = (one.wrapper.grip, UNCERTAINTY)
            values["blocker_yaw"] = (wrap_heading(one.wrapper.yaw, pi), ANGLE_UNCERTAINTY)
            values["blocker_is_filling"] = (False,)
    for filling in bench.fillings:
        dx, dy, dz = (a - b for a, b in zip(filling.middle, bench.press, strict=True))
        is_at_bed = BED[0][0] < dx < BED[0][1] and abs(dy) < BED[1] and dz > -OVER_BENCH
        if is_at_bed and (not near or is_on_side(bench, filling)):
            values["press_free"] = (False,)
            values["blocker_position"] = (filling.middle, UNCERTAINTY)
            values["blocker_yaw"] = (filling.yaw, ANGLE_UNCERTAINTY)
            values["blocker_is_filling"] = (True,)
    aside = aside_place(bench) if is_covered or values["press_free"] == (False,) else None
    if aside is not None:
        values["aside_place"] = (aside, UNCERTAINTY)
    return values


def aside_place(bench: Bench) -> Place | None:
    """Return the free place on the bench, for a wrapper or a filling, that is nearest to the press."""
    press = bench.press
    if press is None:
        return None
    spots = [(x, y, bench.lift + ASIDE_HEIGHT) for x in ASIDES[0] for y in ASIDES[1]]
    for spot in sorted(spots, key=lambda one: dist(one[:2], press[:2])):
        along, across = in_frame(bench.surroundings, spot, 0.0)
        is_occupied = (np.abs(along) < WRAPPER_HALF[0] + SPARE) & (np.abs(across) < WRAPPER_HALF[1] + SPARE)
        hands = [(spot[0] + dx, spot[1] + dy, LOWEST) for dx, dy in BESIDE]
        if not is_occupied.any() and all(has_room(bench.surroundings, one, 0.0) for one in hands):
            return spot
    return None


def covered_values(bench: Bench) -> Values:
    """Return what is known of the places over pot and press, and which of them something covers."""
    values = pot_values(bench)
    places = {"pot_covered": bench.pot, "press_covered": bench.press}
    if bench.is_lid_open and bench.press is not None:
        values["press_covered"] = (is_press_covered(bench, bench.press),)
    covered = [place for name, place in places.items() if values.get(name) == (True,)]
    if covered or places.keys() <= values.keys():
        values["place_covered"] = (bool(covered),)
    if covered and covered[0] is not None:
        values["covered_place"] = (covered[0], UNCERTAINTY)
    return values


def is_press_covered(bench: Bench, press: Place) -> bool:
    """Return True if something is on the open press that is no wrapper and no filling."""
    along, across = in_frame(bench.surroundings, press, 0.0)
    (back, front), side = LAID_OUT
    over = bench.surroundings[(along > back) & (along < front) & (np.abs(across) < side)]
    high = over[:, 2] - press[2]
    is_other = high > OVER_PRESS[0]
    for one in bench.pieces:
        is_near = np.hypot(*(over[:, :2] - np.array(one.wrapper.middle[:2])).T) < AROUND_DUMPLING
        is_other &= ~is_near | (high > OVER_PRESS[1])
    return int(is_other.sum()) >= MIN_PIXELS


def pot_values(bench: Bench) -> Values:
    """Return the place over the pot with the least in its way, beside the dumplings that are there.

    There is no such place where something lies over the pot, as a lid, wherever a dumpling is let go.
    """
    if bench.pot is None:
        return {}
    x, y, z = bench.pot
    aside = (-0.038, 0.040) if bench.count > 1 else (0.0, 0.045)
    first = aside[min(len(bench.settled), 1)]
    low = bench.surroundings[bench.surroundings[:, 2] > z - POT_DEPTH + OVER_BENCH]

    def crowd(points: Points, place: Place) -> int:
        along, across = in_frame(points, place, 0.0)
        half = (PLATE_HALF[0] + OUTLINE, OPEN_HAND[1].wide[1])
        crowded = (np.abs(along) < half[0]) & (np.abs(across) < half[1])
        return max(int(crowded.sum()) - MIN_PIXELS, 0)  # fewer are noise

    places = [(x + dx, y + dy, z) for dx in (first, 0.0, -0.045, 0.045) for dy in (0.0, 0.035, -0.035)]
    over = low[low[:, 2] > z + OVER_POT]
    for one in bench.pieces:
        over = over[np.hypot(*(over[:, :2] - np.array(one.wrapper.middle[:2])).T) > AROUND_DUMPLING]
    free = [one for one in places if crowd(over, one) == 0]
    best = min(free or places, key=lambda one: crowd(low, one))
    return {"pot_place": (best, UNCERTAINTY), "pot_covered": (not free,)}


def remaining_values(bench: Bench) -> Values:
    """Return if enough wrappers and fillings are left, and what is the matter with the others."""
    lost = [one for one in bench.pieces if one.unseen > 1]
    kept = [one for one in bench.pieces if one.unseen <= 1]
    far = [one for one in kept if not one.is_within_reach]
    near = [one for one in kept if one.is_within_reach]
    useless = [one for one in near if one.is_useless]
    tight = [one for one in near if not one.is_useless and is_stuck(bench, one)]
    far_fillings = [one for one in bench.fillings if not is_within_reach(one.middle)]
    tight_fillings = [
        one for one in bench.fillings if one not in far_fillings and is_filling_stuck(bench, one)
    ]
    closed = sum(one.wrapper.is_closed and not one.is_shut for one in near)
    hidden = min(bench.hidden, closed)
    usable = len(bench.fillings) - len(far_fillings) - len(tight_fillings) + hidden
    wrappers = len(near) - len(useless) - len(tight)
    needed = bench.count - len(bench.settled)
    enough = {
        "wrappers_suffice": wrappers + int(bench.may_hold_wrapper) >= needed,
        "fillings_suffice": usable + int(bench.is_held) >= needed,
    }
    # What is missed, or was never seen, may be where pictures do not show the bench.
    is_hidden = bench.hidden_place is not None
    values: Values = {
        **{name: (one,) for name, one in enough.items() if one or not is_hidden},
        "bench_hidden": (is_hidden,),
        "wrappers_lost": (len(lost),),
        "wrappers_out_of_reach": (len(far),),
        "wrappers_shut": (sum(one.is_shut and not one.is_too_large for one in useless),),
        "wrappers_too_large": (sum(one.is_too_large for one in useless),),
        "wrappers_not_folding": (sum(not (one.is_shut or one.is_too_large) for one in useless),),
        "wrappers_without_room": (len(tight),),
        "fillings_lost": (bench.hidden - hidden,),
        "fillings_out_of_reach": (len(far_fillings),),
        "fillings_without_room": (len(tight_fillings),),
    }
    if bench.hidden_place is not None:
        values["hidden_place"] = (bench.hidden_place, UNCERTAINTY)
    for one in (*tight, *useless, *far, *lost):
        values["wrapper_last_seen"] = (one.wrapper.hinge, UNCERTAINTY)
    return values


def push_values(bench: Bench) -> Values:
    """Return a push that gives a hand room at the wrapper, or else at the filling, if it has none."""
    piece, filling = bench.in_work, filling_in_work(bench)
    if piece is not None and not piece.unseen and not has_wrapper_room(bench, piece):
        return push_of(bench, piece)
    if filling is not None and filling_heading(bench, filling) is None:
        return push_of_filling(bench, filling)
    return {}
