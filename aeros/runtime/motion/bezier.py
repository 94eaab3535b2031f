"""Cubic Bézier pieces of a joint path, enclosed by the convex hull of their control points."""

from __future__ import annotations

from typing import NamedTuple

from aeros.runtime.ports import JointPath, JointVector

Piece = tuple[JointVector, JointVector, JointVector, JointVector]


class JointBox(NamedTuple):
    """A box of joint positions.

    Attributes:
        middle: the middle of each joint's values, rad.
        width: their greatest distance from there, rad.
    """

    middle: JointVector
    width: JointVector


def joint_box(pieces: list[Piece]) -> JointBox:
    """Compute a box of joint positions that encloses the pieces: the box of their control points.

    Args:
        pieces: at least one piece.

    Returns:
        The box.
    """
    columns = [column for piece in pieces for column in piece]
    ranges = [(min(values), max(values)) for values in zip(*columns, strict=True)]
    return JointBox(
        tuple([(low + high) / 2.0 for low, high in ranges]),
        tuple([(high - low) / 2.0 for low, high in ranges]),
    )


class PathChord(NamedTuple):
    """Chord of a path: the joints are at middle + λ·half + ε, λ in [−1, 1], |ε| ≤ width for each joint.

    Attributes:
        middle: middle of the chord, for each joint, rad.
        half: half of the chord from its start to its end, for each joint, rad.
        width: greatest distance of the path from the chord, for each joint, rad.
    """

    middle: JointVector
    half: JointVector
    width: JointVector


def path_chord(pieces: list[Piece]) -> PathChord:
    """Compute the straight line from the start of the pieces to their end, and the pieces' distance from it.

    Each control point is compared with the point of the chord at its own number. A point of the path is a
    convex combination of control points, so it is at most as far from the same combination of chord points as
    the farthest control point is from its own.

    Args:
        pieces: neighbouring pieces of a path.

    Returns:
        The chord, rad.
    """
    columns = [column for piece in pieces for column in piece]
    step = 2.0 / (3 * len(pieces))
    shares = [(3 * number + corner) * step - 1.0 for number in range(len(pieces)) for corner in range(4)]
    rows = []
    for values in zip(*columns, strict=True):
        middle, half = (values[0] + values[-1]) / 2.0, (values[-1] - values[0]) / 2.0
        away = [q - middle - share * half for q, share in zip(values, shares, strict=True)]
        rows.append((middle, half, max(map(abs, away))))
    return PathChord(*zip(*rows, strict=True))


def split_in_half(piece: Piece) -> tuple[Piece, Piece]:
    """Split a piece in two, by de Casteljau's construction.

    Args:
        piece: the piece.

    Returns:
        Its first and its second half.
    """
    a, b, c, d = piece
    ab, bc, cd = _middle(a, b), _middle(b, c), _middle(c, d)
    abc, bcd = _middle(ab, bc), _middle(bc, cd)
    whole = _middle(abc, bcd)
    return (a, ab, abc, whole), (whole, bcd, cd, d)


def remaining_path(path: JointPath, s: float) -> list[Piece]:
    """Cut off the beginning of a path.

    Args:
        path: the whole path.
        s: path parameter from which on it is kept, 0 to 1.

    Returns:
        The rest of the path.
    """
    position = s * len(path)
    index = min(int(position), len(path) - 1)
    return [_split_after(path[index], position - index), *path[index + 1 :]]


def _split_after(piece: Piece, u: float) -> Piece:
    """Return the piece from its parameter u on, by de Casteljau's construction."""
    a, b, c, d = piece
    ab, bc, cd = _lerp(a, b, u), _lerp(b, c, u), _lerp(c, d, u)
    abc, bcd = _lerp(ab, bc, u), _lerp(bc, cd, u)
    return (_lerp(abc, bcd, u), bcd, cd, d)


def _lerp(a: JointVector, b: JointVector, u: float) -> JointVector:
    return tuple([x + u * (y - x) for x, y in zip(a, b, strict=True)])


def _middle(a: JointVector, b: JointVector) -> JointVector:
    return tuple([(x + y) / 2.0 for x, y in zip(a, b, strict=True)])


class Derivatives(NamedTuple):
    """Derivatives of a piece by its own parameter x in [0, 1], for each joint.

    Attributes:
        first, second: q' and q'' in the middle, at x = 1/2.
        max_first, max_second: upper bounds of |q'| and |q''| on the whole piece.
        third: |q'''|, which is constant.
    """

    first: JointVector
    second: JointVector
    max_first: JointVector
    max_second: JointVector
    third: JointVector


def derivatives(piece: Piece) -> Derivatives:
    """Compute the derivatives of a piece by its own parameter.

    dq/dx = 3·(differences of control points) is quadratic, d²q/dx² linear, d³q/dx³ constant.

    Args:
        piece: the piece.

    Returns:
        Their values in the middle, and bounds of their magnitudes.
    """
    rows = []
    for a, b, c, d in zip(*piece, strict=True):
        u, v, w = b - a, c - b, d - c
        second, last = 6.0 * (v - u), 6.0 * (w - v)
        rows.append(
            (
                0.75 * (u + 2.0 * v + w),
                (second + last) / 2.0,
                3.0 * max(abs(u), abs(v), abs(w)),
                max(abs(second), abs(last)),
                abs(last - second),
            )
        )
    first, second_, most_first, most_second, third = zip(*rows, strict=True)
    return Derivatives(first, second_, most_first, most_second, third)
