"""Settings of the plant `ros2-control`: names, from the environment; thresholds, from the site."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from aeros.spec.model.site import Site
from aeros.wired_arm.settings import SettingsError, watch_bounds

CONTROLLER: Final = "AEROS_ROS2_CONTROL"
"""Environment variable with the name of the controller's node, as `/joint_trajectory_controller`."""

JOINTS: Final = "AEROS_ROS2_CONTROL_JOINTS"
"""Environment variable with the names of the joints, from the base outwards, separated by commas."""

STATES: Final = "AEROS_ROS2_CONTROL_STATES"
"""Environment variable with the topic of the joint states; `/joint_states` by default."""

_NAME: Final = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")

_CONTROLLER_SHARE: Final = 2.0
"""Multiple of the site's bound on tracking at which the controller itself ends a motion: AEROS brakes the
robot first, on its path."""


@dataclass(frozen=True)
class ControlSettings:
    """Settings of one robot.

    Attributes:
        controller: name of the controller's node.
        joints: names of its joints, from the base outwards.
        states: topic of the joint states.
        patience: longest time without joint states, or without a judgement of the monitor, s.
        start_tolerance: greatest distance of a motion's start from the joints, rad, as the site bounds it.
        path_tolerance: error of each joint at which the controller itself ends a motion, rad.
    """

    controller: str
    joints: tuple[str, ...]
    states: str
    patience: float
    start_tolerance: float
    path_tolerance: tuple[float, ...]


def read_settings(environment: Mapping[str, str], site: Site, joint_count: int) -> ControlSettings:
    """Read the settings.

    Args:
        environment: of this process.
        site: the site.
        joint_count: number of joints of the site's robot.

    Returns:
        The settings.

    Raises:
        SettingsError: one is missing or wrong.
    """
    controller = environment.get(CONTROLLER, "").strip()
    if not controller:
        raise SettingsError(
            f"no controller is named: set {CONTROLLER} to the name of its node, as in "
            f"{CONTROLLER}=/joint_trajectory_controller"
        )
    states = environment.get(STATES, "/joint_states").strip()
    for variable, name in ((CONTROLLER, controller), (STATES, states)):
        if not _NAME.fullmatch(name):
            raise SettingsError(f"{variable} is `{name}`: it is a name of ROS 2 that begins with `/`")
    joints = tuple([one.strip() for one in environment.get(JOINTS, "").split(",") if one.strip()])
    if len(joints) != joint_count or len(set(joints)) != joint_count:
        raise SettingsError(
            f"{JOINTS} has {len(set(joints))} different names, and the robot of the site `{site.id}` has "
            f"{joint_count} joints: list them from the base outwards, separated by commas"
        )
    bounds = watch_bounds(site)
    tracking = None if site.motion is None else site.motion.tracking
    if tracking is None or len(tracking.levers) != joint_count:
        raise SettingsError(
            f"the site `{site.id}` does not bound the distance from the decided path: add `motion.tracking`"
        )
    return ControlSettings(
        controller,
        joints,
        states,
        bounds.patience,
        bounds.start_tolerance,
        tuple([_CONTROLLER_SHARE * float(tracking.bound / lever) for lever in tracking.levers]),
    )
