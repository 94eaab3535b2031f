"""Taking a sponge by a learned policy: a network gives each step of the hand towards the sponge.

The network imitates `clean_table` of AEROS (tools/train_hold_sponge.py).  It is asked for one step of the
hand at a time, and the gate decides each.  All lengths in metres, in the world frame.
"""

from collections.abc import Generator, Iterable
from math import dist, hypot

from aeros.skill import Action, Inputs, Models, Observation, SkillBody, act

Task = Generator[Action, Observation, Observation]

NEAR_SPEED = 0.10
"""Peak speed where fingers are near things, m/s."""

SPEED = 0.25
"""Peak speed elsewhere, m/s."""

NEAR = 0.10
"""Height above the grasp below which fingers are near things, m."""

CLEARANCE = 0.153
"""Height above the grasp at which the hand turns and rises to, m: 0.20 above the table."""

SPONGE_GRASP = 0.032
"""Height of the sponge's grasp above the foam's middle, m."""

OPEN = 0.08
"""Fingers wide open, m."""

CLOSED = 0.02
"""Fingers around the sponge's block, m."""

GRIP_FORCE = 10.0
"""N."""

ARRIVED = 0.005
"""Distance from the grasp at which the hand closes, m."""

STEPS = 60
"""Largest number of steps of the hand."""

LOOKS = 5
"""Largest number of looks for a sponge that is not seen."""

SPONGE = ("sponge_position", "sponge_yaw")
"""Pose of the sponge; unknown if the last picture does not show it."""

PATIENCE = 40
"""Number of waits of 0.25 s for a reading that is missing or too old."""


def take(observed: Observation, inputs: Inputs, models: Models) -> SkillBody:
    """Look for the sponge; if it is seen, let the policy lead the open hand to it, close it and rise."""
    for _ in range(LOOKS):
        observed = yield act("look", camera="overhead")
        if _are_known(observed, SPONGE):
            break
    else:
        return
    x, y, z = observed["sponge_position"]
    yaw = observed["sponge_yaw"]
    grasp = (x, y, z + SPONGE_GRASP)
    yield act("grip", width=OPEN, force=GRIP_FORCE)
    for _ in range(STEPS):
        observed = yield from _sense(observed, "tool_position")
        tool = observed["tool_position"]
        offset = (grasp[0] - tool[0], grasp[1] - tool[1], grasp[2] - tool[2])
        if hypot(*offset) < ARRIVED:
            break
        step = models["policy"].run(offset=offset)["step"]
        target = (tool[0] + step[0], tool[1] + step[1], tool[2] + step[2])
        speed = NEAR_SPEED if tool[2] - grasp[2] < NEAR else SPEED
        observed = yield act("move_tool", target=target, yaw=yaw, speed=speed)
    yield act("grip", width=CLOSED, force=GRIP_FORCE)
    here = observed["tool_position"]
    if dist(here, grasp) < CLEARANCE:
        yield act("move_tool", target=(here[0], here[1], grasp[2] + CLEARANCE), yaw=yaw, speed=NEAR_SPEED)
    yield act("look", camera="overhead")


def _are_known(observed: Observation, names: Iterable[str]) -> bool:
    return all(name in observed for name in names)


def _sense(observed: Observation, *names: str) -> Task:
    """Wait until all of `names` are observed; a name that stays unknown ends the skill where it is read."""
    for _ in range(PATIENCE):
        if _are_known(observed, names):
            break
        observed = yield act("wait", duration=0.25)
    return observed
