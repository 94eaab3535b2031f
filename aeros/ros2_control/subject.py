"""Statements about the plant `ros2-control`, to which `aeros check-plant` holds it. It moves the arm."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from aeros.ros2_control.plant import JointTrajectoryPlant
from aeros.ros2_control.settings import read_settings
from aeros.runtime.ports import Plant
from aeros.sim.conformance.plant_under_test import PlantUnderTest
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot_file import robot_of
from aeros.skill import Action
from aeros.spec.model.site import Site
from aeros.wired_arm.check_motions import WAIT, move_joints, open_at
from aeros.wired_arm.settings import SettingsError, load_site_file

SITE: Final = "AEROS_ROS2_CONTROL_SITE"
"""Environment variable with the site file for `aeros check-plant ros2-control`."""

_WAY: Final = 0.2
"""Way of the first, third and last joint in the checks from the robot's ready posture, rad."""

_PERIOD: Final = 0.05
"""Longest time between two joint states, s: broadcasters publish at 100 Hz and more; chosen, with room for a
busy computer."""


def control_subject() -> PlantUnderTest:
    """State what the plant is held to, on the robot that the environment names.

    Returns:
        The statements.

    Raises:
        SettingsError: a setting is missing or wrong.
        UserError: the site file has problems.
    """
    site = _load_site()
    model = robot_of(site)
    settings = read_settings(os.environ, site, model.joint_count)
    ready = tuple(model.postures.ready.tolist())
    end = tuple([q + _WAY * (number in (0, 2, len(ready) - 1)) for number, q in enumerate(ready)])

    def make_plant() -> Plant:
        return open_at(lambda: JointTrajectoryPlant(settings, model, (0.0, 0.0, 0.0), site.state), ready)

    return PlantUnderTest(
        make_plant=make_plant,
        motion_action=move_joints(end),
        parallel_action=Action("wait", {"duration": WAIT}),
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
        raise SettingsError(f"no site is named: set {SITE} to the site file of the robot")
    return load_site_file(Path(path))
