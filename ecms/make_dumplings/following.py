"""The bench from picture to picture, and by the force of the press between them."""

from dataclasses import replace
from math import dist

import numpy as np

from aeros.perception import Picture, View

from .bench import Bench
from .choice import chosen_wrapper
from .measures import FILLING_GAP, GAP_WITHIN, MAX_HEIGHT, OVER_BENCH, Place
from .pictures import find_hidden_place, level_points, look_from_above, shows_filling
from .wrappers import MOST_PRESSES, Piece, Wrapper

COOKING_TIME = 5.0
"""Time in the pot after which a dumpling is cooked, s."""

SEALING_LOAD = 3.0
"""Load on the press's bed above which the lid presses on a closed wrapper, N. Wrapper and filling weigh
1.3 N; from 3 N on, more than 1 N is on the filling, which seals."""

LID_OVER = 0.03
"""Distance of the handle from the press's hinge, towards +x, from which the lid is over the wrapper, m."""

LID_OPEN = -0.069
"""Way of the handle from the press's hinge along x up to which the lid is open, m: at 0 rad it is -0.075, and
here, at 16 degrees, the handle's outer end is still lower (0.044) than what covers the press."""

STIRRED = 0.008
"""Displacement of a dumpling in the pot after which it may have been out of it, m."""


def _raised(place: Place | None, lift: float) -> Place | None:
    return None if place is None else (place[0], place[1], place[2] + lift)


def with_press(bench: Bench, view: View) -> Bench:
    """Note load and lid of the press, whether the hand may hold something, and how much is asked for."""
    is_pressed = any(one.value > SEALING_LOAD for one in view.samples["press_force"])
    handle, press = (view.readings.get(name) for name in ("press_handle_position", "press_position"))
    along = None if handle is None or press is None else handle[0] - press[0]
    is_held, gap = view.readings.get("holding") is not False, view.readings.get("finger_gap")
    return replace(
        bench,
        is_pressed=bench.is_pressed or is_pressed,
        is_lid_over=bench.is_lid_over or (along is not None and along > LID_OVER),
        is_lid_open=along is not None and along < LID_OPEN,
        is_held=is_held,
        holds_filling=is_held and gap is not None and abs(gap - FILLING_GAP) < GAP_WITHIN,
        count=int(view.readings.get("count") or 1),
    )


def seen_from_side(bench: Bench, picture: Picture) -> Bench:
    """Judge if the wrapper in work is a dumpling, or shut without a filling, or with one that sticks out.

    The lid does not push a filling in, so one that still sticks out after the lid has pressed again stays so.
    """
    piece = bench.in_work
    if piece is None or not piece.wrapper.is_closed:
        return bench
    filled = shows_filling(picture, piece.wrapper)
    is_pressed = piece.is_pressed or bench.is_pressed
    is_failure = filled is False and (piece.is_pressed_anew or bench.is_pressed)
    failures = piece.failures + int(is_failure)
    new = replace(
        piece,
        is_pressed=is_pressed,
        is_wrapped=filled is True and is_pressed,
        is_shut=piece.is_shut or (filled is None and is_pressed) or failures >= MOST_PRESSES,
        failures=failures,
        is_pressed_anew=False,
    )
    pieces = tuple(new if one is piece else one for one in bench.pieces)
    return replace(bench, pieces=pieces, is_pressed=False)


def seen_from_above(bench: Bench, picture: Picture, press: Place | None, pot: Place | None) -> Bench:
    """Follow what a picture from above shows, with the surveyed fixtures."""
    points, seen_lift = level_points(picture)
    lift = bench.lift if seen_lift is None else seen_lift
    bench = replace(
        bench,
        is_shown=seen_lift is not None,
        hidden_place=find_hidden_place(points, picture.rgb.astype(np.float64), lift),
        lift=lift,
        press=_raised(press, lift),
        pot=_raised(pot, lift),
    )
    shown = look_from_above(picture, points, bench.settled, bench.pot)
    flat = points.reshape(-1, 3)
    around = flat[(flat[:, 2] > lift + OVER_BENCH) & (flat[:, 2] < MAX_HEIGHT)]
    bench = replace(bench, fillings=tuple(shown.fillings), surroundings=around)
    bench = with_times(with_counts(with_wrappers(bench, shown.wrappers)), picture.time)
    settled = [
        one.wrapper.middle
        for one in bench.pieces
        if one.is_wrapped and one.in_pot_since is not None and picture.time - one.in_pot_since >= COOKING_TIME
    ]
    if settled:
        before = bench.in_work
        pieces = tuple(one for one in bench.pieces if one.wrapper.middle not in settled)
        work = pieces.index(before) if before in pieces else None
        bench = replace(bench, pieces=pieces, work=work, settled=(*bench.settled, *settled))
        shown = look_from_above(picture, points, bench.settled, bench.pot)
        bench = replace(bench, fillings=tuple(shown.fillings))
    return replace(bench, work=chosen_wrapper(bench))


def with_wrappers(bench: Bench, wrappers: list[Wrapper]) -> Bench:
    """Find each wrapper among those of before: what has not moved first."""
    ways = sorted(
        (dist(piece.wrapper.middle, one.middle), i, k)
        for i, piece in enumerate(bench.pieces)
        for k, one in enumerate(wrappers)
    )
    found: dict[int, int] = {}
    for _, i, k in ways:
        if i not in found and k not in found.values():
            found[i] = k
    pieces: list[Piece] = []
    work = None
    for i, piece in enumerate(bench.pieces):
        is_in_work = i == bench.work
        is_new = is_in_work and bench.is_pressed
        pressed = replace(
            piece,
            is_pressed=piece.is_pressed or is_new,
            is_pressed_anew=piece.is_pressed_anew or is_new,
        )
        seen = None if i not in found else wrappers[found[i]]
        if seen is None and piece.looks == 1:
            continue  # what was seen once and never again was no wrapper
        if is_in_work:
            work = len(pieces)
        if seen is None:
            pieces.append(replace(pressed, unseen=piece.unseen + 1, in_pot_since=None))
            continue
        is_left = is_in_work and dist(seen.hinge, piece.wrapper.hinge) < STIRRED
        tries = piece.tries + 1 if is_left and not bench.is_on_press(piece) else 0
        if seen.scale is None:
            seen = seen.scaled(piece.wrapper.scale)
        shown = replace(pressed, wrapper=seen, unseen=0, looks=piece.looks + 1, tries=tries)
        if not seen.is_closed:
            is_perched = bench.is_perched(seen) and not bench.is_perched(piece.wrapper)
            presses = piece.presses + int(is_in_work and bench.is_lid_over) + int(is_perched)
            shown = replace(
                shown,
                is_wrapped=False,
                is_pressed=False,
                is_shut=False,
                failures=0,
                was_open=True,
                presses=presses,
            )
        pieces.append(shown)
    pieces += [
        Piece(one, was_open=not one.is_closed) for k, one in enumerate(wrappers) if k not in found.values()
    ]
    is_pressed = bench.is_pressed and bench.work is None
    return replace(bench, pieces=tuple(pieces), work=work, is_pressed=is_pressed, is_lid_over=False)


def with_counts(bench: Bench) -> Bench:
    """Count fillings: when all are seen elsewhere or held, a closed wrapper has none."""
    free = sum(
        not any(bench.is_inside(one.middle, piece) for piece in bench.pieces) for one in bench.fillings
    )
    most, held = max(bench.most_fillings, len(bench.settled) + free), int(bench.holds_filling)
    pieces = list(bench.pieces)
    for i, piece in enumerate(bench.pieces):
        is_known = piece.is_wrapped or piece.was_open
        if is_known and piece.wrapper.is_closed and most <= len(bench.settled) + free + held:
            pieces[i] = replace(piece, is_wrapped=False, is_shut=piece.wrapper.fold is not None)
    return replace(bench, pieces=tuple(pieces), most_fillings=most)


def with_times(bench: Bench, time: float) -> Bench:
    """Time wrappers in the pot: one that has moved there may have been out of it."""
    pieces = list(bench.pieces)
    for i, piece in enumerate(bench.pieces):
        at, since, before = piece.wrapper.middle, piece.in_pot_since, piece.in_pot_at
        if piece.unseen or not bench.is_whole_in_pot(piece):
            pieces[i] = replace(piece, in_pot_since=None)
        elif since is None or before is None or dist(at, before) > STIRRED:
            pieces[i] = replace(piece, in_pot_since=time, in_pot_at=at)
    return replace(bench, pieces=tuple(pieces))
