"""Statements about the plant `franka`, to which `aeros check-plant franka` holds it. It moves the arm."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from aeros.franka.arm import CYCLE
from aeros.franka.plant import FrankaPlant
from aeros.franka.settings import SettingsError, read_settings
from aeros.runtime.ports import MotionCompletion, Plant
from aeros.sim.conformance.plant_under_test import PlantUnderTest
from aeros.sim.robot.robot_file import robot_of
from aeros.sim.shipped_files import shipped_files
from aeros.skill import Action
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site

SITE: Final = "AEROS_FRANKA_SITE"
"""Environment variable with the site file for `aeros check-plant franka`; by default that of AEROS's cell."""

_SPEED: Final = 0.15
START: Final = (0.0, -0.6, 0.0, -2.1, 0.0, 1.5, 0.785)
END: Final = (0.2, -0.5, 0.1, -1.9, 0.1, 1.5, 0.6)
"""Postures between which the checks move the arm, rad, and the speed of its tool, m/s."""

_WAIT: Final = 8.0
"""Time that the parallel action waits, s: the motion takes about two."""

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
        plant = FrankaPlant(settings, model, (0.0, 0.0, 0.0), site.state)
        try:
            _bring_to_start(plant)
        except BaseException:
            plant.close()
            raise
        return plant

    return PlantUnderTest(
        make_plant=make_plant,
        motion_action=move_joints(END),
        parallel_action=Action("wait", {"duration": _WAIT}),
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
    path = Path(os.environ.get(SITE) or shipped_files("sites")["fr3_cell"])
    diagnostics = Diagnostics()
    site = load_site(path, diagnostics)
    diagnostics.raise_if_errors()
    if site is None:
        raise SettingsError(f"`{path}` is no site file")
    return site


def move_joints(q: tuple[float, ...]) -> Action:
    """Make the action that moves the arm to a posture, slowly.

    Args:
        q: positions, rad.

    Returns:
        The action.
    """
    return Action("move_joints", {**{f"q{i}": value for i, value in enumerate(q, 1)}, "speed": _SPEED})


def _bring_to_start(plant: Plant) -> None:
    """Move the arm to where the checks begin: a robot stands where it was left.

    Raises:
        RuntimeError: it does not get there.
    """
    motion = plant.begin(move_joints(START))
    if isinstance(motion, MotionCompletion):
        raise RuntimeError(f"the arm cannot go to the start of the checks: {motion.reason}")  # noqa: TRY004
    end = plant.advance(lambda time, values: None, plant.now() + 60.0)[motion]
    if not end.completed:
        raise RuntimeError(f"the arm did not get to the start of the checks: {end.reason}")
