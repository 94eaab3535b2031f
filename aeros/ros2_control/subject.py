"""Statements about the plant `ros2-control`, to which `aeros check-plant` holds it. It moves the arm."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from aeros.ros2_control.plant import JointTrajectoryPlant
from aeros.ros2_control.settings import ControlSettingsError, read_settings
from aeros.runtime.ports import MotionCompletion, Plant
from aeros.sim.conformance.plant_under_test import PlantUnderTest
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot_file import robot_of
from aeros.skill import Action
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site

SITE: Final = "AEROS_ROS2_CONTROL_SITE"
"""Environment variable with the site file for `aeros check-plant ros2-control`."""

_SPEED: Final = 0.15
"""Greatest speed of the tool in the checks, m/s."""

_WAY: Final = 0.2
"""Way of the first, third and last joint in the checks from the robot's ready posture, rad."""

_WAIT: Final = 8.0
"""Time that the parallel action waits, s: the motion takes about two."""

_PERIOD: Final = 0.05
"""Longest time between two joint states, s: broadcasters publish at 100 Hz and more; chosen, with room for a
busy computer."""


def control_subject() -> PlantUnderTest:
    """State what the plant is held to, on the robot that the environment names.

    Returns:
        The statements.

    Raises:
        ControlSettingsError: a setting is missing or wrong.
        UserError: the site file has problems.
    """
    site = _load_site()
    model = robot_of(site)
    settings = read_settings(os.environ, site, model.joint_count)
    ready = tuple(model.postures.ready.tolist())
    end = tuple([q + _WAY * (number in (0, 2, len(ready) - 1)) for number, q in enumerate(ready)])

    def make_plant() -> Plant:
        plant = JointTrajectoryPlant(settings, model, (0.0, 0.0, 0.0), site.state)
        try:
            _bring_to(plant, ready)
        except BaseException:
            plant.close()
            raise
        return plant

    return PlantUnderTest(
        make_plant=make_plant,
        motion_action=_move_joints(end),
        parallel_action=Action("wait", {"duration": _WAIT}),
        period=_PERIOD,
        tracking_tolerance=0.03,
        max_overshoot=0.6,
        deceleration=_doubled(model),
        max_stop_time=1.2,
        noise=2e-3,
        handover=0.3,
        repeats=False,
    )


def _doubled(model: RobotModel) -> tuple[float, ...]:
    """Return limits for decelerations that are measured from speeds of states 10 ms apart."""
    return tuple((2.0 * model.limits.acceleration).tolist())


def _load_site() -> Site:
    path = os.environ.get(SITE, "").strip()
    if not path:
        raise ControlSettingsError(f"no site is named: set {SITE} to the site file of the robot")
    diagnostics = Diagnostics()
    site = load_site(Path(path), diagnostics)
    diagnostics.raise_if_errors()
    if site is None:
        raise ControlSettingsError(f"`{path}` is no site file")
    return site


def _move_joints(q: tuple[float, ...]) -> Action:
    return Action("move_joints", {**{f"q{i}": value for i, value in enumerate(q, 1)}, "speed": _SPEED})


def _bring_to(plant: Plant, q: tuple[float, ...]) -> None:
    """Move the arm to where the checks begin: a robot stands where it was left.

    Raises:
        RuntimeError: it does not get there.
    """
    motion = plant.begin(_move_joints(q))
    if isinstance(motion, MotionCompletion):
        raise RuntimeError(f"the arm cannot go to the start of the checks: {motion.reason}")  # noqa: TRY004
    end = plant.advance(lambda time, values: None, plant.now() + 60.0)[motion]
    if not end.completed:
        raise RuntimeError(f"the arm did not get to the start of the checks: {end.reason}")
