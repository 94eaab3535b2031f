"""State of the dumplings: wrappers and fillings in pictures, and the force of the press on what is in it.

One wrapper is worked on at a time: one in the pot that is not cooked yet, else one on the press, else any.
Cooked dumplings stay in the pot and are counted.

A plate of the wrapper is the plane through its points and the rectangle around them: plates are told apart
by their colour, and the fold is the angle of their planes. From the side, what shows between the plates is in
the dumpling. All lengths in metres, angles in radians, in the world frame; the bench is level, so a picture
in which it slopes is of a tilted camera, and is levelled first.
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
    believe_height,
    estimate,
    has_dominant_colour,
    has_red_ratios,
    level_ground,
    min_area_rectangle,
    separate_parts,
    smooth_colours,
    top_face,
    trim_to_plane,
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

APART = 0.07
"""Least distance of the middles of two wrappers, level, m: the plates of an open one are 44 mm apart."""

FILLING_APART = 0.05
"""Greatest distance of a filling from the middle of the wrapper that it may be in, level, m."""

NEAR_PRESS = 0.06
"""Greatest distance of the hinge of a wrapper on the press, or nearly so, from its place, level, m."""

SETTLED_WITHIN = 0.045
"""Points nearer than this to the middle of a cooked dumpling, level, are of it, m."""

SETTLED_PIXELS = 120
"""Least number of pixels of another dumpling in the pot beside a cooked one, which may have been bumped: half
of its top."""

UNSEEN = (
    "filling_position",
    "wrapper_position",
    "wrapper_yaw",
    "wrapper_fold",
    "dough_on_workspace",
    "filling_on_workspace",
    "wrapper_aligned",
)
"""Variables that are unknown where the last picture from above does not show what they are of."""

GONE = ("dough_on_workspace", "filling_on_workspace", "wrapper_aligned", "dumpling_wrapped")
"""Variables that are false once the last dumpling is in the pot."""


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
    """Follow the dumplings: what pictures show now, and what they and the press have shown before.

    A picture from the side decides if the wrapper that was seen from above is a dumpling. A wrapper that is
    seen open is none any more. A dumpling that two pictures show in the pot, long enough apart, is cooked;
    then the work on the next wrapper begins.
    """
    wrapper: Wrapper | None = None
    lift = 0.0
    known: dict[str, Any] = {}
    pressed = wrapped = False
    in_pot_since: float | None = None
    settled: list[Place] = []
    most_fillings = 0
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
            points, seen_lift = _level(picture)
            if seen_lift is not None:
                lift = seen_lift
            press, pot = (
                _raised(view.readings.get(name), lift) for name in ("press_position", "pot_position")
            )
            shown = _look_from_above(picture, points, settled, pot)
            most_fillings = max(most_fillings, len(settled) + len(shown.fillings))
            wrapper = _in_work(shown.wrappers, wrapper, press, pot)
            filling = _filling_of(shown.fillings, wrapper, pot)
            known |= dict.fromkeys(UNSEEN)
            if seen_lift is not None:
                known["bench_lift"] = estimate(lift, UNCERTAINTY, time=picture.time)
            if wrapper is not None and not wrapper.is_closed:
                pressed = wrapped = False
            if wrapper is None or not _is_whole_in_pot(wrapper, filling, pot):
                in_pot_since = None
            elif in_pot_since is None:
                in_pot_since = picture.time
            elif wrapped and picture.time - in_pot_since >= COOKING_TIME:
                settled.append(wrapper.middle)
                pressed = wrapped = False
                in_pot_since = None
                shown = _look_from_above(picture, points, settled, pot)
                wrapper = _in_work(shown.wrappers, None, press, pot)
                filling = _filling_of(shown.fillings, wrapper, pot)
                if wrapper is None:
                    # What was in the press is in the pot.
                    known |= {one: estimate(False, time=picture.time) for one in GONE}
            counts: Values = {"dumpling_cooked": (bool(settled),), "dumplings_cooked": (len(settled),)}
            known |= {one: estimate(*value, time=picture.time) for one, value in counts.items()}
            if filling is not None:
                known["filling_position"] = estimate(filling, UNCERTAINTY, time=picture.time)
            if wrapper is not None:
                inside = most_fillings - len(settled) - len(shown.fillings)
                is_hidden = wrapped or inside > 0 or not shown.fillings
                found = _values(wrapper, filling, press, wrapped=wrapped, is_hidden=is_hidden)
                found |= {"dumpling_wrapped": (wrapped,)}
                known |= {one: estimate(*value, time=picture.time) for one, value in found.items()}
        view = yield known.copy()


def _in_work(
    wrappers: list[Wrapper], before: Wrapper | None, press: Place | None, pot: Place | None
) -> Wrapper | None:
    """Choose the wrapper that is worked on: one in the pot or on the press, else the one of before."""

    def rank(one: Wrapper) -> tuple[bool, bool, float]:
        from_press = 0.0 if press is None else dist(one.hinge[:2], press[:2])
        moved = from_press if before is None else dist(one.hinge[:2], before.hinge[:2])
        return not _is_in_pot(one.middle, pot), from_press > NEAR_PRESS, moved

    return min(wrappers, key=rank, default=None)


def _filling_of(fillings: list[Place], wrapper: Wrapper | None, pot: Place | None) -> Place | None:
    """Choose the filling that is worked on: in or at the wrapper, else the nearest to the pot."""
    near = [one for one in fillings if wrapper is not None and _is_near(one, wrapper)]
    if near or pot is None:
        return next(iter(near or fillings), None)
    return min(fillings, key=lambda one: dist(one[:2], pot[:2]), default=None)


def _is_near(filling: Place, wrapper: Wrapper) -> bool:
    return dist(filling[:2], wrapper.middle[:2]) < FILLING_APART


def _values(
    wrapper: Wrapper, filling: Place | None, press: Place | None, *, wrapped: bool, is_hidden: bool
) -> Values:
    """Return value and uncertainty of what a picture from above says of a wrapper and of a filling.

    Dough and filling stay "on the workspace" as parts of the dumpling, and so does a filling that a closed
    wrapper hides: then fewer fillings are seen than there are. A wrapper on its edge may be open: it counts
    as filled only if it was seen wrapped before.
    """
    fold = wrapper.fold
    is_inside = filling is not None and _is_near(filling, wrapper)
    is_hidden = is_hidden and not is_inside and wrapper.is_closed and (fold is not None or wrapped)
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
    fillings: list[Place]


def _is_whole_in_pot(wrapper: Wrapper, filling: Place | None, opening: Place | None) -> bool:
    """Return True if a wrapper is in the pot and no filling lies at it, but outside of the pot."""
    is_spilt = filling is not None and _is_near(filling, wrapper) and not _is_in_pot(filling, opening)
    return _is_in_pot(wrapper.middle, opening) and not is_spilt


def _look_from_above(picture: Picture, seen: Points, settled: list[Place], pot: Place | None) -> Shown:
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
        face, top = top_face(points[part.reshape(-1)])
        fillings.append((face.x, face.y, top - FILLING_HEIGHT / 2.0))
    wrappers = []
    for part in _apart(points, dough | glazed, shape):
        wrapper = _wrapper(_plate(points[dough & part]), _plate(points[glazed & part]))
        if wrapper is None:
            continue
        is_remainder = bool(settled) and int(((dough | glazed) & part).sum()) < SETTLED_PIXELS
        if not (is_remainder and _is_in_pot(wrapper.middle, pot)):
            wrappers.append(wrapper)
    return Shown(wrappers, fillings)


def _apart(points: Points, mask: Mask, shape: tuple[int, ...]) -> list[Mask]:
    """Assign the points of a mask to wrappers: parts that are near each other are of one."""
    middles: list[Points] = []
    for part in separate_parts(mask.reshape(shape), MIN_PIXELS):
        middle = points[part.reshape(-1), :2].mean(axis=0)
        if all(np.hypot(*(middle - one)) > APART for one in middles):
            middles.append(middle)
    if not middles:
        return []
    away = np.stack([np.hypot(*(points[:, :2] - one).T) for one in middles])
    nearest = away.argmin(axis=0)
    return [mask & (nearest == number) for number in range(len(middles))]


def _shows_filling(picture: Picture, wrapper: Wrapper) -> bool:
    """Return True if a picture from the side shows filling between the plates, and none outside."""
    points, dough, glazed, green = _coloured(picture, picture.points())
    c, s = cos(wrapper.yaw), sin(wrapper.yaw)
    away = (points - np.array(wrapper.hinge)) @ np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
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
