"""Values of the state variables, from the states that the robot reports."""

from __future__ import annotations

from collections.abc import Collection
from math import hypot, pi
from operator import sub
from typing import Any, Final

from aeros.runtime.ports import Vec3
from aeros.sim.kinematic.tool_kinematics import tool_kinematics
from aeros.sim.robot.contact_estimate import estimate_contact_force
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot import max_link_speed
from aeros.wired_arm.arm import USER_STOPPED, ArmState

_TORQUE_CUTOFF: Final = 30.0
"""Cut-off frequency of the first-order filter of torques, of which the rate is taken, Hz, as on the
simulators."""

_STILL: Final = (0.0, 0.0, 0.0)


class Measurements:
    """Measurements of one robot, state by state.

    Args:
        model: the robot.
        base: position of the arm's base in W, m.
        declared: names of the site's state variables; others are not measured.
    """

    def __init__(self, model: RobotModel, base: Vec3, declared: Collection[str]) -> None:
        self._model, self._base = model, base
        self._declared = frozenset(declared)
        self._filtered: tuple[float, ...] | None = None
        self._rates: tuple[float, ...] = (0.0,) * model.joint_count
        self._time = 0.0

    def take(self, state: ArmState) -> dict[str, Any]:
        """Compute the values at a state.

        Args:
            state: the state; its time never goes back.

        Returns:
            Values by vocabulary name, SI, positions in W.
        """
        self._filter(state)
        tool = tool_kinematics(self._model, state.q)
        speed = [
            sum(rate * way[axis] for rate, way in zip(state.dq, tool.jacobian, strict=True))
            for axis in range(3)
        ]
        x, y, z = (a + b for a, b in zip(tool.position, self._base, strict=True))
        errors = tuple(map(sub, state.q_d, state.q))
        values = {
            "joint_position": state.q,
            "joint_velocity": state.dq,
            "joint_torque": state.torque,
            "joint_torque_rate": self._rates,
            "tool_position": (x, y, z),
            "tool_speed": hypot(*speed),
            "link_speed": max_link_speed(self._model, state.q, state.dq, _STILL),
            # To first order, small joint errors displace links as a motion at these rates does in 1 s.
            "tracking_error": max_link_speed(self._model, state.q, errors, _STILL),
            "contact_force": estimate_contact_force(self._model, state.q, state.external_torque),
            "estop_pressed": state.mode == USER_STOPPED,
            "base_position": self._base,
        }
        return {name: value for name, value in values.items() if name in self._declared}

    def _filter(self, state: ArmState) -> None:
        """Filter the torques, and take their rates, N·m/s."""
        elapsed, self._time = state.time - self._time, state.time
        if self._filtered is None:
            self._filtered = state.torque
        elif elapsed > 0.0:
            share = elapsed / (elapsed + 1.0 / (2.0 * pi * _TORQUE_CUTOFF))
            steps = [share * (a - b) for a, b in zip(state.torque, self._filtered, strict=True)]
            self._filtered = tuple(map(sum, zip(self._filtered, steps, strict=True)))
            self._rates = tuple([step / elapsed for step in steps])
