"""Cleaning a table: sweep a sponge over it with force control, put clutter into a bin, look at it.

All lengths in metres, in the world frame; at yaw 0 the fingers close along y.  Nothing here decides
whether a step succeeded: what is measured afterwards does.
"""

from collections.abc import Generator, Iterable
from math import cos, dist, hypot, pi, sin

from aeros.skill import Action, Inputs, Observation, SkillBody, Way, act, first_allowed

Task = Generator[Action, Observation, Observation]
Place = tuple[float, float, float]

CARRY_SPEED = 0.29
"""Peak speed of a hand that may hold something, m/s, if no hand has to be slower."""

NEAR_SPEED = 0.10
"""Peak speed where fingers are near things, m/s."""

WIPE_SPEED = 0.20
"""Peak speed of a stroke, m/s."""

HOVER_SPEED = 0.14
"""Peak speed from one stroke to the next, close above the table, m/s: the site's bound is 0.15."""

TRAVEL_HEIGHT = 0.20
"""Height of sideways motion, m: what is carried clears the bin (0.085 m)."""

CLEARANCE = 0.04
"""Height above a grasp from which the approach is slow, m."""

OPEN = 0.08
"""Fingers wide open, m."""

CLOSED = 0.01
"""Fingers nearly closed, to press with, m."""

GRIP_FORCE = 10.0
"""N."""

PATIENCE = 40
"""Number of waits of 0.25 s for a reading that is missing or too old."""

SPONGE_GRASP = 0.032
"""Height of the sponge's grasp above the foam's middle, m: on its block, fingertips 8 mm off the foam."""

DEEPER = 0.005
"""How much lower fingers grip what they have missed, m: of the sponge they stay 3 mm off the foam."""

FOAM_HALF_HEIGHT = 0.015

WIPE_FORCE = 4.0
"""N on the table."""

STROKES = (-0.105, -0.035, 0.035, 0.105)
"""From the middle of the area to the strokes along x, m: the sponge is 100 mm long, so they overlap by 30 mm
and cover ±0.155."""

STROKES_BETWEEN = (-0.12, -0.07, 0.0, 0.07, 0.12)
"""The same of a second sweep: with these, a sponge of 60 mm covers ±0.15."""

STREAKS = (0.8, 0.95)
"""Wiped share from which streaks alone are left, and from which none are: less has another cause."""

STROKE_ENDS = {"whole": (0.13, -0.13), "left": (0.13, 0.025), "right": (-0.13, -0.025)}
"""From the middle of the area to the ends of a stroke along y, m, for each region: the sponge is 70 mm wide,
so strokes cover ±0.165, and of a half 10 mm beyond the middle, as the sponge is a few millimetres off."""

LOWEST_SLIDE = 0.045
"""Height of the tool from which a stroke may begin to look for the table, m: 20 mm below, the hand is as near
to where the site lets only fingers be as it may come."""

HOVER = 0.008
"""Height of the sponge over the table between strokes, m: a slide begins off the surface."""

LOWEST = 0.0125
"""Height of the lowest grasp over a table as it was surveyed, m: the site's `table_area` begins at 12 mm."""

CLUTTER_GRASP = 0.004
"""Height of the grasp above the middle of clutter, m: fingertips stay clear of the table."""

BIN_SIDES = (0.095, 0.085)
"""From the bin's middle to the outside of its walls along x and y, m."""

HAND_REACH = 0.12
"""Extent of the hand from the grasped object along the fingers' motion, with a margin, m."""

HAND_HALF = (0.037, 0.105)
"""Half the hand's thickness and half its length along the fingers' way, with a margin, m."""

NEAREST = 0.318
"""Least distance of a low tool ahead of the arm's base, m: nearer, the forearm is at the column."""

GRIP_ASIDE = 0.017
"""Greatest distance of a grip from the middle of a piece, m: fingertips are 20 mm wide, so half of them is
on a piece that is 40 mm wide."""

TURNED_WIDTH = 0.075
"""Greatest width between the fingers of a piece that they turn while they close, m."""

PAD = 0.009
"""Fingertips reach this far below the tool, m."""

DRAG_FORCE = 7.5
"""N on what is dragged: it follows by the friction of the fingertips."""

DRAGS = 3
"""Largest number of drags of one piece, which may slip from under the fingers."""

DRAG_SPEED = 0.05
"""Peak speed of dragging, m/s."""

DROP_HEIGHT = 0.045
"""Height of the tool over the bin's rim when it lets go, m."""

DRAWN_IN = (0.30, 0.0, 0.45)
"""Tool position that does not hide the table from the cameras, from the arm's base, m; the arm is there, over
everything that stands in the cell, while it is driven."""

BASE_SPEED = 0.48
"""Peak speed of the base, m/s."""

SHOWN_AT = (
    (-0.08, 0.25, 0.30),
    (0.10, 0.22, 0.22),
    (0.12, 0.00, 0.28),
    (0.10, -0.22, 0.22),
    (-0.08, -0.25, 0.30),
    (-0.12, 0.00, 0.25),
)
"""From the middle of the area to where the hand is shown to the camera, m: spread over the picture, at two
heights."""

LOOKS = 5
"""Largest number of looks for a sponge or clutter that is not seen."""

SPONGE = ("sponge_position", "sponge_yaw")
CLUTTER = ("clutter_position", "clutter_yaw", "clutter_length")
"""Pose of the sponge; pose and length of the next piece of clutter: unknown if the last picture does not show
them, or no piece that fits the hand."""

BOTH_SIDES_FIT = 0.065
"""Length below which a piece can be gripped along as well as across, m."""

FOLDED_WITHIN, FOLDED_BELOW, STRETCHED_FROM = 0.44, 0.30, 0.70
"""Distance of the tool from the arm's base, level, and height, m, within which the arm is so folded, and
distance from which it is so stretched, that its joints turn fast for the speed of the hand: it comes and goes
at `CARRY_SPEED` at most."""

DROPS = ((-0.045, -0.025), (0.045, 0.025), (-0.045, 0.025), (0.045, -0.025))
"""Places (x, y) in the bin where successive pieces are released, m from its middle."""

UNMOVED = 0.015
"""Distance within which a piece is seen again where it was: no grip of it has helped, m."""

DROP_ROOM = 0.08
"""From the bin's middle to where the end of a piece that is let go may be, along x, m."""

HEADINGS = (0.0, pi / 2.0, -pi / 2.0, pi)
"""Headings to try for a hand whose heading does not matter, rad."""

PADS_ASIDE = 0.009
"""Distance from the middle of a thing at which its sides are still between the pads, which are 20 mm wide, m:
the hand keeps so much farther from what is beside it."""


HAND_AWAY = 0.20
"""Distance of the tool from the sponge's rest, level, from which the hand does not hide it from above, m."""


def dock(observed: Observation, inputs: Inputs) -> SkillBody:
    """Raise the tool, draw it in, look along the aisle and drive to the dock."""
    pace = inputs["hand_speed"]
    observed = yield from _sense(observed, "tool_position", "base_position", "dock_position")
    yield from _raise_and_draw_in(observed, pace, observed["base_position"][2] + DRAWN_IN[2])
    x, y, _ = observed["dock_position"]
    yield act("look", camera="aisle_top")
    yield act("move_base", x=x, y=y, speed=BASE_SPEED)


def calibrate(observed: Observation, inputs: Inputs) -> SkillBody:
    """Show the hand to both cameras at several places, so that their errors show.

    All of them are above what stands there.
    """
    pace = inputs["hand_speed"]
    observed = yield from _draw_in(observed, pace)
    observed = yield from _sense(observed, "area_position")
    x, y, z = _lifted(observed, "area_position")
    for dx, dy, dz in SHOWN_AT:
        yield act("move_tool", target=(x + dx, y + dy, z + dz), yaw=0.0, speed=_free(observed, pace))
        yield act("look", camera="mast")
        observed = yield act("look", camera="overhead")
    yield from _overlook(observed, pace)


def wipe(observed: Observation, inputs: Inputs) -> SkillBody:
    """Take the sponge, sweep it over the region in overlapping strokes, put it back and look.

    Where no more than streaks are left, as by a smaller sponge, it is swept between these strokes, too.
    """
    pace = inputs["hand_speed"]
    observed = yield from _overlook(observed, pace)
    observed = yield from _bin_what_is_held(observed, pace)
    for strokes in (STROKES, STROKES_BETWEEN):
        if not observed["holding"]:
            if not _is_sponge_usable(observed):
                yield from _look_at_the_floor(observed)
                return
            observed = yield from _take_sponge(observed, pace)
            if not observed["holding"]:
                yield from _overlook(observed, pace)
                return
        observed = yield from _sweep(observed, pace, strokes)
        observed = yield from _return_sponge(observed, pace)
        observed = yield from _overlook(observed, pace)
        is_streaky = STREAKS[0] <= observed.get("wiped_fraction", 0.0) < STREAKS[1]
        if observed.get("table_wiped") is not False or not is_streaky:
            return


def _sweep(observed: Observation, pace: float, offsets: Iterable[float]) -> Task:
    """Sweep the held sponge over the region, at offsets along x from its middle, m."""
    observed = yield from _sense(observed, "area_position", "region")
    middle_x, middle_y, top = _lifted(observed, "area_position")
    height = max(top + SPONGE_GRASP + FOAM_HALF_HEIGHT, LOWEST_SLIDE)
    start, end = (middle_y + offset for offset in STROKE_ENDS[observed["region"]])
    strokes = [middle_x + offset for offset in offsets]
    yield from _approach(observed, pace, (strokes[0], start, height + HOVER), 0.0)
    for x in strokes:
        yield act("move_tool", target=(x, start, height + HOVER), yaw=0.0, speed=HOVER_SPEED)
        yield act("slide", target=(x, end, height), force=WIPE_FORCE, speed=WIPE_SPEED)
        observed = yield act("move_tool", target=(x, end, height + HOVER), yaw=0.0, speed=NEAR_SPEED)
        start, end = end, start
    return observed


def organize(observed: Observation, inputs: Inputs) -> SkillBody:
    """Put every piece of clutter into the bin, then the sponge to its rest if it is not there, and look.

    What the fingers miss, or what slips from them, is gripped once more in another way. A piece that is still
    where it was is left then. The table cannot be tidied where the sponge lies overturned, or where a piece
    does not fit the hand: then nothing is moved.
    """
    pace = inputs["hand_speed"]
    observed = yield from _overlook(observed, pace)
    if observed["holding"]:
        observed = yield from _bin_what_is_held(observed, pace)
        if observed["holding"]:
            observed = yield from _return_sponge(observed, pace)
        observed = yield from _overlook(observed, pace)
    if observed.get("sponge_overturned") is True or observed.get("clutter_ungraspable") is True:
        return
    for offset in DROPS:
        if not _is_clutter_seen(observed):
            break
        place = observed["clutter_position"]
        observed = yield from _bin_clutter(observed, pace, offset)
        observed = yield from _overlook(observed, pace)
        if _is_clutter_seen(observed) and dist(observed["clutter_position"], place) < UNMOVED:
            break
    is_rest_free = observed.get("rest_taken") is not True
    if is_rest_free and _is_sponge_usable(observed) and not _sponge_at_rest(observed):
        observed = yield from _take_sponge(observed, pace)
        if observed["holding"]:
            observed = yield from _return_sponge(observed, pace)
        observed = yield from _overlook(observed, pace)
    yield from _look_at_the_floor(observed)


def verify(observed: Observation, inputs: Inputs) -> SkillBody:
    """Draw the arm in, over everything that stands on the table, and look at the table."""
    pace = inputs["hand_speed"]
    yield from _draw_in(observed, pace)
    yield act("look", camera="mast")


def recover(observed: Observation, inputs: Inputs) -> SkillBody:
    """Bring the sponge back to its rest, from the hand or from where it fell, rise and look."""
    pace = inputs["hand_speed"]
    observed = yield from _overlook(observed, pace)
    observed = yield from _bin_what_is_held(observed, pace)
    if not observed["holding"]:
        if not _is_sponge_usable(observed):
            yield from _look_at_the_floor(observed)
            return
        observed = yield from _take_sponge(observed, pace)
    if observed["holding"]:
        observed = yield from _return_sponge(observed, pace)
    yield from _overlook(observed, pace)


def _are_known(observed: Observation, names: Iterable[str]) -> bool:
    return all(name in observed for name in names)


def _sense(observed: Observation, *names: str) -> Task:
    """Wait until all of `names` are observed; a name that stays unknown ends the skill where it is read."""
    for _ in range(PATIENCE):
        if _are_known(observed, names):
            break
        observed = yield act("wait", duration=0.25)
    return observed


def _lift(observed: Observation) -> float:
    """How much higher the table is than it was surveyed, m; 0 while no picture has shown it."""
    return float(observed.get("table_lift", 0.0))


def _lifted(observed: Observation, name: str) -> Place:
    """A surveyed place, as much higher as the table is."""
    x, y, z = observed[name]
    return (x, y, z + _lift(observed))


def _free(observed: Observation, pace: float) -> float:
    """Peak speed of free motion: of a hand that is not known to be empty, the lesser."""
    return pace if observed.get("holding") is False else min(CARRY_SPEED, pace)


def _unfolding(observed: Observation, pace: float, place: Place) -> float:
    """Peak speed of a hand to or from a place: the lesser where the arm is low and folded, or stretched."""
    base = observed["base_position"]
    away = hypot(place[0] - base[0], place[1] - base[1])
    is_low = place[2] - base[2] < FOLDED_BELOW
    return min(pace, CARRY_SPEED) if is_low and not FOLDED_WITHIN <= away <= STRETCHED_FROM else pace


def _draw_in(observed: Observation, pace: float) -> Task:
    """Bring the tool out of the cameras' sight, over everything that stands on the table."""
    observed = yield from _sense(observed, "tool_position", "base_position")
    return (yield from _raise_and_draw_in(observed, pace, TRAVEL_HEIGHT))


def _raise_and_draw_in(observed: Observation, pace: float, height: float) -> Task:
    """Raise the tool to `height`, if it is lower, then draw it in."""
    x, y, z = observed["tool_position"]
    pace = _unfolding(observed, pace, (x, y, z))
    if z < height - 0.005:
        yield act("move_tool", target=(x, y, height), yaw=0.0, speed=_free(observed, pace))
    u, v, w = observed["base_position"]
    target = (u + DRAWN_IN[0], v + DRAWN_IN[1], w + DRAWN_IN[2])
    return (yield act("move_tool", target=target, yaw=0.0, speed=_free(observed, pace)))


def _overlook(observed: Observation, pace: float) -> Task:
    """Look at the table from above; again, if neither picture nor hand has what is looked for."""
    observed = yield from _draw_in(observed, pace)
    for _ in range(LOOKS):
        observed = yield act("look", camera="overhead")
        observed = yield from _sense(observed, "holding", "bin_position", "sponge_rest_position")
        if _shows_all(observed):
            break
    return observed


def _look_at_the_floor(observed: Observation) -> Task:
    """Look from the mast, if the table has lost something."""
    is_sponge_lost = observed.get("sponge_seen") is False and observed["holding"] is False
    if is_sponge_lost or observed.get("clutter_missing") is True:
        observed = yield act("look", camera="mast")
    return observed


def _shows_all(observed: Observation) -> bool:
    """Check that the poses of the sponge and of any clutter are known."""
    sponge = observed["holding"] or _are_known(observed, SPONGE)
    clutter = _are_known(observed, CLUTTER) or not observed.get("clutter_on_table")
    counted = observed["holding"] or "clutter_missing" in observed
    known = _are_known(observed, ("clutter_on_table", "sponge_seen"))
    return bool(sponge and clutter and counted and known)


def _is_sponge_usable(observed: Observation) -> bool:
    """Check that the sponge's pose is known and its block is on top and free, where the hand can grip it."""
    is_hidden = observed.get("sponge_overturned") is True or observed.get("sponge_covered") is True
    return _are_known(observed, SPONGE) and not is_hidden


def _is_clutter_seen(observed: Observation) -> bool:
    return observed.get("clutter_on_table") is True and _are_known(observed, CLUTTER)


def _sponge_at_rest(observed: Observation) -> bool:
    (x, y, _), rest = observed["sponge_position"], observed["sponge_rest_position"]
    return hypot(x - rest[0], y - rest[1]) < 0.02


def _take_sponge(observed: Observation, pace: float) -> Task:
    """Grip the sponge across and lift it; where it is not held then, look and grip it once more, deeper."""
    observed = yield from _lift_sponge(observed, pace, SPONGE_GRASP)
    if not observed["holding"]:
        observed = yield from _overlook(observed, pace)
        if not observed["holding"] and _is_sponge_usable(observed):
            observed = yield from _lift_sponge(observed, pace, SPONGE_GRASP - DEEPER)
    return observed


def _lift_sponge(observed: Observation, pace: float, height: float) -> Task:
    """Grip the sponge across, at a height above the foam's middle, and lift it."""
    x, y, z = observed["sponge_position"]
    grips = _grips((x, y, z + height), observed["sponge_yaw"], pace)
    observed = yield from first_allowed(observed, *grips)
    return (yield from _sense(observed, "holding"))


def _return_sponge(observed: Observation, pace: float) -> Task:
    """Set the held sponge down on its rest, let go and rise.

    Where something else stands there, also since the last picture, it is set down where a picture shows room;
    where none does, it stays in the hand.
    """
    observed = yield from _sense(observed, "sponge_rest_position")
    x, y, z = _lifted(observed, "sponge_rest_position")
    was_taken = observed.get("rest_taken") is True
    if dist(observed["tool_position"][:2], (x, y)) > HAND_AWAY:
        observed = yield act("look", camera="overhead")
    is_taken = observed.get("rest_taken", was_taken) is True
    if is_taken and not ("rest_taken" in observed and "sponge_spot" in observed):
        # The arm may hide that there is room, or that the rest is free by now.
        observed = yield from _overlook(observed, pace)
        is_taken = observed.get("rest_taken", True) is True
    if is_taken:
        if "sponge_spot" not in observed:
            return observed
        x, y, z = observed["sponge_spot"]
    place = (x, y, z + SPONGE_GRASP + 0.001)
    return (yield from first_allowed(observed, _put(place, 0.0, pace), _put(place, pi, pace)))


def _bin_what_is_held(observed: Observation, pace: float) -> Task:
    """If the hand came to rest with a piece of clutter, go on with it, so that it is not dropped.

    What is held while the sponge is seen to lie is clutter.
    """
    if not (observed["holding"] and observed.get("sponge_seen")):
        return observed
    observed = yield from _drop_in_bin(observed, pace, (0.0, 0.0))
    return (yield from _sense(observed, "holding"))


def _bin_clutter(observed: Observation, pace: float, offset: tuple[float, float]) -> Task:
    """Grip the next piece of clutter and let it go over the bin, `offset` from its middle.

    One at the bin's wall is gripped on its free side; where that is not room enough, it is first drawn away
    by its top. One at the edge of the table is gripped on its far side.
    """
    for _ in range(DRAGS):
        if _room_missing(observed) <= GRIP_ASIDE:
            break
        observed = yield from _drag_from_the_bin(observed, pace)
        observed = yield from _overlook(observed, pace)
        if not _is_clutter_seen(observed):
            return observed
    room = max(0.0, DROP_ROOM - observed["clutter_length"] / 2.0)
    offset = (min(max(offset[0], -room), room), offset[1])
    observed = yield from _lift_clutter(observed, pace)
    if not observed["holding"]:
        observed = yield from _overlook(observed, pace)
        if not observed["holding"] and _is_clutter_seen(observed):
            observed = yield from _lift_clutter(observed, pace, is_second=True)
    return (yield from _drop_in_bin(observed, pace, offset)) if observed["holding"] else observed


def _lift_clutter(observed: Observation, pace: float, *, is_second: bool = False) -> Task:
    """Grip the next piece of clutter and lift it.

    A second grip is by its other sides, where a hand turned by a right angle has room; else it is deeper.
    """
    observed = yield from _sense(observed, "base_position")
    x, y, z = observed["clutter_position"]
    yaw, (dx, dy) = _grip_yaw(observed), _away_from_the_bin(observed)
    is_free_across = observed.get("clutter_free_across") is True and max(_outside(observed)) >= HAND_REACH
    if is_second and is_free_across:
        yaw += pi / 2.0 if yaw <= 0.0 else -pi / 2.0
    aside = min(max(0.0, _room_missing(observed)), GRIP_ASIDE)
    nearest = min(observed["base_position"][0] + NEAREST, x + GRIP_ASIDE)
    # The site's limit does not sink with a lower table.
    lowest = LOWEST + max(_lift(observed), 0.0)
    height = z + CLUTTER_GRASP - (DEEPER if is_second and not is_free_across else 0.0)
    grasp = (max(x + aside * dx, nearest), y + aside * dy, max(height, lowest))
    grips = _grips(grasp, yaw, pace)
    if is_free_across:
        grips = (*grips, *_grips(grasp, yaw + (pi / 2.0 if yaw <= 0.0 else -pi / 2.0), pace))
    observed = yield from first_allowed(observed, *grips)
    return (yield from _sense(observed, "holding"))


def _drop_in_bin(observed: Observation, pace: float, offset: tuple[float, float]) -> Task:
    """Let what is held go over the bin, `offset` from its middle."""
    observed = yield from _sense(observed, "bin_position")
    x, y, z = _lifted(observed, "bin_position")
    place = (x + offset[0], y + offset[1], z + DROP_HEIGHT)
    return (yield from first_allowed(observed, *(_put(place, yaw, pace) for yaw in HEADINGS)))


def _outside(observed: Observation) -> tuple[float, float]:
    """Distance of the next piece outside the bin's walls along x and y, m; negative if it is inside."""
    (x, y, _), middle = observed["clutter_position"], observed["bin_position"]
    return (abs(x - middle[0]) - BIN_SIDES[0], abs(y - middle[1]) - BIN_SIDES[1])


def _room_missing(observed: Observation) -> float:
    """Room that a hand lacks between the next piece and the nearest wall of the bin, m."""
    yaw, outside = _grip_yaw(observed), _outside(observed)
    along_x, along_y = abs(cos(yaw)), abs(sin(yaw))
    if outside[1] > outside[0]:
        along_x, along_y = along_y, along_x
    return HAND_HALF[0] * along_x + HAND_HALF[1] * along_y - max(outside)


def _away_from_the_bin(observed: Observation) -> tuple[float, float]:
    """The direction away from the nearest wall of the bin, at the next piece."""
    (x, y, _), middle, outside = observed["clutter_position"], observed["bin_position"], _outside(observed)
    if outside[1] > outside[0]:
        return (0.0, 1.0 if y > middle[1] else -1.0)
    return (1.0 if x > middle[0] else -1.0, 0.0)


def _drag_from_the_bin(observed: Observation, pace: float) -> Task:
    """Draw the next piece off the bin's wall, until a hand has room."""
    x, y, z = observed["clutter_position"]
    top = (x, y, 2.0 * z - _lift(observed))
    return (
        yield from _drag(observed, pace, top, _away_from_the_bin(observed), _room_missing(observed) + 0.02)
    )


def _drag(observed: Observation, pace: float, place: Place, away: tuple[float, float], way: float) -> Task:
    """Press closed fingers on the top of a thing at `place`, and draw it by `way` in the direction `away`."""
    yaw = 0.0 if away[1] == 0.0 else -pi / 2
    x, y, top = place[0], place[1], place[2] + PAD
    yield act("grip", width=CLOSED, force=GRIP_FORCE)
    yield from _approach(observed, pace, (x, y, top + 0.006), yaw)
    end = (x + way * away[0], y + way * away[1], top)
    observed = yield act("slide", target=end, force=DRAG_FORCE, speed=DRAG_SPEED)
    return (yield from _rise(observed, pace, yaw))


def _grip_yaw(observed: Observation) -> float:
    """The yaw to grip the next piece at: the fingers close along a wall of the bin that they are near.

    They turn a piece that fits between them in that direction. Where both sides of another one fit, a quarter
    of a turn leaves it as good a grip.
    """
    outside = _outside(observed)
    yaw, length = float(observed["clutter_yaw"]), observed["clutter_length"]
    if max(outside) >= HAND_REACH:
        return yaw
    across = outside[1] > outside[0]
    along = -pi / 2 if across else 0.0
    if length * (abs(cos(yaw - along)) + abs(sin(yaw - along))) < TURNED_WIDTH:
        return along
    return yaw - pi / 2 if across and length < BOTH_SIDES_FIT else yaw


def _grasp(observed: Observation, pace: float, place: Place, yaw: float, width: float) -> Task:
    """Come down on `place` with open fingers and close them to `width` or until they hold."""
    yield act("grip", width=OPEN, force=GRIP_FORCE)
    yield from _approach(observed, pace, place, yaw)
    return (yield act("grip", width=width, force=GRIP_FORCE))


def _approach(observed: Observation, pace: float, place: Place, yaw: float) -> Task:
    """Rise, go over `place`, come down to it, slowly at the end."""
    observed = yield from _sense(observed, "tool_position", "base_position")
    x, y, z = place
    here = observed["tool_position"]
    pace = _unfolding(observed, pace, place)
    if here[2] < TRAVEL_HEIGHT - 0.005 and hypot(x - here[0], y - here[1]) > 0.005:
        yield act("move_tool", target=(here[0], here[1], TRAVEL_HEIGHT), yaw=yaw, speed=_free(observed, pace))
    yield act("move_tool", target=(x, y, TRAVEL_HEIGHT), yaw=yaw, speed=_free(observed, pace))
    yield act("move_tool", target=(x, y, z + CLEARANCE), yaw=yaw, speed=_free(observed, pace))
    return (yield act("move_tool", target=(x, y, z), yaw=yaw, speed=NEAR_SPEED))


def _grips(place: Place, yaw: float, pace: float) -> tuple[Way, ...]:
    """Grips at a place: as it is, beside it along the pads, and with the hand turned by half a turn."""

    def way(aside: float, turn: float) -> Way:
        x, y, z = place
        beside = (x + aside * cos(yaw), y + aside * sin(yaw), z)

        def grip(observed: Observation) -> Task:
            observed = yield from _grasp(observed, pace, beside, yaw + turn, 0.02)
            return (yield from _rise(observed, pace, yaw + turn))

        return grip

    half = -pi if yaw > 0.0 else pi
    return (way(0.0, 0.0), way(PADS_ASIDE, 0.0), way(-PADS_ASIDE, 0.0), way(0.0, half))


def _put(place: Place, yaw: float, pace: float) -> Way:
    """Come down on a place with what is held, let go and rise; what is let go stays there."""

    def put(observed: Observation) -> Task:
        if observed.get("holding") is False:
            return observed
        yield from _approach(observed, pace, place, yaw)
        observed = yield act("grip", width=OPEN, force=GRIP_FORCE)
        return (yield from _rise(observed, pace, yaw))

    return put


def _rise(observed: Observation, pace: float, yaw: float) -> Task:
    """Lift the tool straight up to travelling height; a move begins slowly by itself."""
    observed = yield from _sense(observed, "tool_position")
    x, y, _ = observed["tool_position"]
    return (yield act("move_tool", target=(x, y, TRAVEL_HEIGHT), yaw=yaw, speed=_free(observed, pace)))
