"""Bézier pieces of one joint, against numbers worked out by hand."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.motion.bezier import (
    Derivatives,
    JointBox,
    PathChord,
    Piece,
    derivatives,
    joint_box,
    path_chord,
    remaining_path,
    split_in_half,
)


def piece(*points: float) -> Piece:
    a, b, c, d = ((q,) for q in points)
    return a, b, c, d


LINE, CUBE = piece(0.0, 1.0, 2.0, 3.0), piece(0.0, 0.0, 0.0, 8.0)
"""3x and 8x³."""

COORDINATES = st.floats(-4.0, 4.0)
PIECES = st.builds(piece, COORDINATES, COORDINATES, COORDINATES, COORDINATES)


def value(of: Piece, x: float) -> float:
    """Bernstein's form."""
    (a,), (b,), (c,), (d,) = of
    y = 1.0 - x
    return y**3 * a + 3.0 * y * y * x * b + 3.0 * y * x * x * c + x**3 * d


def test_a_box_is_that_of_all_control_points() -> None:
    assert joint_box([piece(0.0, 3.0, -1.0, 1.0)]) == JointBox((1.0,), (2.0,))
    assert joint_box([LINE, piece(3.0, 3.0, 9.0, 4.0)]) == JointBox((4.5,), (4.5,))
    two = ((0.0, 1.0), (1.0, 1.0), (2.0, 1.0), (4.0, 1.0))
    assert joint_box([two]) == JointBox((2.0, 1.0), (2.0, 0.0))


def test_a_straight_path_is_its_own_chord() -> None:
    straight = path_chord([LINE])
    assert (straight.middle, straight.half) == ((1.5,), (1.5,))
    assert straight.width == pytest.approx((0.0,), abs=1e-12)
    found = path_chord([LINE, piece(3.0, 4.0, 5.0, 6.0)])
    assert (found.middle, found.half) == ((3.0,), (3.0,))
    assert found.width == pytest.approx((0.0,), abs=1e-12)


def test_a_chord_is_as_wide_as_the_farthest_control_point_is_from_its_own_place() -> None:
    assert path_chord([piece(0.0, 0.0, 0.0, 3.0)]) == PathChord((1.5,), (1.5,), (2.0,))
    assert path_chord([piece(3.0, 3.0, 1.0, 0.0)]) == PathChord((1.5,), (-1.5,), (1.0,))
    found = path_chord([LINE, piece(3.0, 5.0, 5.0, 6.0)])
    assert (found.middle, found.half) == ((3.0,), (3.0,))
    assert found.width == pytest.approx((1.0,))


def test_halves_meet_in_the_middle() -> None:
    assert split_in_half(LINE) == (piece(0.0, 0.5, 1.0, 1.5), piece(1.5, 2.0, 2.5, 3.0))
    assert split_in_half(CUBE) == (piece(0.0, 0.0, 0.0, 1.0), piece(1.0, 2.0, 4.0, 8.0))


@given(PIECES, st.floats(0.0, 1.0))
def test_halves_are_the_same_path(whole: Piece, x: float) -> None:
    first, second = split_in_half(whole)
    assert value(first, x) == pytest.approx(value(whole, x / 2.0), abs=1e-12)
    assert value(second, x) == pytest.approx(value(whole, 0.5 + x / 2.0), abs=1e-12)


@pytest.mark.parametrize(
    ("s", "rest"),
    [
        (0.0, [LINE, CUBE]),
        (0.25, [piece(1.5, 2.0, 2.5, 3.0), CUBE]),
        (0.5, [CUBE]),
        (0.75, [piece(1.0, 2.0, 4.0, 8.0)]),
        (1.0, [piece(8.0, 8.0, 8.0, 8.0)]),
    ],
)
def test_the_rest_of_a_path_begins_where_it_was_cut(s: float, rest: Any) -> None:
    assert remaining_path((LINE, CUBE), s) == rest


@given(PIECES, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_the_rest_of_a_piece_is_the_same_path(whole: Piece, s: float, x: float) -> None:
    (rest,) = remaining_path((whole,), s)
    assert value(rest, x) == pytest.approx(value(whole, s + x * (1.0 - s)), abs=1e-12)


def test_derivatives_of_a_line_and_of_a_cube() -> None:
    assert derivatives(LINE) == Derivatives((3.0,), (0.0,), (3.0,), (0.0,), (0.0,))
    # 8x³: 24x² and 48x are 6 and 24 in the middle, at most 24 and 48.
    assert derivatives(CUBE) == Derivatives((6.0,), (24.0,), (24.0,), (48.0,), (48.0,))
    # Reversed: 8(1 - x)³, whose rates have the same magnitudes, greatest at the start.
    assert derivatives(piece(8.0, 0.0, 0.0, 0.0)) == Derivatives((-6.0,), (24.0,), (24.0,), (48.0,), (48.0,))


def test_derivatives_of_a_bend_in_the_middle() -> None:
    # Differences 0, 2, 0: q' = 12x(1 - x), whose bound is that of its control points, 6; q'' = 12 - 24x.
    bend = Derivatives((3.0,), (0.0,), (6.0,), (12.0,), (24.0,))
    assert derivatives(piece(0.0, 0.0, 2.0, 2.0)) == bend


@given(PIECES)
def test_bounds_of_derivatives_hold_along_the_piece(whole: Piece) -> None:
    found = derivatives(whole)
    values = [value(whole, x / 64.0) for x in range(65)]
    first = [(b - a) * 64.0 for a, b in pairwise(values)]
    assert max(map(abs, first)) <= found.max_first[0] + 1e-9
    second = [(b - a) * 64.0 for a, b in pairwise(first)]
    assert max(map(abs, second)) <= found.max_second[0] + 1e-6


@given(st.lists(PIECES, min_size=1, max_size=3), st.floats(0.0, 1.0))
def test_box_and_chord_enclose_the_path(pieces: list[Piece], x: float) -> None:
    box, chord = joint_box(pieces), path_chord(pieces)
    n = len(pieces)
    for number, one in enumerate(pieces):
        q = value(one, x)
        assert abs(q - box.middle[0]) <= box.width[0] + 1e-12
        on_chord = chord.middle[0] + (2.0 * (number + x) / n - 1.0) * chord.half[0]
        assert abs(q - on_chord) <= chord.width[0] + 1e-12
