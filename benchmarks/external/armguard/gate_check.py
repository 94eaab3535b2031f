"""AEROS's decision on joint motions beside keep-out boxes.

The cell is the shipped FR3 cell with the boxes as barriers. The motion is a straight line between two joint
positions, as armguard-mcp plans it; AEROS's own planner gives it its timing. It goes through the decision
that every motion goes through before it starts (`MotionDecider`).
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

import aeros
from aeros.runtime.gate.decision import Decision, DecisionKind
from aeros.runtime.motion.obstacle_contact import find_obstacle_contact
from aeros.runtime.motion.swept_volume import SweptMotion
from aeros.runtime.motion.trajectory import MotionDecider
from aeros.runtime.ports import Obstacle, Reading, Trajectory
from aeros.sim.clock import TICK
from aeros.sim.robot.profile import joint_profile
from aeros.sim.robot.robot_file import robot_of
from aeros.skill import act
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site

SHIPPED_CELL: Final = Path(aeros.__file__).parent / "sites" / "fr3_cell.yaml"

MOVING_LINKS: Final = ("link3", "link4", "link5", "link6", "link7", "hand", "fingers")
"""Links beyond the shoulder, which the published count is about: the others are in the box of the base."""

_SPEED: Final = 0.25
"""Peak speed of the tool, m/s; the reduced speed of the cell."""

_NOWHERE: Final = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class ZoneVerdict:
    """AEROS's decision on one motion.

    Attributes:
        is_allowed: True if nothing objects to the motion.
        zones: keep-out boxes that it is refused for.
        others: codes and rules of the other reasons.
        hulls_are_clear: True if the closer check by the hulls of the links finds the boxes clear; AEROS makes
            it of obstacles and not of barriers.
    """

    is_allowed: bool
    zones: tuple[str, ...]
    others: tuple[str, ...]
    hulls_are_clear: bool


def cell_text(zones: Sequence[Mapping[str, Any]]) -> str:
    """Write the shipped FR3 cell with keep-out boxes.

    Args:
        zones: each with `name`, and `lower` and `upper`, its corners in the arm's base frame, m.

    Returns:
        The text of the site file.
    """
    volumes, barriers = "", ""
    for zone in zones:
        corners = [
            f"[{', '.join(f'{1000.0 * one:g} mm' for one in zone[key])}]" for key in ("lower", "upper")
        ]
        name = zone["name"]
        volumes += f"  {name}: {{lower: {corners[0]}, upper: {corners[1]}, description: a keep-out box}}\n"
        barriers += (
            f"    - {{id: {name.replace('_', '-')}, volume: {name}, keep: out, "
            f"links: [{', '.join(MOVING_LINKS)}], rationale: it is kept out of}}\n"
        )
    text = SHIPPED_CELL.read_text("utf-8")
    text = text.replace("\nvolumes:\n", f"\nvolumes:\n{volumes}", 1)
    return text.replace("\n  barriers:\n", f"\n  barriers:\n{barriers}", 1)


def cell_with_zones(zones: Sequence[Mapping[str, Any]]) -> Site:
    """Load the shipped FR3 cell with keep-out boxes.

    Args:
        zones: each with `name`, and `lower` and `upper`, its corners in the arm's base frame, m.

    Returns:
        The site.
    """
    text = cell_text(zones)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "cell.yaml")
        file.write_text(text, "utf-8")
        diagnostics = Diagnostics()
        site = load_site(file, diagnostics)
    diagnostics.raise_if_errors()
    if site is None:
        raise InternalError("a site that was not read was not reported")
    return site


class ZoneGate:
    """Decisions about motions in one cell.

    Attributes:
        clearance: distance that links keep from barriers, m.
    """

    def __init__(self, site: Site, zones: Sequence[Mapping[str, Any]]) -> None:
        if site.motion is None:
            raise InternalError("the FR3 cell has no motion policy")
        self.clearance = float(site.motion.clearance)
        self._decider = MotionDecider(site.motion)
        self._robot = robot_of(site)
        self._start_variable = site.motion.start_variable
        self._obstacles = [
            Obstacle(zone["name"], tuple(zone["lower"]), tuple(zone["upper"]), 0.0, "none", "cell")
            for zone in zones
        ]
        self._zones = {zone["name"].replace("_", "-"): zone["name"] for zone in zones}

    def decide(
        self, start: Sequence[float], end: Sequence[float], measured: Sequence[float] | None = None
    ) -> ZoneVerdict:
        """Decide the straight motion between two joint positions.

        Args:
            start: joint positions at the start (7), rad.
            end: joint positions at the end (7), rad.
            measured: joint positions that are measured before it, rad; those at the start if None.

        Returns:
            The decision.
        """
        profile = joint_profile(self._robot, np.array(start), np.array(end), _SPEED)
        plan = Trajectory(self._robot.body, (profile.path,), _NOWHERE, _NOWHERE, profile.ticks * TICK)
        asked = act("move_joints", **{f"q{n}": value for n, value in enumerate(end, 1)}, speed=_SPEED)
        readings = {
            self._start_variable: Reading(tuple(measured or start), 0.0),
            "holding": Reading(False, 0.0),
            "base_position": Reading(_NOWHERE, 0.0),
        }
        decision = self._decider.decide(Decision(DecisionKind.ALLOW, asked, ()), plan, readings)
        zones = [self._zones[one.rule] for one in decision.reasons if one.rule in self._zones]
        others = [f"{one.code} {one.rule}" for one in decision.reasons if one.rule not in self._zones]
        still = (0.0,) * len(start)
        moving = SweptMotion(self._robot.body, (list(profile.path),), still, _NOWHERE, _NOWHERE, True)
        contact = find_obstacle_contact(moving, self._obstacles, self.clearance)
        is_allowed = decision.kind is DecisionKind.ALLOW
        return ZoneVerdict(is_allowed, tuple(zones), tuple(others), contact is None)
