"""Making a dumpling with a folding press: lay out, re-align, fold and seal, boil.

All lengths in metres, in the world frame; at yaw 0 the fingers close along y.  Nothing here decides
whether a step succeeded: what is measured afterwards does.
"""

from collections.abc import Generator
from math import atan2, cos, hypot, pi, sin

from aeros.skill import Action, Inputs, Observation, SkillBody, act

Task = Generator[Action, Observation, Observation]
Place = tuple[float, float, float]

SPEED = 0.25
"""Peak speed of free motion, m/s."""

NEAR_SPEED = 0.10
"""Peak speed where fingers are near things, m/s."""

TRAVEL_HEIGHT = 0.25
"""Height of sideways motion, m: what is carried clears the press's open lid and handle (0.11 m)."""

CLEARANCE = 0.06
"""Height above a grasp from which the approach is slow, m."""

OPEN = 0.08
"""Fingers wide open, m."""

HANDLE_FORCE = 10.0
"""Grip on the press's handle, N."""

DOUGH_FORCE = 5.0
"""Grip on wrapper, filling and dumpling, N: light things are squeezed out by more."""

HINGE_HEIGHT = 0.011
"""From the middle of the wrapper's plates up to the hinge's axis, m."""

DUMPLING_GRASP = 0.004
"""How far above the lower plate's middle the dumpling is gripped, m: the pads reach past both plates."""

DUMPLING_MIDDLE = 0.022
"""From the wrapper's hinge to the middle of its plates, m."""

FILLING_HALF_HEIGHT = 0.0085
FILLING_GRASP = 0.003
"""How far above the filling's middle it is gripped, m: fingertips stay clear of what it stands on."""

LID_CLOSED = 172.0 * pi / 180.0
"""Lid angle, rad, from which force control closes the rest."""

LID_STEPS = 14
"""Chords of the handle's half circle: 0.5 mm off it at most."""

SQUEEZE_FORCE = 4.0
"""N at the handle."""

COOKING_TIME = 5.5
"""s in the pot."""


def prepare(observed: Observation, inputs: Inputs) -> SkillBody:
    """Bring the wrapper onto the open press and the filling onto the wrapper, whichever is missing."""
    if not observed["dough_on_workspace"]:
        observed = yield from _open_press(observed)
        observed = yield from _lay_wrapper(observed)
    if not observed["filling_on_workspace"]:
        observed = yield from _lay_filling(observed)


def recover(observed: Observation, inputs: Inputs) -> SkillBody:
    """Lift the wrapper, with what lies on it, and put it where it belongs on the open press."""
    observed = yield from _open_press(observed)
    yield from _lay_wrapper(observed)


def wrap(observed: Observation, inputs: Inputs) -> SkillBody:
    """Fold the lid over by its handle, squeeze, and open the press again."""
    observed = yield from _grasp(observed, observed["press_handle_position"], 0.0, 0.036, HANDLE_FORCE)
    axis = _press_axis(observed)
    observed = yield from _swing(observed, LID_CLOSED)
    x, y, _ = observed["tool_position"]
    yield act("slide", target=(x, y, axis[2]), force=SQUEEZE_FORCE, speed=0.02)
    yield act("wait", duration=0.3)
    observed = yield from _swing(observed, 0.0)
    yield from _release(observed)


def boil(observed: Observation, inputs: Inputs) -> SkillBody:
    """Carry the dumpling to the pot, drop it in and let it cook."""
    x, y, z = observed["wrapper_position"]
    yaw = observed["wrapper_yaw"]
    middle = (x + DUMPLING_MIDDLE * cos(yaw), y + DUMPLING_MIDDLE * sin(yaw), z + DUMPLING_GRASP)
    observed = yield from _grasp(observed, middle, yaw, 0.046, DOUGH_FORCE)
    observed = yield from _rise(observed, yaw)
    x, y, z = observed["pot_position"]
    yield act("move_tool", target=(x, y, TRAVEL_HEIGHT), yaw=0.0, speed=SPEED)
    observed = yield act("move_tool", target=(x, y, z + 0.005), yaw=0.0, speed=NEAR_SPEED)
    yield from _release(observed)
    yield act("wait", duration=COOKING_TIME)


def _lay_wrapper(observed: Observation) -> Task:
    """Grip the wrapper across its hinge and set it down on the press."""
    yaw = observed["wrapper_yaw"]
    observed = yield from _grasp(observed, observed["wrapper_position"], yaw, 0.046, DOUGH_FORCE)
    observed = yield from _rise(observed, yaw)
    return (yield from _put(observed, observed["press_position"]))


def _lay_filling(observed: Observation) -> Task:
    """Grip the filling and set it down in the middle of the wrapper's plate on the bed."""
    x, y, z = observed["filling_position"]
    observed = yield from _grasp(observed, (x, y, z + FILLING_GRASP), 0.0, 0.012, DOUGH_FORCE, 0.05)
    observed = yield from _rise(observed, 0.0)
    x, y, z = observed["wrapper_position"]
    yaw = observed["wrapper_yaw"]
    height = z + 0.003 + FILLING_HALF_HEIGHT + FILLING_GRASP
    middle = (x + DUMPLING_MIDDLE * cos(yaw), y + DUMPLING_MIDDLE * sin(yaw), height)
    return (yield from _put(observed, middle, 0.05))


def _open_press(observed: Observation) -> Task:
    """Swing the lid open when it is not."""
    if _lid_angle(observed) < 0.2:
        return observed
    observed = yield from _grasp(observed, observed["press_handle_position"], 0.0, 0.036, HANDLE_FORCE)
    observed = yield from _swing(observed, 0.0)
    return (yield from _release(observed))


def _press_axis(observed: Observation) -> Place:
    x, y, z = observed["press_position"]
    return (x, y, z + HINGE_HEIGHT)


def _lid_angle(observed: Observation) -> float:
    """Angle of the lid from its handle: 0 open, towards -x; π closed."""
    x, _, z = _press_axis(observed)
    handle = observed["press_handle_position"]
    return atan2(handle[2] - z, x - handle[0])


def _swing(observed: Observation, end: float) -> Task:
    """Move the gripped handle along its circle to the lid angle `end`."""
    axis = _press_axis(observed)
    handle = observed["press_handle_position"]
    radius = hypot(handle[0] - axis[0], handle[2] - axis[2])
    start = _lid_angle(observed)
    for step in range(1, LID_STEPS + 1):
        angle = start + (end - start) * step / LID_STEPS
        target = (axis[0] - radius * cos(angle), axis[1], axis[2] + radius * sin(angle))
        observed = yield act("move_tool", target=target, yaw=0.0, speed=NEAR_SPEED)
    return observed


def _grasp(
    observed: Observation, place: Place, yaw: float, width: float, force: float, opened: float = OPEN
) -> Task:
    """Come down on `place` with open fingers and close them to `width` or until they hold."""
    x, y, z = place
    yield act("grip", width=opened, force=DOUGH_FORCE)
    here = observed["tool_position"]
    if here[2] < TRAVEL_HEIGHT:
        yield act("move_tool", target=(here[0], here[1], TRAVEL_HEIGHT), yaw=yaw, speed=SPEED)
    yield act("move_tool", target=(x, y, TRAVEL_HEIGHT), yaw=yaw, speed=SPEED)
    yield act("move_tool", target=(x, y, z + CLEARANCE), yaw=yaw, speed=SPEED)
    yield act("move_tool", target=(x, y, z), yaw=yaw, speed=NEAR_SPEED)
    return (yield act("grip", width=width, force=force))


def _put(observed: Observation, place: Place, opened: float = OPEN) -> Task:
    """Carry what is held to `place`, set it down and rise."""
    x, y, z = place
    yield act("move_tool", target=(x, y, TRAVEL_HEIGHT), yaw=0.0, speed=SPEED)
    yield act("move_tool", target=(x, y, z + CLEARANCE), yaw=0.0, speed=SPEED)
    observed = yield act("move_tool", target=(x, y, z), yaw=0.0, speed=NEAR_SPEED)
    return (yield from _release(observed, opened))


def _release(observed: Observation, opened: float = OPEN) -> Task:
    """Open the fingers and rise."""
    observed = yield act("grip", width=opened, force=DOUGH_FORCE)
    return (yield from _rise(observed, 0.0))


def _rise(observed: Observation, yaw: float) -> Task:
    """Lift the tool straight up to travelling height, slowly at first."""
    x, y, z = observed["tool_position"]
    yield act("move_tool", target=(x, y, z + CLEARANCE), yaw=yaw, speed=NEAR_SPEED)
    return (yield act("move_tool", target=(x, y, TRAVEL_HEIGHT), yaw=yaw, speed=SPEED))
