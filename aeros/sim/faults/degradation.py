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
class Hindrance:
    """How badly the robot's parts work; by default as they are built.

    friction: of the finger pads, at most; force: of the grip, N, at most.
    strength: share of the arm's torque; lag: ticks by which the arm follows late.
    sensors: how badly quantities are measured, by name.
    """

    friction: float = inf
    force: float = inf
    strength: float = 1.0
    lag: int = 0
    sensors: Mapping[str, SensorModel] = field(default_factory=dict)

    def worse(self, other: Hindrance) -> Hindrance:
        """Of each part what is the worse of the two."""
        return Hindrance(
            min(self.friction, other.friction),
            min(self.force, other.force),
            min(self.strength, other.strength),
            max(self.lag, other.lag),
            _worse_each(self.sensors, other.sensors),
        )


UNHINDERED: Final = Hindrance()
"""Every part as it is built."""


class Hindered:
    """Brings a hindrance to the robot's motors, pads and sensors, and takes it back.

    The arm follows a queue of what was commanded.  After a delay it catches up at twice the pace, so that
    set points do not leap.
    """

    def __init__(self, stage: PlantParts) -> None:
        self._robot = stage.robot
        self._sensors = stage.sensors
        self._models = dict(stage.sensors.models)
        self._before = UNHINDERED
        self._late: deque[tuple[Vector, Vector]] = deque()

    def apply(self, now: Hindrance) -> None:
        """Set motors, pads and sensors for the tick to come."""
        robot, before = self._robot, self._before
        if now.friction != before.friction:
            robot.set_finger_friction(min(now.friction, robot.finger_friction))
        if now.force != inf or before.force != inf:
            width, force = robot.grip_command
            robot.drive_fingers(width, min(force, now.force))
        if now.lag or self._late or now.strength != 1.0 or before.strength != 1.0:
            q, qd = self._followed(now.lag)
            robot.drive_arm(q, qd, now.strength)
        if now.sensors != before.sensors:
            models = _worse_each(self._models, now.sensors)
            self._sensors.models.clear()
            self._sensors.models.update(models)
        self._before = now

    def _followed(self, lag: int) -> tuple[Vector, Vector]:
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


def _worse_each(
    one: Mapping[str, SensorModel], other: Mapping[str, SensorModel]
) -> Mapping[str, SensorModel]:
    as_built = SensorModel()
    names = {**one, **other}
    return {name: _worse(one.get(name, as_built), other.get(name, as_built)) for name in names}


def _worse(one: SensorModel, other: SensorModel) -> SensorModel:
    """As noisy, as coarse, as late and as often interrupted as the worse of the two."""
    return SensorModel(
        max(one.noise, other.noise),
        max(one.step, other.step),
        max(one.latency, other.latency),
        max(one.dropout, other.dropout),
    )
