"""Statements about the plant `franka`, to which `aeros check-plant franka` holds it. It moves the arm."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from aeros.franka.plant import FrankaPlant
from aeros.franka.settings import read_settings
from aeros.runtime.ports import Plant
from aeros.sim.conformance.plant_under_test import PlantUnderTest
from aeros.sim.robot.robot_file import robot_of
from aeros.sim.shipped_files import shipped_files
from aeros.skill import Action
from aeros.spec.model.site import Site
from aeros.wired_arm.arm import CYCLE
from aeros.wired_arm.check_motions import WAIT, move_joints, open_at
from aeros.wired_arm.settings import load_site_file

SITE: Final = "AEROS_FRANKA_SITE"
"""Environment variable with the site file for `aeros check-plant franka`; by default that of AEROS's cell."""

START: Final = (0.0, -0.6, 0.0, -2.1, 0.0, 1.5, 0.785)
END: Final = (0.2, -0.5, 0.1, -1.9, 0.1, 1.5, 0.6)
"""Postures between which the checks move the arm, rad."""

_REACTION: Final = 0.05
"""Time from the state in which a rule is broken until braking begins, s, also on a busy computer."""

_HANDOVER: Final = 0.03
"""Time in which libfranka itself reads the states, as it begins or ends a motion, s. Measured: 4 ms; 18 ms on
a computer with four times as much to do as it has cores."""


def franka_subject() -> PlantUnderTest:
    """State what the plant is held to, on the robot that the environment names.

    Returns:
        The statements.

    Raises:
        SettingsError: a setting is missing or wrong.
        UserError: the site file has problems.
    """
    site = load_cell()
    model, settings = robot_of(site), read_settings(os.environ, site)

    def make_plant() -> Plant:
        return open_at(lambda: FrankaPlant(settings, model, (0.0, 0.0, 0.0), site.state), START)

    return PlantUnderTest(
        make_plant=make_plant,
        motion_action=move_joints(END),
        parallel_action=Action("wait", {"duration": WAIT}),
        period=CYCLE,
        tracking_tolerance=0.02,
        max_overshoot=0.6,
        deceleration=tuple(model.limits.acceleration.tolist()),
        max_stop_time=0.6 + _REACTION,
        noise=2e-3,
        handover=_HANDOVER,
        repeats=False,
    )


def load_cell() -> Site:
    """Load the site that the environment names; that of AEROS's cell if it names none.

    Returns:
        The site.

    Raises:
        SettingsError: the file is no site file.
        UserError: it has problems.
    """
    return load_site_file(Path(os.environ.get(SITE) or shipped_files("sites")["fr3_cell"]))
