"""What is the matter with the robot's parts in one tick, put together so that order does not matter."""

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
from aeros.sim.sensors import SensorModel


@dataclass(frozen=True, slots=True)
class Degradation:
    """How badly the robot's parts work; by default as they are built.

    friction: of the finger pads, at most; force: of the grip, N, at most.
    strength: share of the arm's torque; lag: ticks by which the arm follows late.
    sensors: how badly quantities are measured, by name.
    """

    friction: float = inf
    force: float = inf
    torque_share: float = 1.0
    lag_ticks: int = 0
    sensors: Mapping[str, SensorModel] = field(default_factory=dict)

    def combine_worst(self, other: Degradation) -> Degradation:
        """Of each part what is the worse of the two."""
        return Degradation(
            min(self.friction, other.friction),
            min(self.force, other.force),
            min(self.torque_share, other.torque_share),
            max(self.lag_ticks, other.lag_ticks),
            _worst_models(self.sensors, other.sensors),
        )


NO_DEGRADATION: Final = Degradation()
"""Every part as it is built."""


class DegradationApplier:
    """Brings a hindrance to the robot's motors, pads and sensors, and takes it back.

    The arm follows a queue of what was commanded.  After a delay it catches up at twice the pace, so that
    set points do not leap.
    """

    def __init__(self, stage: PlantParts) -> None:
        self._robot = stage.robot
        self._sensors = stage.sensors
        self._models = dict(stage.sensors.models)
        self._before = NO_DEGRADATION
        self._late: deque[tuple[Vector, Vector]] = deque()

    def apply(self, now: Degradation) -> None:
        """Set motors, pads and sensors for the tick to come."""
        robot, before = self._robot, self._before
        if now.friction != before.friction:
            robot.set_finger_friction(min(now.friction, robot.finger_friction))
        if now.force != inf or before.force != inf:
            width, force = robot.grip_command
            robot.set_finger_motors(width, min(force, now.force))
        if now.lag_ticks or self._late or now.torque_share != 1.0 or before.torque_share != 1.0:
            q, qd = self._delayed_set_points(now.lag_ticks)
            robot.set_arm_motors(q, qd, now.torque_share)
        if now.sensors != before.sensors:
            models = _worst_models(self._models, now.sensors)
            self._sensors.models.clear()
            self._sensors.models.update(models)
        self._before = now

    def _delayed_set_points(self, lag: int) -> tuple[Vector, Vector]:
        """The set points that the arm follows in this tick, `lag` ticks late or on the way there."""
        commanded = (self._robot.q_command, self._robot.qd_command)
        if lag and not self._late:
            # What it was told before now is done; it waits there for what comes late.
            self._late.append((commanded[0] - commanded[1] * TICK, np.zeros(len(commanded[0]))))
        self._late.append(commanded)
        if len(self._late) <= lag:
            return self._late[0]
        if len(self._late) > lag + 1:
            self._late.popleft()
        return self._late.popleft()


def _worst_models(
    one: Mapping[str, SensorModel], other: Mapping[str, SensorModel]
) -> Mapping[str, SensorModel]:
    as_built = SensorModel()
    names = {**one, **other}
    return {name: _worst_model(one.get(name, as_built), other.get(name, as_built)) for name in names}


def _worst_model(one: SensorModel, other: SensorModel) -> SensorModel:
    """As noisy, as coarse, as late and as often interrupted as the worse of the two."""
    return SensorModel(
        max(one.noise, other.noise),
        max(one.resolution, other.resolution),
        max(one.latency, other.latency),
        max(one.dropout, other.dropout),
    )
