"""A camera's place, from a picture of what the robot stands on: the top of a box whose place it knows.

The top is level and its edges are straight, so a single picture shows how the camera is turned and moved in
all six ways: the plane of the top shows tilt and height, and two of its edges the rest. What hides parts of
it, as the arm does, shows no edge of it, as it is nearer than the top. Units: m, rad. Frame: W.
"""

from __future__ import annotations

from math import acos, cos, radians, sin, sqrt, tan
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.perception.components import connected_components
from aeros.perception.obstacles import DepthPicture, SpaceBox
from aeros.perception.planes import find_plane
from aeros.perception.points import Mask, Points, Vector3, point_cloud

Matrix = NDArray[np.float64]

_WITHIN: Final = 0.07
"""Greatest distance of the top in a picture from its place, m: 3° of a camera that is 1 m away, and 15 mm; of
one that is farther away, as much more."""

_INNER: Final = 0.02
"""Distance from the edges within which a point may be of something else, m."""

_ON_TOP: Final = (0.007, 0.012)
"""Bounds of the greatest distance of a point of the top from its plane, m, which is `_NOISES` standard
deviations of the noise."""

_NOISES: Final = 4.0

_GREATEST_NOISE: Final = 0.003
"""Greatest standard deviation of depth with which edges are found, m."""

_MEDIAN_DEVIATION: Final = 0.6745
"""Median distance of normally distributed numbers from their mean, in standard deviations."""

_PLANE_TOLERANCE: Final = 0.006
"""The same for the points that the plane is fitted to, m."""

_CANDIDATES: Final = 1500
"""Number of points among which the plane is looked for."""

_TRIES: Final = 60
"""Number of planes to try."""

_LEAST_TOP: Final = 200
"""Least number of pixels of the top that show its plane."""

_GREATEST_TILT: Final = 0.07
"""Greatest tilt of a camera that is corrected, rad: one with more has fallen over."""

_LEAST_HEIGHT: Final = 0.35
"""Least height of a camera over the top, over its distance: a more grazing view shows no edge well."""

_LEAST_EDGE: Final = 40
"""Least number of pixels of its edges."""

_GATES: Final = (1.0, 0.6, 0.3, 0.15, 0.09, 0.09)
"""Greatest distance of an edge's pixel from the edge, in one fit after the other, over `_WITHIN`."""

_EDGE_NOISE: Final = 0.6
"""Standard deviation of the place of one pixel of an edge, pixels."""

_PRIOR_TURN, _PRIOR_SHIFT = 0.03, 0.03
"""Standard deviations of a camera's heading, rad, and of its place, m, before a picture is taken."""

_FINEST: Final = 0.003
"""Size of a pixel, m, below which edges are not found any better."""

_TRUSTED: Final = (0.006, 0.006)
"""Greatest standard deviations of heading, rad, and shift, m, that make a fit of use."""

_LEAST_SHARE: Final = 0.6
"""Least share of the pixels near an edge at first that are on it in the end: others are of something else."""

_GREATEST_RESIDUAL: Final = 1.2
"""Greatest root mean square distance of the edges' pixels from the edges, pixels."""


class _Scale(NamedTuple):
    """How large the top is in a picture: distance from the eye, greatest one from its place, pixel; m."""

    away: float
    within: float
    pixel: float


class CameraShift(NamedTuple):
    """A camera's true place, seen from the place at which it is believed to be.

    Its axes are right, up and ahead in the picture, so it stays the same when a camera moves that is mounted
    on something that moves.

    Attributes:
        rotation: true axes, as columns, in those of the believed place (3, 3).
        shift: of the eye, in the same axes (3,), m.
        pixel: size of a pixel of the picture that showed it, on the top, m.
    """

    rotation: Matrix
    shift: NDArray[np.float64]
    pixel: float = 0.0

    @property
    def angle(self) -> float:
        """Angle of the rotation, rad."""
        return acos(min(1.0, max(-1.0, (float(np.trace(self.rotation)) - 1.0) / 2.0)))

    def distance(self) -> float:
        """Bound how far a thing in the middle of the picture, 1 m away, is seen from where it is.

        Returns:
            The distance, m.
        """
        return float(np.linalg.norm(self.shift)) + self.angle

    def difference(self, other: CameraShift) -> float:
        """Compare with another one.

        Args:
            other: the other one.

        Returns:
            Bound of the distance between the places at which both show a thing that is 1 m away, m.
        """
        turn = CameraShift(self.rotation @ other.rotation.T, self.shift - other.shift)
        return turn.distance()


def true_place(picture: DepthPicture, shift: CameraShift) -> tuple[Vector3, Vector3, Vector3]:
    """Compute the true place of a camera.

    Args:
        picture: with the place at which the camera is believed to be.
        shift: from there to the true one.

    Returns:
        Eye, target and up, m.
    """
    axes = _axes(picture)
    eye = np.array(picture.eye) + axes @ shift.shift
    _, up, ahead = (axes @ shift.rotation).T
    away = float(np.linalg.norm(np.subtract(picture.target, picture.eye)))
    (a, b, c), (d, e, f), (g, h, i) = eye.tolist(), (eye + away * ahead).tolist(), up.tolist()
    return (a, b, c), (d, e, f), (g, h, i)


def find_camera_shift(picture: DepthPicture, box: SpaceBox) -> CameraShift | None:
    """Find a camera's true place from the top of a box that is level, and whose place is known.

    Args:
        picture: with the place at which the camera is believed to be.
        box: along the axes of W, m.

    Returns:
        The shift; None if the picture does not show enough of the top and of its edges, or if the edges are
        not those of the box.
    """
    scale = _scale(picture, box)
    if picture.eye[2] - box.upper[2] < _LEAST_HEIGHT * scale.away:
        return None
    points = _around_top(point_cloud(*picture), box, scale.within)
    eye = np.array(picture.eye)
    level = _level_rotation(points, eye, box, scale.within)
    if level is None:
        return None
    turned = eye + (points - eye) @ level.T
    top = _find_top(turned, box, scale.within)
    if top is None:
        return None
    is_top, height, depth = top
    edge = _edge_points(turned, is_top, eye, height, depth)
    fit = _fit_edges(edge, box, scale)
    if fit is None:
        return None
    turn, (u, v) = fit
    middle = _middle(box)
    spin = np.array(((cos(turn), -sin(turn), 0.0), (sin(turn), cos(turn), 0.0), (0.0, 0.0, 1.0)))
    rotation = spin @ level
    place = middle + spin @ (eye - middle) + np.array((u, v, box.upper[2] - height))
    axes = _axes(picture)
    return CameraShift(axes.T @ rotation @ axes, axes.T @ (place - eye), scale.pixel)


def _axes(picture: DepthPicture) -> Matrix:
    """Return the directions right, up and ahead in a picture, as columns."""
    ahead = np.subtract(picture.target, picture.eye)
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross(ahead, picture.up)
    right = right / np.linalg.norm(right)
    return np.stack((right, np.cross(right, ahead), ahead), axis=1)


def _middle(box: SpaceBox) -> Points:
    x, y, _ = np.add(box.lower, box.upper) / 2.0
    return np.array((x, y, 0.0))


def _is_over(points: Points, box: SpaceBox, by: float) -> Mask:
    """Return the points above or below a box whose sides are moved out by a distance."""
    lower, upper = box.grown(by)
    x, y = points[..., 0], points[..., 1]
    inside: Mask = (x >= lower[0]) & (x <= upper[0]) & (y >= lower[1]) & (y <= upper[1])
    return inside


def _scale(picture: DepthPicture, box: SpaceBox) -> _Scale:
    """Return how large the top is in a picture."""
    top = _middle(box) + np.array((0.0, 0.0, box.upper[2]))
    away = float(np.linalg.norm(top - np.array(picture.eye)))
    pixel = 2.0 * away * tan(radians(picture.field_of_view) / 2.0) / picture.depth.shape[0]
    return _Scale(away, _WITHIN * max(1.0, away), max(pixel, _FINEST))


def _around_top(points: Points, box: SpaceBox, within: float) -> Points:
    """Return the part of a picture's points (h, w, 3) that may show the top, with the pixels next to it."""
    near = _is_over(points, box, within) & (np.abs(points[..., 2] - box.upper[2]) < within)
    rows, columns = np.nonzero(near.any(axis=1))[0], np.nonzero(near.any(axis=0))[0]
    if len(rows) == 0:
        return points[:0, :0]
    return points[max(0, rows[0] - 1) : rows[-1] + 2, max(0, columns[0] - 1) : columns[-1] + 2]


def _level_rotation(points: Points, eye: Points, box: SpaceBox, within: float) -> Matrix | None:
    """Return the turn about the eye that makes the top level."""
    near = points[_is_over(points, box, -_INNER) & (np.abs(points[..., 2] - box.upper[2]) < within)]
    if len(near) < _LEAST_TOP:
        return None
    found = find_plane(near[:: max(1, len(near) // _CANDIDATES)], _PLANE_TOLERANCE, _TRIES)
    if found is None:
        return None
    normal, middle = np.array(found[0].normal), np.array(found[0].middle)
    on_top = near[np.abs((near - middle) @ normal) <= _PLANE_TOLERANCE]
    if len(on_top) < _LEAST_TOP:
        return None
    centred = on_top - on_top.mean(axis=0)
    x, y, z = np.linalg.eigh(centred.T @ centred)[1][:, 0]
    x, y, z = (x, y, z) if z > 0.0 else (-x, -y, -z)
    if acos(min(1.0, z)) > _GREATEST_TILT:
        return None
    # Rodrigues' formula for the turn of the normal to the vertical, about n × z = (y, -x, 0).
    skew = np.array(((0.0, 0.0, -x), (0.0, 0.0, -y), (x, y, 0.0)))
    rotation: Matrix = np.eye(3) + skew + skew @ skew / (1.0 + z)
    return rotation


def _find_top(points: Points, box: SpaceBox, within: float) -> tuple[Mask, float, float] | None:
    """Return the pixels of the top in a level picture, its height, and how far off that they may seem."""
    near = _is_over(points, box, -_INNER) & (np.abs(points[..., 2] - box.upper[2]) < within)
    heights = np.sort(points[near][:, 2])
    if len(heights) < _LEAST_TOP:
        return None
    # The level at which most of them are.
    count = np.searchsorted(heights, heights + 2.0 * _PLANE_TOLERANCE, "right") - np.arange(len(heights))
    first = int(np.argmax(count))
    height = float(np.median(heights[first : first + int(count[first])]))
    off = np.abs(heights - height)
    noise = float(np.median(off[off < _NOISES * _GREATEST_NOISE])) / _MEDIAN_DEVIATION
    if noise > _GREATEST_NOISE:
        return None
    depth = min(max(_NOISES * noise, _ON_TOP[0]), _ON_TOP[1])
    level = _is_over(points, box, within) & (np.abs(points[..., 2] - height) < depth)
    labels, number = connected_components(level)
    # A bench beside it may be as high, and is mostly outside.
    inside = np.bincount(labels[_is_over(points, box, 0.0)], minlength=number + 1)
    whole = np.bincount(labels.ravel(), minlength=number + 1)
    kept = (inside > whole / 2.0) & (whole >= _LEAST_EDGE)
    kept[0] = False
    is_top: Mask = kept[labels]
    return (is_top, height, depth) if int(is_top.sum()) >= _LEAST_TOP else None


def _edge_points(points: Points, is_top: Mask, eye: Points, height: float, depth: float) -> Points:
    """Return the points (n, 2) of the edges: between a pixel of the top and one of what is below it.

    Depth is noisy, so each is where the ray between both pixels meets the plane of the top.
    """
    found = []
    for axis in (0, 1):
        for first, second in ((slice(None, -1), slice(1, None)), (slice(1, None), slice(None, -1))):
            one, other = ([slice(None), slice(None)] for _ in range(2))
            one[axis], other[axis] = first, second
            a, b = points[tuple(one)], points[tuple(other)]
            is_edge = is_top[tuple(one)] & (b[..., 2] < height - depth)
            rays = [part[is_edge] - eye for part in (a, b)]
            middle = sum(ray / np.linalg.norm(ray, axis=1, keepdims=True) for ray in rays)
            found.append(eye[:2] + middle[:, :2] * ((height - eye[2]) / middle[:, 2:]))
    return np.concatenate(found)


def _fit_edges(edge: Points, box: SpaceBox, scale: _Scale) -> tuple[float, Points] | None:
    """Fit a turn about the vertical through the middle and a shift that bring points onto edges.

    Each point belongs to the nearest edge. A way that the edges do not show, as along the only one that is
    seen, has the shift 0, and then there is no fit.
    """
    half = (np.array(box.upper) - np.array(box.lower))[:2] / 2.0
    start = edge - _middle(box)[:2]
    normals = np.array(((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)))
    offsets = np.array((half[0], half[0], half[1], half[1]))
    turn, shift = 0.0, np.zeros(2)
    prior = np.diag((1.0 / _PRIOR_TURN**2, 1.0 / _PRIOR_SHIFT**2, 1.0 / _PRIOR_SHIFT**2))
    information, residual, first = prior, np.zeros(0), 0
    noise = _EDGE_NOISE * scale.pixel
    for share in _GATES:
        gate = share * scale.within
        c, s = cos(turn), sin(turn)
        placed = start @ np.array(((c, s), (-s, c))) + shift
        away = placed @ normals.T - offsets
        # Beyond a corner no edge is.
        along = np.abs(placed @ normals[:, ::-1].T) > np.array((half[1], half[1], half[0], half[0])) + gate
        nearest = np.argmin(np.where(along, np.inf, np.abs(away)), axis=1)
        rows = np.arange(len(placed))
        used = (np.abs(away[rows, nearest]) < gate) & ~along[rows, nearest]
        first = first or int(used.sum())
        if int(used.sum()) < max(_LEAST_EDGE, _LEAST_SHARE * first if share == _GATES[-1] else 0):
            return None
        normal, at = normals[nearest[used]], placed[used]
        residual = away[rows, nearest][used]
        gradient = np.stack((normal[:, 1] * at[:, 0] - normal[:, 0] * at[:, 1], *normal.T), axis=1)
        information = prior + gradient.T @ gradient / noise**2
        known = np.array((turn, *shift))
        step = np.linalg.solve(information, -gradient.T @ residual / noise**2 - prior @ known)
        turn, shift = turn + float(step[0]), _rotated(shift, float(step[0])) + step[1:]
    deviations = np.sqrt(np.diag(np.linalg.inv(information)))
    is_known = deviations[0] <= _TRUSTED[0] and max(deviations[1:]) <= _TRUSTED[1]
    is_close = sqrt(float(residual @ residual) / len(residual)) <= _GREATEST_RESIDUAL * scale.pixel
    return (turn, shift) if is_known and is_close else None


def _rotated(vector: Points, angle: float) -> Points:
    c, s = cos(angle), sin(angle)
    return np.array((c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]))
