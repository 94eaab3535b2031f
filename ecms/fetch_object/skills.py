"""Fetching an object: drive to it, find it in pictures, grasp it, bring it to where it belongs.

All lengths in metres, in the world frame; at yaw 0 the fingers close along y.  Nothing here decides
whether a step succeeded: what is measured afterwards does.
"""

from collections.abc import Generator
from math import atan2, copysign, cos, hypot, pi, sin

from aeros.skill import Action, Inputs, Observation, SkillBody, Way, act, first_allowed

from .pushes import push_length
from .stations import EASTMOST, REACH, base_for_delivery, base_from

Task = Generator[Action, Observation, Observation]
Place = tuple[float, float, float]

CARRY_SPEED = 0.29
"""Peak speed of a hand that may hold something, m/s, if no hand has to be slower."""

NEAR_SPEED = 0.10
"""Peak speed where fingers are near things, m/s."""

BASE_SPEED = 0.48
"""Peak speed of the base, m/s."""

CARRY = (0.30, 0.0, 0.36)
"""Tool position while the base drives, relative to the arm's base, m: higher than the stands, and not over
them, as something may stand there that no picture has shown yet."""

BESIDE = (0.10, 0.50, 0.36)
"""Tool position beside the base, on either side, by which a hand comes from behind it, relative to it, m."""

ASIDE = (0.30, -0.40, 0.40)
"""Tool position that does not hide the stand from the mast camera, relative to the arm's base, m."""

LOOK_HEIGHT = 0.17
"""Height of the tool over the object's middle from which the hand camera looks, m."""

FARTHEST = 0.80
"""Greatest distance of the tool from the arm's base along x and y, m: the site's `workspace`."""

OVER_STANDS = 0.25
"""Height of the tool in the world from which a hand may turn beside a stand, with what it holds, m."""

LIFT = 0.13
"""Height by which the object is lifted before it is carried, m."""

CLEARANCE = 0.05
"""Height above a grasp or a place to put down from which the approach is slow, m."""

OPEN = 0.08
"""Fingers wide open, m."""

CLOSED = 0.01
"""Gap the fingers close to when they meet nothing, m: objects are wider."""

GRIP_FORCE = 10.0
"""N."""

SHUT = 0.005
"""Fingers closed to push with, m."""

PUSH_SPEED = 0.05
"""Peak speed of a hand that pushes, m/s: what it pushes may lie against something."""

RETREAT_SPEED = 0.20
"""Peak speed of a hand that rises after a push, m/s."""

PUSHES = 5
"""Largest number of pushes before the next grasp."""

BACK, BACK_SHARES = 0.4, (0.3, 0.85, 1.3)
"""Distance behind the way between the stands, m, and shares of that way, at which the mast sees both stands
and the floor around them."""

ABREAST = 0.3
"""Distance along y within which two places of the base show the same, m."""

LOOKS_FOR_ROOM = 3
"""Number of further looks for a push: one pixel with noise may seem to be in the way of the hand."""

LOOKS = 5
"""Number of further looks for an object that a picture does not show."""

HEADINGS = (0.0, pi / 2.0, -pi / 2.0, pi)
"""Headings to try for a hand whose heading does not matter, rad."""

ASIDE_STANDING, ASIDE_LYING = 0.009, 0.02
"""Distances from the middle of an object that stands, and of one that lies, at which its sides are still
between the pads, which are 20 mm wide, m: the hand keeps so much farther from what is beside it."""

OVER_WITHIN = 0.03
"""Greatest distance from a place, level, at which the tool is over it, m."""

SAME_STATION = 0.05
"""Distance of two places of the base below which the arm has the same ways to an object, m."""

STATION_ASIDES = (0.40, -0.40)
"""Distances to the left of an object at which the base stands where no grip was allowed from before, m."""


def navigate(observed: Observation, inputs: Inputs) -> SkillBody:
    """Tuck the arm and drive to the station; look first where memory expects the object, if not there.

    For an object that the hand cannot hold nothing moves.
    """
    pace = inputs["hand_speed"]
    if observed.get("object_fits") is False:
        return
    observed = yield from _carry(observed, pace)
    if "station_position" not in observed:
        return
    abreast = _expected(observed)
    if abreast is not None and observed.get("object_detected") is not True:
        observed = yield from _drive(abreast[0], abreast[1])
        observed = yield from _look(observed, pace)
        observed = yield from _carry(observed, pace)
        if "station_position" not in observed:
            return
    x, y, _ = observed["station_position"]
    yield from _drive(x, y)


def detect(observed: Observation, inputs: Inputs) -> SkillBody:
    """Move the arm out of sight and look from the mast; look for what is not there along the way."""
    pace = inputs["hand_speed"]
    if not _is_searched(observed):
        observed = yield from _look(observed, pace)
    if observed.get("object_detected") is not True:
        observed = yield act("look", camera="mast")
    if observed.get("object_detected") is not True and not _is_searched(observed):
        yield from _search(observed)


def grasp(observed: Observation, inputs: Inputs) -> SkillBody:
    """Look again from above with the hand camera, grip the object and lift it, if a hand can get there.

    Where the gate denies a grip, the next one is tried: with a turned hand, then with the base elsewhere.
    What the fingers miss, or what slips from them, is gripped once more by its other sides, if there is room.
    Where a camera's reading of it is missing or too old, as from a bad sensor, nothing is gripped.
    """
    pace = inputs["hand_speed"]
    if not (_is_located(observed) and observed["object_free"]):
        return
    if not _in_reach(observed, observed["object_position"]) or observed.get("object_out_of_reach") is True:
        return
    is_free_across = observed.get("object_free_across") is True and not observed["object_lying"]
    # From beside the stand the hand's camera sees the carriage, which shows if it is off.
    yield act("look", camera="hand")
    stations = (_grip_from(aside, pace) for aside in STATION_ASIDES if _is_elsewhere(observed, aside))
    ends = (_grip_turned(turn, 0.0, pace) for turn in (pi, -pi / 2.0) if turn == pi or is_free_across)
    ways = (*_grips(observed, pace), *stations, *ends)
    observed = yield from first_allowed(observed, *ways)
    is_lost = observed.get("holding") is False and observed.get("object_free_across") is True
    if is_lost and _is_located(observed) and not observed["object_lying"]:
        yield from _grip(observed, pace, pi / 2.0)


def _grips(observed: Observation, pace: float) -> tuple[Way, ...]:
    """Grips from where the base is: as pictures show the room, by the other sides, beside the middle."""
    is_lying = observed.get("object_lying") is True
    along = ASIDE_LYING if is_lying else ASIDE_STANDING
    grips = [(0.0, 0.0), (0.0, along), (0.0, -along)]
    if observed.get("object_free_across") is True and not is_lying:
        grips[1:1] = [(pi / 2.0, 0.0), (pi / 2.0, along), (pi / 2.0, -along)]
    return tuple(_grip_turned(turn, aside, pace) for turn, aside in grips)


def _grip_turned(turn: float, aside: float, pace: float) -> Way:
    """Grip with a hand that is turned from the heading that pictures give, and beside the middle."""
    return lambda observed: _grip(observed, pace, turn, aside)


def _grip_from(aside: float, pace: float) -> Way:
    """Drive to a place that is so far to the left of the object, look, and grip it from there."""

    def grip(observed: Observation) -> Task:
        if not _is_located(observed):
            return observed
        u, v = _station(observed, aside)
        observed = yield from _carry(observed, pace)
        observed = yield from _drive(u, v)
        observed = yield from _look(observed, pace)
        if not (_is_located(observed) and observed["object_free"]):
            return observed
        return (yield from first_allowed(observed, *_grips(observed, pace)))

    return grip


def _station(observed: Observation, aside: float) -> tuple[float, float]:
    """Place (x, y) of the base so far to the left of the object, m."""
    x, y, _ = observed["object_position"]
    along, across = base_from(x, aside)
    return min(EASTMOST, x + along), y + across


def _is_elsewhere(observed: Observation, aside: float) -> bool:
    """Check that the base does not stand there already, as where the floor ends."""
    u, v = _station(observed, aside)
    x, y, _ = observed["base_position"]
    return hypot(u - x, v - y) > SAME_STATION


def _grip(observed: Observation, pace: float, turn: float, aside: float = 0.0) -> Task:
    """Look at the object from above, grip it with a hand turned by `turn`, and lift it.

    `aside` is from the middle of the object to that of the fingers' pads, along these, m.
    """
    if not _is_located(observed):
        # The other ways took so long that what the mast saw is too old.
        observed = yield from _look(observed, pace)
        if not _is_located(observed):
            return observed
    yield act("grip", width=OPEN, force=GRIP_FORCE)
    yaw = _turned(observed["object_yaw"], turn)
    x, y, z = observed["object_position"]
    above = (x + aside * cos(yaw), y + aside * sin(yaw), z + LOOK_HEIGHT)
    if aside != 0.0 and _is_over(observed, above):
        # The grip in the middle was denied, with a hand that is turned so already.
        observed = yield act("move_tool", target=above, yaw=yaw, speed=_free(observed, pace))
    else:
        observed = yield from _over(observed, pace, above, 0.0, yaw)
    for _ in range(LOOKS):
        observed = yield act("look", camera="hand")
        if _is_located(observed):
            break
    else:
        return observed
    (x, y, z), yaw = observed["object_position"], _nearest(_turned(observed["object_yaw"], turn), yaw)
    dx, dy, _ = observed.get("object_grip_offset", (0.0, 0.0, 0.0))
    x, y = x + dx + aside * cos(yaw), y + dy + aside * sin(yaw)
    grip = z + observed["object_grip_height"]
    yield act("move_tool", target=(x, y, grip + CLEARANCE), yaw=yaw, speed=_free(observed, pace))
    yield act("move_tool", target=(x, y, grip), yaw=yaw, speed=NEAR_SPEED)
    yield act("grip", width=CLOSED, force=GRIP_FORCE)
    lifted = (x, y, max(grip + LIFT, OVER_STANDS))
    return (yield act("move_tool", target=lifted, yaw=yaw, speed=min(CARRY_SPEED, pace)))


def _is_over(observed: Observation, place: Place) -> bool:
    """Check that the tool is straight above a place, or there."""
    x, y, z = observed["tool_position"]
    return hypot(place[0] - x, place[1] - y) < OVER_WITHIN and z > place[2] - OVER_WITHIN


def _turned(yaw: float, turn: float) -> float:
    """Return a heading turned to the side on which the hand's last joint has room, rad."""
    return yaw + turn if yaw <= 0.0 else yaw - turn


def _put(place: Place, grip_height: float, yaw: float, pace: float) -> Way:
    """Put down what is held, whose middle comes to `place`, let go and rise; what is let go stays there."""
    x, y, z = place
    grip = z + grip_height

    def put(observed: Observation) -> Task:
        if observed.get("holding") is False:
            return observed
        yield from _over(observed, pace, (x, y, grip), CLEARANCE, yaw)
        yield act("move_tool", target=(x, y, grip + 0.001), yaw=yaw, speed=NEAR_SPEED)
        yield act("grip", width=OPEN, force=GRIP_FORCE)
        return (yield act("move_tool", target=(x, y, z + LOOK_HEIGHT), yaw=yaw, speed=pace))

    return put


def _nearest(yaw: float, to: float) -> float:
    """Return a heading, or the opposite one, which grips alike: the one nearer to that of the hand, rad."""
    return yaw + pi * round((to - yaw) / pi)


def deliver(observed: Observation, inputs: Inputs) -> SkillBody:
    """Carry the object to the other stand, put it down where it belongs and look; stop if it is lost.

    What stands in the aisle before the stand is seen first: the base then stands beside it.
    """
    pace = inputs["hand_speed"]
    observed = yield from _carry(observed, pace)
    if observed.get("object_grasped") is False:
        return
    if "object_place" not in observed:
        return
    observed = yield act("look", camera="aisle_top")
    if "object_place" not in observed:
        return
    x, y = base_for_delivery(observed["object_place"], observed.get("delivery_aside", 0.0))
    observed = yield act("move_base", x=x, y=y, speed=BASE_SPEED)
    if observed.get("object_grasped") is False:
        return
    # From here the mast sees the stand: the place relative to the base, not as far as wheels have slipped,
    # how high it is, and where there is room on it.
    observed = yield act("look", camera="mast")
    if "delivery_taken" not in observed:
        observed = yield from _look(observed, pace)
    for _ in range(LOOKS_FOR_ROOM):
        if observed.get("delivery_taken") is False:
            break
        observed = yield act("look", camera="mast")
    if "object_place" not in observed or "object_grip_height" not in observed:
        return
    if observed.get("delivery_taken") is not False:
        return
    place, grip_height = observed["object_place"], observed["object_grip_height"]
    puts = (_put(place, grip_height, yaw, pace) for yaw in _headings_to_put(observed))
    observed = yield from first_allowed(observed, *puts)
    observed = yield from _look(observed, pace)
    for _ in range(LOOKS):
        if observed.get("object_delivered") is True:
            break
        observed = yield act("look", camera="mast")


def _headings_to_put(observed: Observation) -> tuple[float, ...]:
    """Return the headings of a hand that has room to put something down: those that close alike first."""
    free = observed.get("delivery_yaw", 0.0)
    alike = tuple(yaw for yaw in HEADINGS if abs(sin(yaw - free)) <= abs(cos(yaw - free)) + 1e-9)
    if observed.get("delivery_free_across") is False:
        return alike
    return (*alike, *(yaw for yaw in HEADINGS if yaw not in alike))


def recover(observed: Observation, inputs: Inputs) -> SkillBody:
    """Let go, rise, look for the object, here or along the way to where it belongs, and drive to it.

    Where it lies against something it is pushed along that, until a hand has room.
    """
    pace = inputs["hand_speed"]
    yield act("grip", width=OPEN, force=GRIP_FORCE)
    observed = yield from _carry(observed, pace)
    observed = yield from _look(observed, pace)
    observed = yield from _search(observed)
    for _ in range(PUSHES):
        for _ in range(LOOKS_FOR_ROOM):
            if observed.get("object_free") is not False or _can_be_pushed(observed):
                break
            observed = yield act("look", camera="mast")
        if not _can_be_pushed(observed):
            return
        observed = yield from _push(observed, pace)
        observed = yield from _go_there(observed)


def _can_be_pushed(observed: Observation) -> bool:
    """Check that the last pictures show an object without room for a hand, and a push that makes room."""
    known = _is_located(observed) and "object_push_start" in observed and "object_push_way" in observed
    return known and observed.get("object_detected") is True and not observed["object_free"]


def _push(observed: Observation, pace: float) -> Task:
    """Push it by its end with closed fingers, and look."""
    (x, y, z), (dx, dy, _) = observed["object_push_start"], observed["object_push_way"]
    distance = hypot(dx, dy)
    share = push_length(distance) / distance
    end = (x + share * dx, y + share * dy, z)
    if not (_in_reach(observed, (x, y, z)) and _in_reach(observed, end)):
        return observed
    along = atan2(dy, dx)
    across = along - copysign(pi / 2, along)
    yield act("grip", width=SHUT, force=GRIP_FORCE)
    yield from _over(observed, pace, (x, y, z), CLEARANCE, across)
    yield act("move_tool", target=(x, y, z), yaw=across, speed=NEAR_SPEED)
    yield act("move_tool", target=end, yaw=across, speed=PUSH_SPEED)
    # Far to the side of the base the joints are too fast for a hand that is.
    high = (end[0], end[1], observed["base_position"][2] + CARRY[2])
    yield act("move_tool", target=high, yaw=across, speed=min(RETREAT_SPEED, pace))
    return (yield from _look(observed, pace))


def _is_located(observed: Observation) -> bool:
    """Check that every value that pictures give of the object is known."""
    needed = ("object_position", "object_yaw", "object_free", "object_lying", "object_grip_height")
    return all(name in observed for name in needed)


def _search(observed: Observation) -> Task:
    """Look from one place after the other until the object is seen, and drive to it.

    The camera over the aisle looks first: what lies in the aisle the mast does not see from there. The search
    ends, too, when pictures have shown every place where it can be, in light or not.
    """
    if observed.get("object_detected") is not True:
        observed = yield act("look", camera="aisle_top")
    for x, y in _along_the_way(observed):
        if observed.get("object_detected") is True or _is_searched(observed):
            break
        yield from _drive(x, y)
        observed = yield act("look", camera="mast")
        if observed.get("object_detected") is not True:
            # It may lie where the carriage stood before.
            observed = yield act("look", camera="aisle_top")
    return (yield from _go_there(observed))


def _is_searched(observed: Observation) -> bool:
    """Check that pictures have shown every place where it can be, or that the rest is dark or unlike it."""
    return any(observed.get(name) is True for name in ("object_absent", "search_darkened", "object_unlike"))


def _drive(x: float, y: float) -> Task:
    """Look along the aisle, so that the way leads round what stands there, and drive."""
    yield act("look", camera="aisle_top")
    return (yield act("move_base", x=x, y=y, speed=BASE_SPEED))


def _go_there(observed: Observation) -> Task:
    """Drive to the station, if it is known and the base is not there, and look again."""
    if observed.get("robot_at_target") is True or "station_position" not in observed:
        return observed
    x, y, _ = observed["station_position"]
    yield from _drive(x, y)
    return (yield act("look", camera="mast"))


def _along_the_way(observed: Observation) -> tuple[tuple[float, float], ...]:
    """Places (x, y) for the base to search a lost object, m: a step back first, as most is seen from there.

    The first is abreast of where memory expects it. Then comes the nearest of the others; then half-way, at
    the delivery, at the station. There are none while the station is unknown.
    """
    if "station_position" not in observed:
        return ()
    (x, y, _), (u, v, _) = observed["station_position"], observed["delivery_position"]
    abreast = _expected(observed)
    expected = () if abreast is None else (abreast,)
    back = [(x - BACK, y + (v - y) * share) for share in BACK_SHARES]
    here = observed["base_position"][1]
    back.sort(key=lambda place: abs(place[1] - here))
    return (*expected, *back, ((x + u - REACH) / 2, (y + v) / 2), (u - REACH, v), (x, y))


def _expected(observed: Observation) -> tuple[float, float] | None:
    """Place (x, y) for the base abreast of where memory expects the object, m.

    None if memory expects it nowhere, or where the mast sees it from the station or from here.
    """
    needed = ("object_expected_place", "station_position", "delivery_position")
    if any(name not in observed for name in needed):
        return None
    (x, y, _), (_, v, _) = observed["station_position"], observed["delivery_position"]
    last = y + (v - y) * BACK_SHARES[-1]
    abreast = min(max(observed["object_expected_place"][1], min(y, last)), max(y, last))
    seen_from = (y, observed["base_position"][1])
    return None if any(abs(abreast - one) < ABREAST for one in seen_from) else (x - BACK, abreast)


def _free(observed: Observation, pace: float) -> float:
    """Peak speed of free motion: of a hand that is not known to be empty, the lesser."""
    return pace if observed.get("holding") is False else min(CARRY_SPEED, pace)


def _from_base(observed: Observation, offset: Place) -> Place:
    """Convert a point relative to the arm's base to the world frame, m."""
    x, y, z = observed["base_position"]
    return (x + offset[0], y + offset[1], z + offset[2])


def _in_reach(observed: Observation, place: Place) -> bool:
    """Check that the arm can reach above the place from the base's present position."""
    x, y, _ = observed["base_position"]
    return bool(abs(place[0] - x) <= FARTHEST and abs(place[1] - y) <= FARTHEST)


def _look(observed: Observation, pace: float) -> Task:
    """Move the arm out of sight and look from the mast."""
    aside = _from_base(observed, ASIDE)
    yield from first_allowed(observed, *(_go(aside, yaw, pace) for yaw in HEADINGS))
    return (yield act("look", camera="mast"))


def _carry(observed: Observation, pace: float) -> Task:
    """Raise the tool to carrying height, then draw it in; from behind the base by way of its side."""
    target = _from_base(observed, CARRY)
    if observed["tool_position"][2] < target[2]:
        x, y, _ = observed["tool_position"]
        raises = (_go((x, y, target[2]), yaw, pace) for yaw in HEADINGS)
        observed = yield from first_allowed(observed, *raises)
    ahead, side, height = BESIDE
    left = observed["tool_position"][1] - observed["base_position"][1]
    beside = _from_base(observed, (ahead, copysign(side, left), height))

    def go_round(observed: Observation) -> Task:
        observed = yield from first_allowed(observed, *(_go(beside, yaw, pace) for yaw in HEADINGS))
        return (yield from first_allowed(observed, *(_go(target, yaw, pace) for yaw in HEADINGS)))

    ways = [_go(target, yaw, pace) for yaw in HEADINGS]
    return (yield from first_allowed(observed, *ways, go_round))


def _go(place: Place, yaw: float, pace: float) -> Way:
    """Go straight to a place with a hand that is turned by `yaw`."""

    def go(observed: Observation) -> Task:
        return (yield act("move_tool", target=place, yaw=yaw, speed=_free(observed, pace)))

    return go


def _over(observed: Observation, pace: float, place: Place, height: float, yaw: float = 0.0) -> Task:
    """Go over `place` at carrying height, then down to `height` above it, turned by `yaw`."""
    x, y, z = place
    carrying = observed["base_position"][2] + CARRY[2]
    yield act("move_tool", target=(x, y, carrying), yaw=yaw, speed=_free(observed, pace))
    return (yield act("move_tool", target=(x, y, z + height), yaw=yaw, speed=_free(observed, pace)))
