"""The provider of the plant `ros2-control`, as the entry point of AEROS's own distribution names it."""

from __future__ import annotations

import os
from typing import Final

from aeros.ros2_control.plant import JointTrajectoryPlant
from aeros.ros2_control.settings import read_settings
from aeros.ros2_control.subject import control_subject
from aeros.runtime.ports import Plant
from aeros.session.plant_provider import PlantProvider, PlantRequest
from aeros.sim.robot.robot_file import robot_of
from aeros.wired_arm.settings import base_of


def open_control(request: PlantRequest) -> Plant:
    """Connect to the controller that the environment names.

    Args:
        request: site, scene and start of a run; of the scene, only the mount of the robot counts.

    Returns:
        The plant.

    Raises:
        SettingsError: a setting is missing or wrong.
        ProcessError: the controller cannot be reached, or is another one than the settings say.
        UserError: the site names another robot, or allows more than its limits.
    """
    model = robot_of(request.site)
    settings = read_settings(os.environ, request.site, model.joint_count)
    return JointTrajectoryPlant(settings, model, base_of(request.scene), request.site.state)


ROS2_CONTROL: Final = PlantProvider(open_control, control_subject, runs_in_real_time=True)
