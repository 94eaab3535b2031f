"""Recorder of runs of a plant, and replays: its calls without agent and gate, its motors without a plant."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Final

from aeros.runtime.ports import (
    CameraPicture,
    Monitor,
    MotionCompletion,
    MotionHandle,
    PlannedMotion,
    Plant,
    Readings,
    newest_pictures,
)
from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.physics import PhysicsPlant
from aeros.skill import Action

Call = tuple[str, tuple[Any, ...]]
"""Call of a plant: the name of the method, and its arguments."""

MotorTape = list[list[tuple[str, tuple[Any, ...], dict[str, Any]]]]
"""For each step of a world, the calls of PyBullet before it that change the world."""

_CHANGES: Final = (
    "setJointMotorControlArray",
    "setJointMotorControl2",
    "changeDynamics",
    "applyExternalForce",
    "resetBasePositionAndOrientation",
)


class RecordingPlant:
    """Plant that records the calls to it, and passes them on to another."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self.calls: list[Call] = []

    def now(self) -> float:
        """Implement `Plant.now`."""
        return self._plant.now()

    def observe(self) -> Readings:
        """Implement `Plant.observe`."""
        self.calls.append(("observe", ()))
        return self._plant.observe()

    def pictures(self) -> Mapping[str, CameraPicture]:
        """Return the newest pictures of the plant."""
        return newest_pictures(self._plant)

    def plan(self, action: Action) -> PlannedMotion:
        """Implement `Plant.plan`."""
        self.calls.append(("plan", (action,)))
        return self._plant.plan(action)

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        """Implement `Plant.begin`."""
        self.calls.append(("begin", (action,)))
        return self._plant.begin(action, decided)

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Implement `Plant.advance`."""
        self.calls.append(("advance", (until,)))
        return self._plant.advance(monitor, until)

    def halt(self, motion: MotionHandle) -> None:
        """Implement `Plant.halt`."""
        self.calls.append(("halt", (motion,)))
        self._plant.halt(motion)

    def stop(self) -> None:
        """Implement `Plant.stop`."""
        self.calls.append(("stop", ()))
        self._plant.stop()

    def skill_began(self, skill: str) -> None:
        """Implement `Plant.skill_began`."""
        self.calls.append(("skill_began", (skill,)))
        self._plant.skill_began(skill)

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """Implement `Plant.skill_ended`."""
        self.calls.append(("skill_ended", (skill, finished)))
        self._plant.skill_ended(skill, finished=finished)

    def close(self) -> None:
        """Implement `Plant.close`."""
        self._plant.close()


def replay_calls(plant: Plant, calls: list[Call]) -> float:
    """Make the same calls to `plant`, without agent and gate; return the processor seconds it took."""
    planned: PlannedMotion | None = None
    planned_of: Action | None = None
    began = time.process_time()
    for name, arguments in calls:
        if name == "plan":
            (planned_of,) = arguments
            planned = plant.plan(*arguments)
        elif name == "begin":
            # Not planned: this action is of a kind that is not decided as a motion.
            plant.begin(arguments[0], planned if planned_of is arguments[0] else None)
        elif name == "advance":
            plant.advance(_no_monitor, *arguments)
        elif name == "skill_ended":
            plant.skill_ended(arguments[0], finished=arguments[1])
        else:
            getattr(plant, name)(*arguments)
    return time.process_time() - began


def _no_monitor(now: float, measured: Mapping[str, Any]) -> None:
    """Monitor that never names a rule."""


@contextmanager
def record_motor_commands() -> Iterator[MotorTape]:
    """Record what changes PyBullet's worlds while the block runs; there must be only one."""
    tape: MotorTape = [[]]
    kept = {name: getattr(bullet, name) for name in (*_CHANGES, "stepSimulation")}

    def noting(name: str) -> Callable[..., Any]:
        def call(*arguments: Any, **named: Any) -> Any:
            tape[-1].append((name, arguments, named))
            return kept[name](*arguments, **named)

        return call

    def step(**named: Any) -> None:
        tape.append([])
        kept["stepSimulation"](**named)

    for name in _CHANGES:
        setattr(bullet, name, noting(name))
    bullet.stepSimulation = step
    try:
        yield tape
    finally:
        for name, function in kept.items():
            setattr(bullet, name, function)


def replay_motor_commands(tape: MotorTape, plant: PhysicsPlant) -> float:
    """Set the same motors in the world of `plant`, which nothing else uses; return processor seconds."""
    client = physics_client(plant)
    ready = [
        [
            (getattr(bullet, name), arguments, {**named, "physicsClientId": client})
            for name, arguments, named in calls
        ]
        for calls in tape
    ]
    step = bullet.stepSimulation
    last = ready.pop()
    began = time.process_time()
    for calls in ready:
        for function, arguments, named in calls:
            function(*arguments, **named)
        step(physicsClientId=client)
    took = time.process_time() - began
    for function, arguments, named in last:
        function(*arguments, **named)
    return took


def body_states(plant: PhysicsPlant) -> list[Any]:
    """Return where everything is in the world of `plant`, to the last bit."""
    client = physics_client(plant)
    found: list[Any] = []
    for body in range(bullet.getNumBodies(physicsClientId=client)):
        found.append(bullet.getBasePositionAndOrientation(body, physicsClientId=client))
        joints = range(bullet.getNumJoints(body, physicsClientId=client))
        found.append([bullet.getJointState(body, joint, physicsClientId=client)[:2] for joint in joints])
    return found


def physics_client(plant: PhysicsPlant) -> int:
    """Return PyBullet's number of the world of `plant`."""
    world = plant._world
    assert isinstance(world, PhysicsWorld)  # noqa: S101  for the type checker
    return world.client
