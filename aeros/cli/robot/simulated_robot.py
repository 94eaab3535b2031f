"""Statements about the robot of a site on a simulator of AEROS, to which `aeros check-plant` holds it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace
from itertools import islice, product
from math import inf
from typing import Final

from aeros.exit_codes import UsageError
from aeros.kinematic_chain import frames_of
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.ports import Plant, Trajectory
from aeros.session.plant_factory import PHYSICS_PLANTS, make_simulator
from aeros.sim.clock import TICK
from aeros.sim.conformance.plant_under_test import PlantUnderTest
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot import SETTLE_TICKS
from aeros.sim.robot.robot_file import robot_of
from aeros.sim.robot.self_contact import find_self_contact
from aeros.skill import Action, act
from aeros.spec.model.site import Site
from aeros.spec.scenes.load import known_scenes, load_scene

SIMULATORS: Final = (*PHYSICS_PLANTS, "kinematic")
"""Plants that come with AEROS and take any robot."""

_SCENE: Final = "bare"
_JOINTS: Final = "joint_position"
_LONGEST_WAY: Final = 0.4
"""Greatest way of a joint, rad or m; the arm then keeps near its ready posture, where it has room."""

_ROOM: Final = 0.5
"""Share of the way to a joint's limit that a motion takes at most."""

_SHORTEST_MOTION: Final = 1.0
"""Time that the motion takes at least, s; the checks stop it after half of it or less."""

_SPEED: Final = 0.5
"""Speed of the tool that is tried first, m/s; halved until the motion takes long enough."""

_HALVINGS: Final = 6
_POSTURES: Final = 8
"""Postures of a way that are looked at, from its start to its end."""

_MAX_DIRECTIONS: Final = 128
"""Directions that are tried: all of them for an arm of seven joints."""

_OVERSHOOT: Final = 0.02
"""Share of the fastest joint's speed limit by which motors may exceed the profile."""

_NOISE: Final = 1e-3
"""Greatest change of a joint that stands on motors, rad."""

_USUAL_DEVIATION: Final = 0.01
"""Greatest distance of a joint from its profile on motors, rad, where the site states no `tracking`."""


def simulated_robot(plant: str, configuration: Configuration) -> PlantUnderTest:
    """State what a simulator is held to with the robot of a site, on an empty table.

    The motion moves every joint from the ready posture, to where the arm's links stay highest. Joints on
    motors may be off their profile by as much as `tracking` of the site allows the longest lever alone.

    Args:
        plant: one of `SIMULATORS`.
        configuration: the site; no module is needed.

    Returns:
        The statements.

    Raises:
        UserError: the robot of the site cannot be used.
        PlantSetupError: what the plant needs is not installed.
        UsageError: no motion was found in which no links touch.
    """
    site = configuration.site
    robot, scene = robot_of(site), load_scene(str(known_scenes()[_SCENE]))

    def make_plant() -> Plant:
        return make_simulator(plant, configuration, scene, 0, ideal_sensors=True)

    motion, duration = _motion(plant, make_plant, robot)
    # A profile peaks at 1.875 of its mean speed, which the limits of the joints bound, too.
    stopping = float(max(robot.limits.speed / robot.limits.acceleration)) / 0.9
    subject = PlantUnderTest(
        make_plant=make_plant,
        motion_action=motion,
        parallel_action=act("wait", duration=duration + 1.0),
        tracking_tolerance=1e-9,
        max_overshoot=1e-6,
        deceleration=tuple(robot.limits.acceleration.tolist()),
        max_stop_time=stopping,
        noise=1e-9,
    )
    if plant not in PHYSICS_PLANTS:
        return subject
    return replace(
        subject,
        tracking_tolerance=_deviation(site),
        max_overshoot=_OVERSHOOT * float(max(robot.limits.speed)),
        max_stop_time=stopping + SETTLE_TICKS * TICK,
        noise=_NOISE,
    )


def _deviation(site: Site) -> float:
    motion = site.motion
    if motion is None or motion.tracking is None:
        return _USUAL_DEVIATION
    return float(motion.tracking.bound / max(motion.tracking.levers))


def _motion(plant: str, make_plant: Callable[[], Plant], robot: RobotModel) -> tuple[Action, float]:
    """Choose a motion from the ready posture, and compute how long it takes, s.

    Raises:
        UsageError: none was found in which no links touch.
    """
    with closing(make_plant()) as simulator:
        target = _highest_target(robot, simulator.observe()[_JOINTS].value)
        if target is not None:
            joints = {f"q{number}": position for number, position in enumerate(target, 1)}
            for halvings in range(_HALVINGS):
                action = act("move_joints", **joints, speed=_SPEED / 2**halvings)
                plan = simulator.plan(action)
                if isinstance(plan, Trajectory) and plan.duration >= _SHORTEST_MOTION:
                    return action, plan.duration
    raise UsageError(
        f"no motion of `{robot.name}` from its posture `ready` was found that takes {_SHORTEST_MOTION:g} s "
        f"and in which no links touch; `aeros check-plant MODULE:OBJECT` takes one of yours for `{plant}`"
    )


def _highest_target(robot: RobotModel, start: Sequence[float]) -> Sequence[float] | None:
    """Choose where all joints move to: where the arm's lowest point stays highest, and no links touch."""
    best, highest = None, -inf
    lows, highs = robot.lowest_solution.tolist(), robot.highest_solution.tolist()
    ways = [
        (min(_LONGEST_WAY, _ROOM * (high - at)), -min(_LONGEST_WAY, _ROOM * (at - low)))
        for at, low, high in zip(start, lows, highs, strict=True)
    ]
    for way in islice(product(*ways), _MAX_DIRECTIONS):
        shares = [number / (_POSTURES - 1) for number in range(_POSTURES)]
        postures = [[at + each * share for at, each in zip(start, way, strict=True)] for share in shares]
        lowest = min(_lowest_point(robot, one) for one in postures)
        if lowest > highest and all(find_self_contact(robot, one) is None for one in postures):
            best, highest = postures[-1], lowest
    return best


def _lowest_point(robot: RobotModel, joints: Sequence[float]) -> float:
    """Compute the height of the moving links' lowest corner over the base, m."""
    frames = frames_of(robot.mountings, joints)
    corners = ((frames[hull.joint], one) for hull in robot.body.hulls if hull.joint for one in hull.corners)
    return min(frame.to_base(corner)[2] for frame, corner in corners)
