"""State of the dumpling: wrapper and filling in pictures, and the force of the press on what is in it.

A plate of the wrapper is the plane through its points and the rectangle around them: plates are told apart
by their colour, and the fold is the angle of their planes. From the side, what shows between the plates is in
the dumpling. All lengths in metres, angles in radians, in the world frame.
"""

from math import acos, atan2, cos, dist, pi, sin
from typing import Any, NamedTuple

import numpy as np

from aeros.perception import (
    Mask,
    Perception,
    Picture,
    Points,
    Rectangle,
    View,
    estimate,
    has_dominant_colour,
    has_red_ratios,
    min_area_rectangle,
    top_face,
    trim_to_plane,
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

CLOSED_FOLD = 160.0 * pi / 180.0
"""Least fold of a closed wrapper, rad."""

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

HAND_HALF, HAND_HEIGHT = (0.037, 0.107), 0.045
"""Half the thickness and half the width of the hand, and its height over what it grips, m."""

FINGER, FINGERTIP = (0.012, 0.016), 0.016
"""Half the width and the thickness of a finger, and the height below which the bench itself is, m."""

WIDE_OPEN, HALF_OPEN = 0.08, 0.05
"""Gap of the fingers around the wrapper and around the filling, m."""

FILLING_YAWS = (0.0, pi / 2.0, pi / 4.0, -pi / 4.0)
"""Headings of a hand that grips the filling, which is square and turns in the fingers, rad."""

MIN_OBSTACLE = 4
"""Least number of pixels of something in the way: fewer are noise."""

BENCH_WITHIN, MIN_BENCH = 0.012, 5000
"""Greatest height of a point of the bench, m, and least number of its pixels in a picture that shows it."""

MIN_PIXELS = 25
"""Least number of pixels of an object: fewer are noise, or an object that is mostly hidden."""

MIN_FILLING_PIXELS = 6
"""Least number of pixels of the filling between the plates of a filled wrapper."""

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

UNSEEN = (
    "filling_yaw",
    "filling_free",
    "wrapper_free",
    "filling_position",
    "wrapper_position",
    "wrapper_yaw",
    "wrapper_fold",
    "dough_on_workspace",
    "filling_on_workspace",
    "wrapper_aligned",
)
"""Variables that are unknown where the last picture from above does not show what they are of."""


class Wrapper(NamedTuple):
    """A wrapper that was found: its hinge, the heading of plate A from it, and its fold.

    The fold is 0 open, and None if it is not visible, as of a wrapper on its edge.
    """

    hinge: Place
    yaw: float
    fold: float | None

    @property
    def is_closed(self) -> bool:
        """True unless it is seen to be open."""
        return self.fold is None or self.fold > CLOSED_FOLD

    @property
    def middle(self) -> Place:
        """The middle of plate A."""
        x, y, z = self.hinge
        return (x + HINGE_TO_PLATE * cos(self.yaw), y + HINGE_TO_PLATE * sin(self.yaw), z)

    def carries(self, filling: Place) -> bool:
        """Return True if a filling's middle is over plate A, about as high as it rests there."""
        dx, dy, dz = (a - b for a, b in zip(filling, self.middle, strict=True))
        along = dx * cos(self.yaw) + dy * sin(self.yaw)
        across = dy * cos(self.yaw) - dx * sin(self.yaw)
        above = dz - PLATE_HALF[2] - FILLING_HEIGHT / 2
        return abs(along) < PLATE_HALF[0] and abs(across) < PLATE_HALF[1] and abs(above) < ON_PLATE_WITHIN


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
    def is_on_edge(self) -> bool:
        """True if it stands on its edge."""
        return min(self.rectangle.length, self.rectangle.width) < EDGE_ON_WIDTH


def see_dumpling(view: View) -> Perception:
    """Follow the dumpling: what pictures show now, and what they and the press have shown before.

    A picture from the side decides if the wrapper that was seen from above is a dumpling. A wrapper that is
    seen open is none any more. A dumpling that two pictures show in the pot, long enough apart, is cooked.
    """
    wrapper: Wrapper | None = None
    known: dict[str, Any] = {}
    pressed = wrapped = cooked = False
    in_pot_since: float | None = None
    seen: dict[str, float] = {}
    while True:
        pressed = pressed or any(one.value > SEALING_LOAD for one in view.samples["press_force"])
        for name in ("overhead", "side"):
            picture = view.pictures.get(name)
            if picture is None or picture.time <= seen.get(name, -1.0):
                continue
            seen[name] = picture.time
            if name == "side":
                filled = wrapper is not None and wrapper.is_closed and _shows_filling(picture, wrapper)
                wrapped = filled and pressed
                known["dumpling_wrapped"] = estimate(wrapped, time=picture.time)
                continue
            wrapper, filling = _look_from_above(picture)
            known |= dict.fromkeys(UNSEEN)
            known |= {
                name: None if value is None else estimate(value, time=picture.time)
                for name, value in _sightings(picture, wrapper, filling).items()
            }
            known |= {
                name: estimate(*value, time=picture.time)
                for name, value in _room_to_grip(picture, wrapper, filling).items()
            }
            if filling is not None:
                known["filling_position"] = estimate(filling, UNCERTAINTY, time=picture.time)
            if wrapper is None:
                in_pot_since = None
                continue
            if not wrapper.is_closed or (filling is not None and not _is_near(filling, wrapper)):
                pressed = wrapped = False
            pot = view.readings.get("pot_position")
            if not _is_in_pot(wrapper.middle, pot) or not (filling is None or _is_in_pot(filling, pot)):
                in_pot_since = None
            elif in_pot_since is None:
                in_pot_since = picture.time
            if in_pot_since is not None and wrapped and picture.time - in_pot_since >= COOKING_TIME:
                cooked = True
            found = _values(wrapper, filling, view.readings.get("press_position"), wrapped)
            found |= {"dumpling_wrapped": (wrapped,), "dumpling_cooked": (cooked,)}
            known |= {name: estimate(*value, time=picture.time) for name, value in found.items()}
        view = yield known.copy()


def _sightings(picture: Picture, wrapper: Wrapper | None, filling: Place | None) -> dict[str, bool | None]:
    """Say if a picture shows the wrapper, the filling, and a wrapper that is closed without the filling.

    A picture that does not show the bench, as one that is dazzled, says nothing.
    """
    if int((np.abs(picture.points()[:, :, 2]) < BENCH_WITHIN).sum()) < MIN_BENCH:
        return dict.fromkeys(("wrapper_seen", "filling_seen", "wrapper_shut"))
    is_closed = wrapper is not None and wrapper.is_closed
    return {
        "wrapper_seen": wrapper is not None,
        "filling_seen": filling is not None or is_closed,
        "wrapper_shut": is_closed and filling is not None and not _is_near(filling, wrapper),
    }


def _room_to_grip(picture: Picture, wrapper: Wrapper | None, filling: Place | None) -> Values:
    """Say if a hand has room to grip what a picture shows, and at which heading it has at the filling."""
    points = picture.points().reshape(-1, 3)
    points = points[points[:, 2] < MAX_HEIGHT]
    values: Values = {}
    if wrapper is not None:
        values["wrapper_free"] = (_has_room(points, wrapper.hinge, wrapper.yaw, WIDE_OPEN),)
    if filling is not None:
        free = [yaw for yaw in FILLING_YAWS if _has_room(points, filling, yaw, HALF_OPEN)]
        values["filling_free"] = (bool(free),)
        if free:
            values["filling_yaw"] = (free[0], ANGLE_UNCERTAINTY)
    return values


def _has_room(points: Points, place: Place, yaw: float, opened: float) -> bool:
    """Return True if neither the hand nor its open fingers would hit points in a grasp at a place."""
    away = points - np.array(place)
    along = np.abs(away[:, 0] * cos(yaw) + away[:, 1] * sin(yaw))
    across = np.abs(away[:, 1] * cos(yaw) - away[:, 0] * sin(yaw))
    hand = (along < HAND_HALF[0]) & (across < HAND_HALF[1]) & (away[:, 2] > HAND_HEIGHT)
    finger = (across > opened / 2.0) & (across < opened / 2.0 + FINGER[1]) & (along < FINGER[0])
    tips = max(0.0, FINGERTIP - place[2])
    return int((hand | (finger & (away[:, 2] > tips))).sum()) < MIN_OBSTACLE


def _is_near(filling: Place, wrapper: Wrapper | None) -> bool:
    """Return True if a filling may be between the plates of a wrapper."""
    return wrapper is not None and dist(filling, wrapper.middle) < 2.0 * PLATE_HALF[1]


def _values(wrapper: Wrapper, filling: Place | None, press: Place | None, wrapped: bool) -> Values:
    """Return value and uncertainty of what a picture from above says of a wrapper and of a filling.

    Dough and filling stay "on the workspace" as parts of the dumpling, and so does a filling that a closed
    wrapper hides. A wrapper on its edge may be open, or show what is in it: it counts as filled only if it
    was seen wrapped before.
    """
    fold = wrapper.fold
    is_hidden = wrapped or (filling is None and wrapper.is_closed and fold is not None)
    values: Values = {
        "wrapper_position": (wrapper.hinge, UNCERTAINTY),
        "wrapper_yaw": (wrapper.yaw, ANGLE_UNCERTAINTY),
        "filling_on_workspace": (is_hidden or (filling is not None and wrapper.carries(filling)),),
    }
    if fold is not None:
        values["wrapper_fold"] = (fold, ANGLE_UNCERTAINTY)
    if press is not None:
        dx, dy, dz = (a - b for a, b in zip(wrapper.hinge, press, strict=True))
        on_press = dist((dx, dy), (0.0, 0.0)) < ON_PRESS_WITHIN[0] and abs(dz) < ON_PRESS_WITHIN[1]
        values["dough_on_workspace"] = (wrapped or on_press,)
        near = all(abs(off) < within for off, within in zip((dx, dy, dz), ALIGNED_WITHIN, strict=True))
        values["wrapper_aligned"] = (near and abs(wrapper.yaw) < ALIGNED_YAW,)
    return values


def _is_in_pot(place: Place, opening: Place | None) -> bool:
    if opening is None:
        return False
    dx, dy, dz = (a - b for a, b in zip(place, opening, strict=True))
    return abs(dx) < POT_HALF[0] and abs(dy) < POT_HALF[1] and -POT_DEPTH < dz < 0.0


def _look_from_above(picture: Picture) -> tuple[Wrapper | None, Place | None]:
    """Find wrapper and filling in a picture in which the arm hides nothing."""
    points, dough, glazed, green = _coloured(picture)
    filling = None
    if int(green.sum()) >= MIN_PIXELS:
        face, top = top_face(points[green])
        filling = (face.x, face.y, top - FILLING_HEIGHT / 2.0)
    return _wrapper(_plate(points[dough]), _plate(points[glazed])), filling


def _shows_filling(picture: Picture, wrapper: Wrapper) -> bool:
    """Return True if a picture from the side shows filling between the plates, and none outside."""
    points, _, _, green = _coloured(picture)
    away = points[green] - np.array(wrapper.hinge)
    along = away[:, 0] * cos(wrapper.yaw) + away[:, 1] * sin(wrapper.yaw)
    across = away[:, 1] * cos(wrapper.yaw) - away[:, 0] * sin(wrapper.yaw)
    near = (along > -0.01) & (along < 2.0 * HINGE_TO_PLATE + 0.01) & (np.abs(across) < PLATE_HALF[1] + 0.01)
    between = near & (away[:, 2] > 0.0) & (away[:, 2] < CLOSED_HEIGHT)
    inside = (along < HINGE_TO_PLATE + PLATE_HALF[0]) & (np.abs(across) < PLATE_HALF[1])
    return int((between & inside).sum()) >= MIN_FILLING_PIXELS and not bool((between & ~inside).any())


def _coloured(picture: Picture) -> tuple[Points, Mask, Mask, Mask]:
    """Return the points of a picture, and masks of those on plate A, on plate B and on the filling."""
    points, rgb = picture.points().reshape(-1, 3), picture.rgb.reshape(-1, 3)
    low = points[:, 2] < MAX_HEIGHT
    dough, glazed = (
        low & has_red_ratios(rgb, green, (None, bluest), MIN_BRIGHTNESS) for green, bluest in PLATE_COLOURS
    )
    return points, dough, glazed, low & has_dominant_colour(rgb, 1, GREEN_DOMINANCE, 0.0)


def _plate(points: Points) -> Plate | None:
    """Fit a plate to points, without the points on its sides."""
    if len(points) < MIN_PIXELS:
        return None
    plane, face = trim_to_plane(points, PLANE_TOLERANCE, MIN_PIXELS)
    around = min_area_rectangle(face[:, :2])
    return Plate(face, around, plane.height_at(around.x, around.y), plane.normal)


def _wrapper(a: Plate | None, b: Plate | None) -> Wrapper | None:
    if a is not None and b is not None and _covers(b, a):
        a = None
    if a is None:
        return None if b is None else _wrapper_from_one_plate(b, CLOSED_HEIGHT, is_closed=True)
    if b is None:
        return _wrapper_from_one_plate(a, PLATE_HALF[2], is_closed=False)
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
    return Wrapper((x, y, a.height - PLATE_HALF[2]), wrap_heading(heading, 2.0 * pi), fold)


def _covers(b: Plate, a: Plate) -> bool:
    """Return True if plate B hides plate A but for its edges, as when they are folded together."""
    apart = dist((a.rectangle.x, a.rectangle.y), (b.rectangle.x, b.rectangle.y))
    return b.is_mostly_visible and b.height - a.height > HINGE_TO_PLATE / 2.0 and apart < PLATE_HALF[1]


def _wrapper_from_one_plate(plate: Plate, above: float, *, is_closed: bool) -> Wrapper:
    """Estimate the wrapper from the only visible plate: the upper one if closed, the lower one if open."""
    if plate.is_on_edge:
        return _wrapper_on_edge(plate, plate)
    heading = plate.rectangle.shorter_heading
    if cos(heading) < 0.0:
        heading += pi
    x = plate.rectangle.x - HINGE_TO_PLATE * cos(heading)
    y = plate.rectangle.y - HINGE_TO_PLATE * sin(heading)
    tilt = acos(min(1.0, abs(plate.normal[2])))
    fold = pi - tilt if is_closed else 0.0
    return Wrapper((x, y, plate.height - above), wrap_heading(heading, 2.0 * pi), fold)


def _wrapper_on_edge(a: Plate, b: Plate) -> Wrapper:
    """Estimate a wrapper on its edge: its middle is half as high as its top; its fold is not visible."""
    away = (a.rectangle.x - b.rectangle.x, a.rectangle.y - b.rectangle.y)
    are_apart = dist(away, (0.0, 0.0)) > PLATE_HALF[0] / 2.0
    heading = atan2(away[1], away[0]) if are_apart else a.rectangle.shorter_heading
    top = max(float(plate.points[:, 2].max()) for plate in (a, b))
    middle = ((a.rectangle.x + b.rectangle.x) / 2.0, (a.rectangle.y + b.rectangle.y) / 2.0, top / 2.0)
    return Wrapper(middle, wrap_heading(heading, 2.0 * pi), None)
