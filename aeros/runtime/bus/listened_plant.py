"""Plant wrapper that passes every measurement to listeners."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

from aeros.runtime.bus.message_publisher import RobotChain
from aeros.runtime.ports import (
    CameraPicture,
    Monitor,
    MotionCompletion,
    MotionHandle,
    NoMotion,
    ObservedMonitor,
    Obstacle,
    PlannedMotion,
    Plant,
    Readings,
    Trajectory,
    known_obstacles,
    newest_pictures,
    plan_sequence,
)
from aeros.skill import Action


class MeasurementListener(Protocol):
    """Listener to measurements; must not raise, and should be quick."""

    def on_tick(self, now: float, values: Mapping[str, Any], chain: RobotChain) -> None:
        """Receive what was measured at a control tick.

        Args:
            now: plant seconds.
            values: values (SI) or readings, by vocabulary name.
            chain: kinematic chain of the robot, and the pose of its base.
        """

    def on_observed(self, readings: Readings, chain: RobotChain) -> None:
        """Receive what was measured, each value at its own time.

        Args:
            readings: value (SI) and plant time (s) of each state variable, by name.
            chain: kinematic chain of the robot, and the pose of its base.
        """


@runtime_checkable
class PictureListener(Protocol):
    """Listener that gets pictures, too; must not raise, and should be quick."""

    def on_picture(self, picture: CameraPicture) -> None:
        """Receive a new picture of a camera.

        Args:
            picture: the picture.
        """


class ListenedPlant:
    """Plant that behaves as `plant` and passes observations and control ticks to listeners.

    Wrap a plant once, with all its listeners. The wrapper learns the robot's body and base pose from planned
    motions. The base is unknown while a motion is active that may move it.

    Args:
        plant: the wrapped plant.
        listeners: called in order.
    """

    def __init__(self, plant: Plant, *listeners: MeasurementListener) -> None:
        self._plant = plant
        self._listeners = listeners
        self._viewers = [one.on_picture for one in listeners if isinstance(one, PictureListener)]
        self._shown: dict[str, float] = {}
        """Time of the newest picture of each camera that was shown, s."""
        self._chain = RobotChain()
        self._travelling: set[MotionHandle] = set()
        # A robot that waits for its first goal observes nothing yet.
        self._show_new_pictures()

    def now(self) -> float:
        """Implement `Plant.now`."""
        return self._plant.now()

    def observe(self) -> Readings:
        """Implement `Plant.observe`."""
        readings = self._plant.observe()
        for listener in self._listeners:
            listener.on_observed(readings, self._chain)
        self._show_new_pictures()
        return readings

    def plan(self, action: Action) -> PlannedMotion:
        """Implement `Plant.plan`."""
        plan = self._plant.plan(action)
        if isinstance(plan, Trajectory):
            self._chain = RobotChain(plan.body, None if self._travelling else plan.base)
        return plan

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        """Implement `Plant.begin`."""
        motion = self._plant.begin(action, decided)
        if not isinstance(motion, MotionCompletion) and not _base_is_fixed(decided):
            self._travelling.add(motion)
            self._chain = self._chain._replace(base=None)
        return motion

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Implement `Plant.advance`; listeners are called after the monitor and do not change its answer."""

        def notify(now: float, values: Mapping[str, Any], rule: str | None) -> None:
            for listener in self._listeners:
                listener.on_tick(now, values, self._chain)

        ended = self._plant.advance(ObservedMonitor(monitor, notify), until)
        self._travelling.difference_update(ended)
        return ended

    @property
    def runs_in_real_time(self) -> bool:
        """True if the plant does not wait for the monitor."""
        return bool(getattr(self._plant, "runs_in_real_time", False))

    def obstacles(self) -> tuple[Obstacle, ...]:
        """Return the obstacles that pictures of the plant have shown; see `known_obstacles`.

        Returns:
            The obstacles, oldest first.
        """
        return known_obstacles(self._plant)

    def plan_sequence(self, actions: Sequence[Action]) -> Sequence[PlannedMotion] | None:
        """Plan actions one after the other; see `ports.plan_sequence`.

        Args:
            actions: the actions.

        Returns:
            A plan for each; None if the plant cannot plan ahead.
        """
        return plan_sequence(self._plant, actions)

    def pictures(self) -> Mapping[str, CameraPicture]:
        """Return the newest pictures of the plant; see `newest_pictures`.

        Returns:
            The pictures by camera; empty if it has none.
        """
        return newest_pictures(self._plant)

    def _show_new_pictures(self) -> None:
        if not self._viewers:
            return
        for name, picture in newest_pictures(self._plant).items():
            if self._shown.get(name) != picture.time:
                self._shown[name] = picture.time
                for show in self._viewers:
                    show(picture)

    def halt(self, motion: MotionHandle) -> None:
        """Implement `Plant.halt`."""
        self._plant.halt(motion)

    def stop(self) -> None:
        """Implement `Plant.stop`."""
        self._plant.stop()
        self._travelling.clear()

    def skill_began(self, skill: str) -> None:
        """Implement `Plant.skill_began`."""
        self._plant.skill_began(skill)

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """Implement `Plant.skill_ended`."""
        self._plant.skill_ended(skill, finished=finished)

    def close(self) -> None:
        """Implement `Plant.close`."""
        self._plant.close()


def _base_is_fixed(plan: PlannedMotion | None) -> bool:
    """Return True if the plan shows that the base does not move."""
    return isinstance(plan, NoMotion) or (isinstance(plan, Trajectory) and not any(plan.base_path))
