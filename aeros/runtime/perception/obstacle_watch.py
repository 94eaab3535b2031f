"""Watch for obstacles: looks at every new picture of a plant where the site in force asks for it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.perception.camera_places import CameraPlaces
from aeros.runtime.perception.obstacle_map import ObstacleMap
from aeros.runtime.perception.posture_log import PostureLog
from aeros.runtime.ports import (
    CameraPicture,
    Monitor,
    Obstacle,
    PlannedMotion,
    Plant,
    Readings,
    RobotBody,
    Trajectory,
    announce_stop,
    newest_pictures,
)
from aeros.runtime.records.failed_measurements import RecordEvent
from aeros.skill import Action
from aeros.spec.model.motion import MotionPolicy

_SLOW: Final = 0.1
"""Speed of a motion that is planned and never made, m/s."""


class ObstacleWatch:
    """Looks for obstacles in the pictures of a plant.

    Args:
        plant: takes the pictures, and states the robot's body with its plans.
        record: writes events of cameras into the audit record.
    """

    def __init__(self, plant: Plant, record: RecordEvent) -> None:
        self._plant = plant
        self._has_pictures = hasattr(plant, "pictures")
        self._configuration: Configuration | None = None
        self._postures = PostureLog()
        self._cameras = CameraPlaces(self._postures, record)
        self._map = ObstacleMap(self._postures)
        self._body: RobotBody | None = None

    def set_configuration(self, configuration: Configuration) -> None:
        """Follow another configuration.

        Args:
            configuration: its site says whether and where to look.
        """
        self._configuration = configuration

    def obstacles(self) -> tuple[Obstacle, ...]:
        """Return what the pictures show and nobody declared, as of the latest `look`.

        Returns:
            The obstacles, oldest first.
        """
        return self._map.obstacles()

    def note_plan(self, plan: PlannedMotion) -> None:
        """Remember the robot's body, if a plan states it.

        Args:
            plan: plan of the plant.
        """
        if type(plan) is Trajectory:
            self._body = plan.body

    def note_posture(self, readings: Readings) -> None:
        """Remember where the robot is, for a picture that is taken now.

        Args:
            readings: readings of the plant, now.
        """
        motion = self._motion()
        if motion is not None:
            self._postures.note(motion, self._plant.now(), readings)

    def pictures(self) -> Mapping[str, CameraPicture]:
        """Return the newest pictures of the plant, with the true places of their cameras, if those are seen.

        Returns:
            The pictures by camera; empty if it has none.
        """
        pictures, motion = newest_pictures(self._plant), self._motion()
        return pictures if motion is None else self._cameras.place(pictures, motion)

    def look(self, readings: Readings, values: Readings) -> None:
        """Look at the pictures that are new.

        Args:
            readings: readings of the plant, now.
            values: values of perceivers.
        """
        motion = self._motion()
        if motion is None or self._configuration is None:
            return
        pictures = self.pictures()
        if not pictures:
            return
        body = self._robot_body(motion, readings)
        if body is not None:
            self._map.look(self._configuration, pictures, {**readings, **values}, body)

    def noting_postures(self, monitor: Monitor) -> Monitor:
        """Return a monitor that also notes at every tick where the robot is, if that is of use.

        Args:
            monitor: the monitor that answers.

        Returns:
            The monitor for the next advance.
        """
        motion = self._motion()
        return monitor if motion is None else _PostureMonitor(monitor, self._postures, motion)

    def _motion(self) -> MotionPolicy | None:
        """Return the motion policy in force if it looks for obstacles, and the plant takes pictures."""
        if not self._has_pictures or self._configuration is None:
            return None
        motion = self._configuration.site.motion
        return None if motion is None or motion.obstacles is None else motion

    def _robot_body(self, motion: MotionPolicy, readings: Readings) -> RobotBody | None:
        """Return the robot's body, which the plant states with every motion: asked for one that is none."""
        joints = readings.get(motion.start_variable)
        if self._body is None and joints is not None:
            for name, kind in motion.kinds.items():
                if kind.joint_target is not None and kind.peak_speed is not None:
                    stay = dict(zip(kind.joint_target, joints.value, strict=True))
                    self.note_plan(self._plant.plan(Action(name, {**stay, kind.peak_speed: _SLOW})))
        return self._body


class _PostureMonitor:
    """A monitor that also notes at every tick where the robot is."""

    def __init__(self, monitor: Monitor, postures: PostureLog, motion: MotionPolicy) -> None:
        self._monitor, self._postures, self._motion = monitor, postures, motion

    def __call__(self, now: float, measured: Mapping[str, Any]) -> str | None:
        answer = self._monitor(now, measured)
        self._postures.note(self._motion, now, measured)
        return answer

    def begin_stop(self, reason: str, now: float) -> None:
        announce_stop(self._monitor, reason, now)
