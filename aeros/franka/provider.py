"""The provider of the plant `franka`, as the entry point of AEROS's own distribution names it."""

from __future__ import annotations

import os
from typing import Final

from aeros.franka.plant import FrankaPlant
from aeros.franka.settings import read_settings
from aeros.franka.subject import franka_subject
from aeros.runtime.ports import Plant
from aeros.session.plant_provider import PlantProvider, PlantRequest
from aeros.sim.robot.robot_file import robot_of
from aeros.wired_arm.settings import base_of


def open_franka(request: PlantRequest) -> Plant:
    """Connect to the robot that the environment names.

    Args:
        request: site, scene and start of a run; of the scene, only the mount of the robot counts.

    Returns:
        The plant.

    Raises:
        SettingsError: a setting is missing or wrong.
        ProcessError: the robot cannot be reached, or it is not ready to move.
        UserError: the site names another robot, or allows more than its limits.
    """
    settings = read_settings(os.environ, request.site)
    return FrankaPlant(settings, robot_of(request.site), base_of(request.scene), request.site.state)


FRANKA: Final = PlantProvider(open_franka, franka_subject, runs_in_real_time=True)
