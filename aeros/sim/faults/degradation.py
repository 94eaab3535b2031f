"""Degradation of the robot's parts within one tick; several faults combine independently of their order."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Final

import numpy as np

from aeros.sim.clock import TICK
from aeros.sim.physics import PlantParts
from aeros.sim.robot.limits import Vector
from aeros.sim.sensor_model import SensorModel


@dataclass(frozen=True, slots=True)
class Degradation:
    """Degraded limits of the robot's parts; by default none.

    Attributes:
        friction: greatest Coulomb coefficient of the finger pads.
        force: greatest grip force, N.
        torque_share: share of the arm's torque, in [0, 1].
        lag_ticks: ticks by which the arm follows its commands late.
        sensors: sensor models of degraded quantities, by vocabulary name.
        covered: share of the window of each scanner that is covered, by its name.
        silent: names of the scanners that send nothing.
    """

    friction: float = inf
    force: float = inf
    torque_share: float = 1.0
    lag_ticks: int = 0
    sensors: Mapping[str, SensorModel] = field(default_factory=dict)
    covered: Mapping[str, float] = field(default_factory=dict)
    silent: frozenset[str] = frozenset()

    def combine_worst(self, other: Degradation) -> Degradation:
        """Combine with another degradation.

        Args:
            other: in the same tick.

        Returns:
            The worse of the two for each part.
        """
        return Degradation(
            min(self.friction, other.friction),
            min(self.force, other.force),
            min(self.torque_share, other.torque_share),
            max(self.lag_ticks, other.lag_ticks),
            _worst_models(self.sensors, other.sensors),
            {
                name: max(self.covered.get(name, 0.0), other.covered.get(name, 0.0))
                for name in {**self.covered, **other.covered}
            },
            self.silent | other.silent,
        )


NO_DEGRADATION: Final = Degradation()
"""No part is degraded."""


class DegradationApplier:
    """Applies a degradation to the robot's motors, finger pads and sensors, and undoes it.

    The arm follows a queue of commands. After a delay it catches up at twice the pace, so that set points
    do not jump.

    Args:
        parts: the parts of the plant.
    """

    def __init__(self, parts: PlantParts) -> None:
        self._robot = parts.robot
        self._sensors = parts.sensors
        self._scanners = parts.scanners
        self._models = dict(parts.sensors.models)
        self._before = NO_DEGRADATION
        self._queue: deque[tuple[Vector, Vector]] = deque()

    def apply(self, now: Degradation) -> None:
        """Set motors, pads and sensors for the coming tick.

        Args:
            now: the degradation in that tick.
        """
        robot, before = self._robot, self._before
        if now.friction != before.friction:
            robot.set_finger_friction(min(now.friction, robot.finger_friction))
        if now.force != inf or before.force != inf:
            width, force = robot.grip_command
            robot.set_finger_motors(width, min(force, now.force))
        if now.lag_ticks or self._queue or now.torque_share != 1.0 or before.torque_share != 1.0:
            q, qd = self._delayed_set_points(now.lag_ticks)
            robot.set_arm_motors(q, qd, now.torque_share)
        if now.sensors != before.sensors:
            models = _worst_models(self._models, now.sensors)
            self._sensors.models.clear()
            self._sensors.models.update(models)
        if self._scanners is not None:
            self._scanners.covered, self._scanners.silent = now.covered, now.silent
        self._before = now

    def _delayed_set_points(self, lag: int) -> tuple[Vector, Vector]:
        """Return the set points that the arm follows in this tick, `lag` ticks late or catching up."""
        commanded = (self._robot.q_command, self._robot.qd_command)
        if lag and not self._queue:
            # The last command before the delay is complete; the arm waits there for the delayed ones.
            self._queue.append((commanded[0] - commanded[1] * TICK, np.zeros(len(commanded[0]))))
        self._queue.append(commanded)
        if len(self._queue) <= lag:
            return self._queue[0]
        if len(self._queue) > lag + 1:
            self._queue.popleft()
        return self._queue.popleft()


def _worst_models(
    first: Mapping[str, SensorModel], second: Mapping[str, SensorModel]
) -> Mapping[str, SensorModel]:
    as_built = SensorModel()
    names = {**first, **second}
    return {name: _worst_model(first.get(name, as_built), second.get(name, as_built)) for name in names}


def _worst_model(first: SensorModel, second: SensorModel) -> SensorModel:
    """Return the larger error of each kind."""
    return SensorModel(
        max(first.noise, second.noise),
        max(first.resolution, second.resolution),
        max(first.latency, second.latency),
        max(first.dropout, second.dropout),
        max(first.bias, second.bias),
        max(first.colour_noise, second.colour_noise),
    )
