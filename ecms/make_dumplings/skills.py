"""Making a dumpling with a folding press: lay out, re-align, fold and seal, boil.

All lengths in metres, in the world frame; at yaw 0 the fingers close along y.  Each leg below is a
tuple of actions computed from one observation.  Nothing here decides whether a step succeeded: what
is measured afterwards does.  A skill may be broken off anywhere, as when a person comes near, so it begins
with where things are now, and goes on with what it holds.
"""

from collections.abc import Generator, Iterable
from math import atan2, copysign, cos, dist, hypot, pi, sin

from aeros.skill import Action, Inputs, Observation, SkillBody, Way, act, first_allowed

from .measures import FILLING_GAP, GAP_WITHIN, HINGE_TO_PLATE, LOWEST, PLATE_HALF, Place

Leg = tuple[Action, ...]
Task = Generator[Action, Observation, Observation]

CARRY_SPEED = 0.29
"""Peak speed of a hand that may hold something, m/s, if no hand has to be slower."""

NEAR_SPEED = 0.10
"""Peak speed where fingers are near things, m/s."""

TRAVEL_HEIGHT = 0.25
"""Height of sideways motion, m: what is carried clears the press's open lid and handle (0.11 m)."""

HEIGHT_WITHIN = 0.005
"""Greatest distance of the tool below travelling height for a sideways move, m."""

CLEARANCE = 0.04
"""Height above a grasp from which the approach is slow, m."""

OPEN = 0.08
"""Fingers wide open, m."""

HALF_OPEN = 0.05
"""Fingers open around the filling, m: they stay over the wrapper's plate."""

HANDLE_FORCE = 10.0
"""Grip on the press's handle, N."""

DOUGH_FORCE = 5.0
"""Grip on wrapper, filling and dumpling, N: light things are squeezed out by more."""

HINGE_HEIGHT = 0.011
"""From the middle of the wrapper's plates up to the hinge's axis, m."""

DUMPLING_GRASP = 0.004
"""Height of the dumpling's grasp above the lower plate's middle, m: the pads reach past both plates."""

FILLING_GRASP = 0.003
"""Height of the grasp above the filling's middle, m: fingertips stay clear of the support."""

FILLING_HEIGHT = 0.0145
"""From the middle of the wrapper's plate up to the grasp on a filling (17 mm) that lies on it, m."""

DROP_HEIGHT = 0.005
"""Height of the tool over the pot's rim when the dumpling is let go, m."""

LID_CLOSED = 172.0 * pi / 180.0
"""Lid angle, rad, from which force control closes the rest."""

LID_STEPS = 14
"""Chords of the handle's half circle: 0.5 mm off it at most."""

SQUEEZE_FORCE = 4.0
"""Force on the closed lid's handle, N."""

COOKING_TIME = 5.5
"""Time in the pot, s."""

COOKING_TRIES = 2
"""Number of such times, if pictures show that the dumpling was stirred meanwhile."""

PUSHES = 2
"""Largest number of pushes that are to give the hand room at a thing."""

WRAPPER_GAP, HANDLE_GAP = 0.056, 0.044
"""Gap of fingers that hold the wrapper, open or closed, or the press's handle, m."""

WRAPPER_GRIP, BLOCKER_GRIP = 0.046, 0.042
"""Gap that fingers close to around a wrapper, and around one of a size that is not known, m: fingers that
miss one on the press must not close on its bed, which is 36 mm wide."""

FILLING_GRIP, HANDLE_GRIP = 0.012, 0.036
"""The same around the filling and the press's handle, m."""

DEEPER = 0.002
"""Fingers that missed a wrapper, a dumpling or the handle grip it this much lower the second time, m.

They are wider apart than what a wrapper lies on. A filling is never gripped lower: around it they are over
what it lies on, and 2 mm lower they would close on that, as measured.
"""

DRAWN_IN = (0.30, 0.0, 0.45)
"""Tool position that does not hide the bench from the cameras, from the arm's base, m; the arm is there, over
everything that stands in the cell, while it is driven."""

BASE_SPEED = 0.48
"""Peak speed of the base, m/s."""

LOOKS = 5
"""Largest number of looks for a wrapper or filling that is not seen."""

WRAPPER = ("wrapper_position", "wrapper_yaw")
"""Pose of the wrapper; unknown if the last picture does not show it."""

BLOCKER = ("blocker_position", "blocker_yaw", "blocker_is_filling", "aside_place")
"""Variables of the thing that is in the way on the press, and of a free place on the bench."""

BLOCKERS = 3
"""Largest number of things to take from the press: two wrappers and a filling between them."""

PUSH = ("push_start", "push_end", "push_yaw")
"""Way of closed fingers that push a thing to where the hand has room to grip it."""

SPOT = (-0.13, 0.10, 0.0145)
"""Tool position for a filling that was held from the start and has no wrapper to be put on, from the press
along x and y and from the bench up, m."""

LOADED_CLEARANCE = 0.10
"""Height from which a loaded hand comes down slowly, m: the gate expects up to 60 mm below the fingers."""

PRESS_BACK, PRESS_FRONT = -0.084, 0.045
"""From the press's hinge to the ends of handle and bed along x, m."""

FALLEN = 0.09
"""Distance from the press within which a thing stands that fell from it, m."""

STANDING = 0.024
"""Height of the wrapper's middle, m, above which it stands on its edge: half of that is 28 mm."""

TOPPLE_HEIGHT = 0.047
"""Height of the tool, m, at which fingers reach a standing wrapper (56 mm) and the hand is over the press."""

TOPPLE_WAY = 0.05
"""Distance from a standing wrapper at which fingers come down to push it over, m."""

TOPPLE_FROM = -0.025
"""From the press to where, along x, the hand over it clears the handle, m."""

HAND_AWAY = 0.18
"""Distance of the tool from the press, level, from which the hand does not hide the press from above, m."""

ON_PRESS = 0.06
"""Distance of the wrapper from its place, m, within which it is still on the press."""

HAND_TURNS = (-1.9, 2.9)
"""Least and greatest heading of the hand over the press, rad: its last joint turns by ±2.90 rad; as tried."""

OVERHANGING = 0.02
"""Distance of the wrapper from the press's middle, across, beyond which a finger would hit the bed, m."""

HEADINGS = (0.0, pi / 2.0, -pi / 2.0, pi)
"""Headings to try for a hand whose heading does not matter, rad."""

FINGERS_HALF = 0.015
"""Half the thickness of both fingers when they are closed, m."""

POT_REACH = 0.08
"""From the pot's middle to its walls, m."""

PADS_ASIDE = 0.008
"""Distance from the middle of a thing at which its sides are still between the pads, which are 20 mm wide, m:
the hand keeps so much farther from what is beside it."""

ASKEW = 0.15
"""Turn of a hand that closes on a thing a little askew and turns it into its own heading, rad."""


def dock(observed: Observation, inputs: Inputs) -> SkillBody:
    """Raise the tool, draw it in, look along the aisle and drive to the dock."""
    pace = inputs["hand_speed"]
    yield from _raise_and_draw_in(observed, pace, _drawn_in(observed)[2])
    x, y, _ = observed["dock_position"]
    yield act("look", camera="aisle_top")
    yield act("move_base", x=x, y=y, speed=BASE_SPEED)


def take_stock(observed: Observation, inputs: Inputs) -> SkillBody:
    """Look at the bench."""
    yield from _look(observed, inputs["hand_speed"])


def prepare(observed: Observation, inputs: Inputs) -> SkillBody:
    """Bring the wrapper onto the open press and the filling onto the wrapper, what is missing, and look."""
    pace = inputs["hand_speed"]
    observed = yield from _open_press(observed, pace)
    observed = yield from _look(observed, pace)
    if observed.get("press_covered") is True:
        if _holds_wrapper(observed) and "aside_place" in observed:
            observed = yield from _do(observed, _put(pace, observed["aside_place"], OPEN))
            yield from _look(observed, pace)
        return
    if observed.get("dough_on_workspace") is not True:
        if _holds(observed, FILLING_GAP):
            # There is nothing to lay it on: the hand has to be empty for the wrapper.
            observed = yield from _lay_filling(observed, pace)
            observed = yield from _look(observed, pace)
        observed = yield from _lay_wrapper(observed, pace)
    if observed.get("filling_on_workspace") is not True and observed.get("press_covered") is not True:
        observed = yield from _lay_filling(observed, pace)
    yield from _look(observed, pace)


def recover(observed: Observation, inputs: Inputs) -> SkillBody:
    """Move the wrapper, with what lies on it, to where it belongs on the open press, and look."""
    pace = inputs["hand_speed"]
    observed = yield from _open_press(observed, pace)
    observed = yield from _look(observed, pace)
    if observed.get("press_covered") is True:
        return
    observed = yield from _realign_wrapper(observed, pace)
    yield from _look(observed, pace)


def wrap(observed: Observation, inputs: Inputs) -> SkillBody:
    """Fold the lid over by its handle, squeeze, open the press again, and look at what came of it."""
    pace = inputs["hand_speed"]
    if observed.get("press_covered") is True:
        # It may have been taken away since that picture.
        observed = yield from _look(observed, pace)
        if observed.get("press_covered") is True:
            return
    observed = yield from _take_handle(observed, pace)
    closed = _handle_at(observed, LID_CLOSED)
    pressed = (closed[0], closed[1], _hinge(observed)[2])
    observed = yield from _do(
        observed,
        (
            *_swing(observed, _lid_angle(observed), LID_CLOSED),
            act("slide", target=pressed, force=SQUEEZE_FORCE, speed=0.02),
            act("wait", duration=0.3),
            *_swing(observed, LID_CLOSED, 0.0),
            *_release(pace, _handle_at(observed, 0.0), OPEN),
        ),
    )
    yield from _look(observed, pace)
    yield act("look", camera="side")


def boil(observed: Observation, inputs: Inputs) -> SkillBody:
    """Carry the dumpling to the pot, drop it in and let it cook, between two looks at it.

    Where something lies over the pot, or on the press that it has to be taken from, the dumpling stays where
    it is.
    """
    pace = inputs["hand_speed"]
    observed = yield from _open_press(observed, pace)
    observed = yield from _look(observed, pace)
    if observed.get("pot_covered") is True:
        return
    if not (_holds_wrapper(observed) or _are_known(observed, WRAPPER)):
        return
    if _holds_wrapper(observed) or not _is_in_pot(observed):
        if not _holds_wrapper(observed):
            if observed.get("press_covered") is True:
                return
            observed = yield from _make_room(observed, pace, "wrapper_has_room", *WRAPPER)
            if observed.get("wrapper_has_room") is False or not _are_known(observed, WRAPPER):
                return
            if observed.get("dumpling_wrapped") is not True:
                return  # the looks showed another wrapper to go on with: this one is out of reach
            observed = yield from _take_wrapper(observed, pace, is_wrapped=True)
            if _is_missed(observed, WRAPPER_GRIP * _size(observed)):
                return
        x, y, z = observed.get("pot_place", _fixture(observed, "pot_position"))
        pot = (x, y, z + DROP_HEIGHT)
        drops = (_drop(pot, yaw, pace) for yaw in HEADINGS)
        observed = yield from first_allowed(observed, *drops)
        observed = yield from _look(observed, pace)
    # One that was stirred meanwhile has to lie there for that long again.
    cooked = observed.get("dumplings_cooked")
    for _ in range(COOKING_TRIES):
        observed = yield act("wait", duration=COOKING_TIME)
        observed = yield from _look(observed, pace)
        is_waiting = _are_known(observed, WRAPPER) and observed.get("dumpling_wrapped") is True
        if observed.get("dumplings_cooked") != cooked or not is_waiting or not _is_in_pot(observed):
            return


def _do(observed: Observation, leg: Leg) -> Task:
    """Ask for one action after the other; what is measured at their end."""
    for action in leg:
        observed = yield action
    return observed


def _fixture(observed: Observation, name: str) -> Place:
    """A surveyed place, as much higher as a picture shows the bench to be than it was surveyed."""
    x, y, z = observed[name]
    return (x, y, z + float(observed.get("bench_lift", 0.0)))


def _are_known(observed: Observation, names: Iterable[str]) -> bool:
    return all(name in observed for name in names)


def _look(observed: Observation, pace: float, *names: str) -> Task:
    """Draw the arm in, with what it holds, and look; again, if the wrapper or one of `names` is unknown."""
    if dist(observed["tool_position"], _drawn_in(observed)) > 0.1:
        observed = yield from _raise_and_draw_in(observed, pace, TRAVEL_HEIGHT)
    for _ in range(LOOKS):
        observed = yield act("look", camera="overhead")
        if _holds_wrapper(observed) or _are_known(observed, (*WRAPPER, *names)):
            break
    return observed


def _raise_and_draw_in(observed: Observation, pace: float, height: float) -> Task:
    """Raise the tool to `height`, if it is lower, then draw it in."""
    x, y, z = observed["tool_position"]
    if z < height - HEIGHT_WITHIN:
        yield act("move_tool", target=(x, y, height), yaw=0.0, speed=NEAR_SPEED)
    free = pace if observed["holding"] is False else min(CARRY_SPEED, pace)
    return (yield act("move_tool", target=_drawn_in(observed), yaw=0.0, speed=free))


def _drawn_in(observed: Observation) -> Place:
    """The tool position of a drawn-in arm, in the world frame."""
    x, y, z = observed["base_position"]
    return (x + DRAWN_IN[0], y + DRAWN_IN[1], z + DRAWN_IN[2])


def _holds(observed: Observation, gap: float) -> bool:
    """Check that the fingers hold an object of that width, as after an interrupted run."""
    return observed["holding"] is True and bool(abs(observed["finger_gap"] - gap) < GAP_WITHIN)


def _size(observed: Observation) -> float:
    """Size of the wrapper over the usual one, as pictures show it."""
    return float(observed.get("wrapper_scale", 1.0))


def _holds_wrapper(observed: Observation) -> bool:
    """Check that the fingers hold something as wide as the wrapper."""
    return _holds(observed, WRAPPER_GAP * _size(observed))


def _take(
    observed: Observation,
    pace: float,
    place: Place,
    yaw: float,
    width: float,
    opened: float = OPEN,
    *turns: float,
) -> Task:
    """Grip what is at `place` and lift it; where that is denied, beside its middle, askew or turned so."""

    def way(aside: float, turn: float) -> Way:
        heading = yaw + turn
        beside = (place[0] + aside * cos(yaw), place[1] + aside * sin(yaw), place[2])

        def take(seen: Observation) -> Task:
            grasp = _grasp(seen, pace, beside, heading, width, DOUGH_FORCE, opened)
            return (yield from _do(seen, (*grasp, *_rise(beside, heading, min(CARRY_SPEED, pace)))))

        return take

    asides = ((0.0, 0.0), (PADS_ASIDE, 0.0), (-PADS_ASIDE, 0.0))
    offsets = (*asides, *((0.0, turn) for turn in (ASKEW, -ASKEW, *turns)))
    return (yield from first_allowed(observed, *(way(*offset) for offset in offsets)))


def _is_missed(observed: Observation, width: float) -> bool:
    """Check that fingers that were to close to `width` got there: they hold nothing."""
    is_empty = observed.get("holding") is False and "finger_gap" in observed
    return is_empty and bool(observed["finger_gap"] < width + GAP_WITHIN)


def _deeper(place: Place) -> Place:
    """A place to grip that is lower than one at which the fingers missed."""
    return (place[0], place[1], place[2] - DEEPER)


def _take_wrapper(observed: Observation, pace: float, *, is_wrapped: bool) -> Task:
    """Grip the wrapper across its hinge, or a dumpling across its plates, and lift it.

    Where it is not held then, look, and grip it once more, deeper and as if its size were not known.
    """

    def grip() -> tuple[Place, float]:
        if is_wrapped:
            return _on_plate(observed, DUMPLING_GRASP), observed["wrapper_yaw"]
        return observed["wrapper_position"], _hand_heading(observed["wrapper_yaw"])

    width = WRAPPER_GRIP * _size(observed)
    place, yaw = grip()
    observed = yield from _take(observed, pace, place, yaw, width)
    if not _is_missed(observed, width):
        return observed
    observed = yield from _look(observed, pace)
    if not _are_known(observed, WRAPPER) or observed.get("wrapper_has_room") is False:
        return observed
    place, yaw = grip()
    return (yield from _take(observed, pace, _deeper(place), yaw, BLOCKER_GRIP))


def _take_filling(observed: Observation, pace: float) -> Task:
    """Grip the filling and lift it.

    Where it is not held then, look, and grip it once more: by its other sides if there is room, else as the
    new picture shows it.
    """
    yaw, place = observed.get("filling_yaw", 0.0), _filling_grasp(observed)
    across = -pi / 2.0 if yaw > 0.0 else pi / 2.0
    turns = (across,) if observed.get("filling_free_across") is True else ()
    observed = yield from _take(observed, pace, place, yaw, FILLING_GRIP, HALF_OPEN, *turns)
    if not _is_missed(observed, FILLING_GRIP):
        return observed
    observed = yield from _look(observed, pace, "filling_position")
    if "filling_position" not in observed or observed.get("filling_has_room") is False:
        return observed
    place, yaw = _filling_grasp(observed), observed.get("filling_yaw", 0.0)
    if observed.get("filling_free_across") is True:
        yaw += pi / 2.0 if yaw <= 0.0 else -pi / 2.0
    return (yield from _take(observed, pace, place, yaw, FILLING_GRIP, HALF_OPEN))


def _filling_grasp(observed: Observation) -> Place:
    """The place of the tool that grips the filling."""
    x, y, z = observed["filling_position"]
    return (x, y, z + FILLING_GRASP)


def _lay_wrapper(observed: Observation, pace: float) -> Task:
    """Grip the wrapper across its hinge, wherever it lies, and set it down on the press; if it is seen."""
    press = _fixture(observed, "press_position")
    if not _holds_wrapper(observed):
        observed = yield from _clear_press(observed, pace)
        if observed.get("press_free") is False or not _are_known(observed, WRAPPER):
            return observed
        place = observed["wrapper_position"]
        if dist(place, press) < ON_PRESS:
            return (yield from _realign_wrapper(observed, pace))
        if (
            observed.get("wrapper_has_room") is False
            and place[2] > STANDING
            and _is_beside_press(observed, place)
        ):
            observed = yield from _do(observed, _topple(observed, pace, place))
            observed = yield from _look(observed, pace)
        observed = yield from _make_room(observed, pace, "wrapper_has_room", *WRAPPER)
        if observed.get("wrapper_has_room") is False or not _are_known(observed, WRAPPER):
            return observed
        place, yaw = observed["wrapper_position"], _hand_heading(observed["wrapper_yaw"])
        observed = yield from _take_wrapper(observed, pace, is_wrapped=False)
        if _is_missed(observed, WRAPPER_GRIP * _size(observed)):
            return observed
        # Something may have been put on the press meanwhile; from where the hand is, it does not hide that.
        x, y, _ = observed["tool_position"]
        if hypot(x - press[0], y - press[1]) > HAND_AWAY:
            observed = yield act("look", camera="overhead")
            if observed.get("press_covered") is True:
                # The arm may have been taken for it: the next picture is without the arm.
                observed = yield from _look(observed, pace)
            if observed.get("press_covered") is True:
                return (yield from _do(observed, _put(pace, place, OPEN, yaw)))
    return (yield from _do(observed, _put(pace, press, OPEN)))


def _hand_heading(yaw: float) -> float:
    """Heading of a hand that grips a wrapper turned by `yaw`: an equal one, or the nearest in reach.

    Fingers that close on a wrapper a few degrees off turn it into their own heading.
    """
    least, most = HAND_TURNS
    return min(yaw + 2.0 * pi if yaw < least else yaw, most)


def _clear_press(observed: Observation, pace: float) -> Task:
    """Put what lies on the press and is in the way on the bench, and look.

    A wrapper that the fingers miss is gripped once more, deeper; after a second miss in a row the rest stays.
    """
    is_second = False
    for _ in range(BLOCKERS):
        if observed.get("press_free") is not False or not _are_known(observed, BLOCKER):
            break
        place, yaw, aside = observed["blocker_position"], observed["blocker_yaw"], observed["aside_place"]
        if observed["blocker_is_filling"]:
            width, place = FILLING_GRIP, (place[0], place[1], place[2] + FILLING_GRASP)
            observed = yield from _take(observed, pace, place, yaw, width, HALF_OPEN)
        else:
            width = BLOCKER_GRIP
            observed = yield from _take(observed, pace, _deeper(place) if is_second else place, yaw, width)
        is_missed = _is_missed(observed, width)
        if not is_missed:
            observed = yield from _do(observed, _put(pace, aside, OPEN))
        observed = yield from _look(observed, pace)
        if is_missed and is_second:
            break
        is_second = is_missed
    return observed


def _make_room(observed: Observation, pace: float, room: str, *names: str) -> Task:
    """Push a thing to where the hand has room to grip it, as pictures show the way, and look."""
    for _ in range(PUSHES):
        if observed.get(room) is not False or not _are_known(observed, (*PUSH, *names)):
            break
        observed = yield from _do(observed, _push(observed, pace))
        observed = yield from _look(observed, pace, *names)
    return observed


def _push(observed: Observation, pace: float) -> Leg:
    """Push with closed fingers as the perceiver says."""
    start, (x, y, z), yaw = observed["push_start"], observed["push_end"], observed["push_yaw"]
    return (
        *_reach_closed(observed, pace, start, yaw),
        act("move_tool", target=(x, y, z), yaw=yaw, speed=NEAR_SPEED),
        act("move_tool", target=(x, y, TRAVEL_HEIGHT), yaw=yaw, speed=NEAR_SPEED),
    )


def _realign_wrapper(observed: Observation, pace: float) -> Task:
    """Grip the wrapper that lies on the press, and move it to where it belongs; if it is seen.

    Where the fingers miss it, look, and grip it once more, deeper; after a second miss nothing is moved.
    """
    press = _fixture(observed, "press_position")
    if _holds_wrapper(observed):
        return (yield from _do(observed, _put(pace, press, OPEN)))
    if not _are_known(observed, WRAPPER):
        return observed
    place, yaw = observed["wrapper_position"], observed["wrapper_yaw"]
    if abs(place[1] - press[1]) > OVERHANGING:
        observed = yield from _do(observed, _nudge(observed, pace, place))
        observed = yield from _look(observed, pace)
        if not _are_known(observed, WRAPPER):
            return observed
        place, yaw = observed["wrapper_position"], observed["wrapper_yaw"]
    # Not lifted: an edge of it may be under the handle's bar.
    along = act("move_tool", target=press, yaw=0.0, speed=NEAR_SPEED)
    width = WRAPPER_GRIP * _size(observed)
    grasp = _grasp(observed, pace, place, _hand_heading(yaw), width, DOUGH_FORCE)
    observed = yield from _do(observed, grasp)
    if _is_missed(observed, width):
        observed = yield from _do(observed, _release(pace, place, OPEN))
        observed = yield from _look(observed, pace)
        if not _are_known(observed, WRAPPER):
            return observed
        place, yaw = _deeper(observed["wrapper_position"]), observed["wrapper_yaw"]
        grasp = _grasp(observed, pace, place, _hand_heading(yaw), BLOCKER_GRIP, DOUGH_FORCE)
        observed = yield from _do(observed, grasp)
        if _is_missed(observed, BLOCKER_GRIP):
            return (yield from _do(observed, _release(pace, place, OPEN)))
    return (yield from _do(observed, (along, *_release(pace, press, OPEN))))


def _nudge(observed: Observation, pace: float, thing: Place) -> Leg:
    """Push a wrapper that hangs over the press's side back by its outer edge: a finger would hit the bed."""
    _, y, z = _fixture(observed, "press_position")
    edge = copysign(PLATE_HALF[1] + FINGERS_HALF, thing[1] - y)
    begin, end = (thing[0], thing[1] + 1.5 * edge, z), (thing[0], y + edge, z)
    return (
        *_reach_closed(observed, pace, begin, 0.0),
        act("move_tool", target=end, yaw=0.0, speed=NEAR_SPEED),
        act("move_tool", target=(end[0], end[1], TRAVEL_HEIGHT), yaw=0.0, speed=NEAR_SPEED),
    )


def _lay_filling(observed: Observation, pace: float) -> Task:
    """Grip the filling, if it is seen, and set it down on the wrapper; where there is none, put it back."""
    x, y, _ = _fixture(observed, "press_position")
    back = spot = (x + SPOT[0], y + SPOT[1], SPOT[2])
    if not _holds(observed, FILLING_GAP):
        observed = yield from _clear_press(observed, pace)
        if observed.get("press_free") is False:
            return observed
        if "filling_position" not in observed:
            observed = yield from _look(observed, pace, "filling_position")
        observed = yield from _make_room(observed, pace, "filling_has_room", "filling_position")
        if "filling_position" not in observed or observed.get("filling_has_room") is False:
            return observed
        back = _filling_grasp(observed)
        observed = yield from _take_filling(observed, pace)
        if _is_missed(observed, FILLING_GRIP):
            return observed
        # The wrapper may have been moved while the filling was fetched, or knocked off.
        observed = yield from _look(observed, pace)
        if observed.get("wrappers_suffice") is False:
            return observed
    is_laid_out = observed.get("dough_on_workspace") is True and _are_known(observed, WRAPPER)
    if observed.get("press_covered") is True:
        is_laid_out = False
    goals = (_on_plate(observed, FILLING_HEIGHT),) if is_laid_out else (back, spot)
    puts = (_drop(goal, yaw, pace, HALF_OPEN) for goal in goals for yaw in HEADINGS)
    return (yield from first_allowed(observed, *puts))


def _is_beside_press(observed: Observation, thing: Place) -> bool:
    """Check that a thing is where it comes to from the press: within a fall's reach of its bed."""
    x, y, _ = _fixture(observed, "press_position")
    return abs(thing[1] - y) < FALLEN and PRESS_BACK - FALLEN < thing[0] - x < PRESS_FRONT + FALLEN


def _topple(observed: Observation, pace: float, thing: Place) -> Leg:
    """Push over a wrapper that stands on its edge, towards the press that it fell from: right side up."""
    press = _fixture(observed, "press_position")
    x = max(thing[0], press[0] + TOPPLE_FROM)
    out = copysign(TOPPLE_WAY, thing[1] - press[1])
    return (
        *_reach_closed(observed, pace, (x, thing[1] + out, TOPPLE_HEIGHT), 0.0),
        act("move_tool", target=(x, thing[1], TOPPLE_HEIGHT), yaw=0.0, speed=NEAR_SPEED),
        act("move_tool", target=(x, thing[1] + out, TOPPLE_HEIGHT), yaw=0.0, speed=NEAR_SPEED),
        act("move_tool", target=(x, thing[1] + out, TRAVEL_HEIGHT), yaw=0.0, speed=min(CARRY_SPEED, pace)),
    )


def _reach_closed(observed: Observation, pace: float, place: Place, yaw: float) -> Leg:
    """Come down on `place` with closed fingers; at a yaw of π/2 the hand is along the press's side."""
    x, y, z = place
    here = observed["tool_position"]
    up = (here[0], here[1], max(here[2], TRAVEL_HEIGHT))
    return (
        act("grip", width=OPEN, force=DOUGH_FORCE),
        act("move_tool", target=up, yaw=yaw, speed=pace),
        act("grip", width=0.0, force=DOUGH_FORCE),
        act("move_tool", target=(x, y, TRAVEL_HEIGHT), yaw=yaw, speed=min(CARRY_SPEED, pace)),
        act("move_tool", target=(x, y, z + CLEARANCE), yaw=yaw, speed=min(CARRY_SPEED, pace)),
        act("move_tool", target=place, yaw=yaw, speed=NEAR_SPEED),
    )


def _is_in_pot(observed: Observation) -> bool:
    """Check that the dumpling's hinge is seen below the pot's rim and above its floor."""
    x, y, z = observed["wrapper_position"]
    rim = _fixture(observed, "pot_position")
    within: bool = z < rim[2] and abs(x - rim[0]) < POT_REACH and abs(y - rim[1]) < POT_REACH
    return within


def _on_plate(observed: Observation, height: float) -> Place:
    """The place `height` above the middle of the wrapper's plate that lies on the bed."""
    x, y, z = observed["wrapper_position"]
    yaw = observed["wrapper_yaw"]
    away = HINGE_TO_PLATE * _size(observed)
    return (x + away * cos(yaw), y + away * sin(yaw), z + height)


def _open_press(observed: Observation, pace: float) -> Task:
    """Swing the lid open when it is not, and let go of it."""
    if _lid_angle(observed) < 0.2 and not _holds(observed, HANDLE_GAP):
        return observed
    observed = yield from _take_handle(observed, pace)
    opening = _swing(observed, _lid_angle(observed), 0.0)
    return (yield from _do(observed, (*opening, *_release(pace, _handle_at(observed, 0.0), OPEN))))


def _take_handle(observed: Observation, pace: float) -> Task:
    """Grip the lid's handle, unless it is held already; deeper, if the fingers miss it."""
    if _holds(observed, HANDLE_GAP):
        return observed
    handle = _fixture(observed, "press_handle_position")
    observed = yield from _do(observed, _grasp(observed, pace, handle, 0.0, HANDLE_GRIP, HANDLE_FORCE))
    if _is_missed(observed, HANDLE_GRIP):
        handle = _deeper(_fixture(observed, "press_handle_position"))
        again = _grasp(observed, pace, handle, 0.0, HANDLE_GRIP, HANDLE_FORCE)
        observed = yield from _do(observed, again)
    return observed


def _hinge(observed: Observation) -> Place:
    """The middle of the press's hinge."""
    x, y, z = _fixture(observed, "press_position")
    return (x, y, z + HINGE_HEIGHT)


def _lid_angle(observed: Observation) -> float:
    """Angle of the lid from its handle: 0 open, towards -x; π closed."""
    x, _, z = _hinge(observed)
    handle = _fixture(observed, "press_handle_position")
    return atan2(handle[2] - z, x - handle[0])


def _handle_at(observed: Observation, angle: float) -> Place:
    """Compute the handle's position at a lid angle, m."""
    x, y, z = _hinge(observed)
    handle = _fixture(observed, "press_handle_position")
    radius = hypot(handle[0] - x, handle[2] - z)
    return (x - radius * cos(angle), y, z + radius * sin(angle))


def _swing(observed: Observation, start: float, end: float) -> Leg:
    """Move the gripped handle along its circle from one lid angle to another."""
    angles = (start + (end - start) * step / LID_STEPS for step in range(1, LID_STEPS + 1))
    return tuple(
        act("move_tool", target=_handle_at(observed, angle), yaw=0.0, speed=NEAR_SPEED) for angle in angles
    )


def _grasp(
    observed: Observation,
    pace: float,
    place: Place,
    yaw: float,
    width: float,
    force: float,
    opened: float = OPEN,
) -> Leg:
    """Come down on `place` with open fingers and close them to `width` or until they hold."""
    x, y, z = place[0], place[1], max(place[2], LOWEST)
    here = observed["tool_position"]
    up = act("move_tool", target=(here[0], here[1], TRAVEL_HEIGHT), yaw=yaw, speed=pace)
    return (
        act("grip", width=opened, force=DOUGH_FORCE),
        *((up,) if here[2] < TRAVEL_HEIGHT - HEIGHT_WITHIN else ()),
        act("move_tool", target=(x, y, TRAVEL_HEIGHT), yaw=yaw, speed=pace),
        act("move_tool", target=(x, y, z + CLEARANCE), yaw=yaw, speed=pace),
        act("move_tool", target=(x, y, z), yaw=yaw, speed=NEAR_SPEED),
        act("grip", width=width, force=force),
    )


def _put(pace: float, place: Place, opened: float, yaw: float = 0.0) -> Leg:
    """Carry what is held to `place`, set it down and rise."""
    x, y, z = place
    low, speed = (x, y, max(z + CLEARANCE, LOADED_CLEARANCE)), min(CARRY_SPEED, pace)
    return (
        act("move_tool", target=(x, y, TRAVEL_HEIGHT), yaw=yaw, speed=speed),
        act("move_tool", target=low, yaw=yaw, speed=speed),
        act("move_tool", target=place, yaw=yaw, speed=NEAR_SPEED),
        *_release(pace, place, opened, yaw),
    )


def _drop(place: Place, yaw: float, pace: float, opened: float = OPEN) -> Way:
    """Put down what is held with a turned hand; what was let go stays."""

    def drop(observed: Observation) -> Task:
        if observed["holding"] is False:
            return observed
        return (yield from _do(observed, _put(pace, place, opened, yaw)))

    return drop


def _release(pace: float, place: Place, opened: float, yaw: float = 0.0) -> Leg:
    """Open the fingers at `place` and rise."""
    return (act("grip", width=opened, force=DOUGH_FORCE), *_rise(place, yaw, pace))


def _rise(place: Place, yaw: float, speed: float) -> Leg:
    """Lift the tool straight up from `place` to travelling height; a move begins slowly by itself."""
    x, y, _ = place
    return (act("move_tool", target=(x, y, TRAVEL_HEIGHT), yaw=yaw, speed=speed),)
