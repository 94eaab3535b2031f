"""Conditions of a scene on what is true in a simulator: seals, timers and the truth of goals.

The values come from the simulated bodies, never from readings, so nothing that acts may see them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import partial
from math import acos
from typing import Any, Final, Protocol

from aeros.sim.clock import TICK
from aeros.sim.geometry import UPRIGHT, Pose, Vector3, to_frame, to_world, yaw_of
from aeros.sim.layouts.coating import CoatingMap
from aeros.spec.backends.compiled import Predicate, compile_condition
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, scalar_variables
from aeros.spec.expr.semantics import evaluate
from aeros.spec.expr.terms import variables_of
from aeros.spec.expr.types import RealType
from aeros.spec.model.scene import (
    Basin,
    BodyPart,
    ForceInstrument,
    JointInstrument,
    LoadInstrument,
    PositionInstrument,
    Region,
    Scene,
    SceneCondition,
    UrdfModel,
)
from aeros.spec.scenes.conditions import is_membership, membership

_LIMIT: Final = Fraction(10) ** 6
"""Greatest absolute value in a condition, SI: the bound from which errors of rounding are derived."""

_W: Final = Pose((0.0, 0.0, 0.0), UPRIGHT)


class SimulatedWorld(Protocol):
    """A simulator's true state, by the names of a scene. SI, in W."""

    def pose_of(self, part: BodyPart) -> Pose:
        """Read the pose of a body's or link's frame.

        Args:
            part: the body or link.

        Returns:
            The pose.
        """

    def joint_position(self, joint: BodyPart) -> float:
        """Read the position of a joint.

        Args:
            joint: the joint.

        Returns:
            The position, rad or m.
        """

    def force_between(self, first: BodyPart, second: BodyPart) -> float:
        """Sum the normal forces between two bodies or links.

        Args:
            first: one of them.
            second: the other.

        Returns:
            The force, N.
        """

    def load_on(self, part: BodyPart) -> float:
        """Sum the downward parts of the normal forces of all that touches a body or link.

        Args:
            part: the body or link.

        Returns:
            The force, N; 0 if all together pull up.
        """

    def is_held(self, body: str) -> bool:
        """Say if the hand carries a body.

        Args:
            body: its name.

        Returns:
            True if both fingers touch it and nothing else does.
        """

    def coating_of(self, name: str) -> CoatingMap:
        """Find a coating.

        Args:
            name: its name.

        Returns:
            Its cells as they are now.
        """

    def robot_points(self) -> tuple[Vector3, Vector3]:
        """Locate the robot.

        Returns:
            Positions of the arm's base and of the tool point.
        """

    def seal(self, joint: BodyPart, friction: float) -> None:
        """Make a joint stiff.

        Args:
            joint: the joint.
            friction: its dry friction from now on, N·m or N.
        """


class SceneState:
    """Seals and timers of a scene, and the values of its conditions.

    Args:
        scene: the scene.
        poses: start poses by name, which are those of places for good.
        world: the simulator's true state.
    """

    def __init__(self, scene: Scene, poses: Mapping[str, Pose], world: SimulatedWorld) -> None:
        self._scene = scene
        self._poses = poses
        self._world = world
        self._readers: dict[str, Callable[[], Any]] = _readers(scene, poses, world)
        self._regions: dict[str, Region] = {
            name: Region(name, (-x / 2, -y / 2, 0.0), (x / 2, y / 2, z))
            for name, body in scene.bodies.items()
            if isinstance(body.shape, Basin)
            for x, y, z in (body.shape.inner,)
        } | dict(scene.regions)
        named = {**scene.conditions, **scene.truth}
        self._predicates = {name: _compiled(one) for name, one in named.items() if not one.is_number}
        self._numbers = {name: lower(one.term) for name, one in named.items() if one.is_number}
        self._seals = {name: _compiled(seal.when) for name, seal in scene.seals.items()}
        self._timers = {name: _compiled(condition) for name, condition in scene.timers.items()}
        # Ticks until now, and at the longest stretch so far.
        self._ticks = dict.fromkeys(scene.timers, (0, 0))
        self.sealed: dict[str, bool] = dict.fromkeys(scene.seals, False)
        """True for each seal that has closed, by name."""

    def tick(self) -> None:
        """Judge seals and timers after a tick of the simulator."""
        if not self._seals and not self._timers:
            return
        values = _Values(self)
        for name, holds in self._seals.items():
            if not self.sealed[name] and holds(values):
                self.sealed[name] = True
                self._world.seal(self._scene.seals[name].joint, self._scene.seals[name].friction)
                values = _Values(self)
        for name, holds in self._timers.items():
            now, longest = self._ticks[name]
            now = now + 1 if holds(values) else 0
            self._ticks[name] = (now, max(now, longest))

    def truth(self) -> dict[str, int]:
        """Judge the conditions of `truth` now.

        Returns:
            The truth of each state variable that the scene defines; the number, if it is a whole number.
        """
        values = _Values(self)
        return {name: values[name] for name in self._scene.truth}

    def value(self, name: str) -> Any:
        """Read a variable of the scene's conditions now.

        Args:
            name: as `can.position`, or the name of a condition.

        Returns:
            Its value, SI, in W.
        """
        return self.compute(name, _Values(self))

    def compute(self, name: str, values: Mapping[str, Any]) -> Any:
        """Compute a variable.

        Args:
            name: its name.
            values: values of conditions at the same moment.

        Returns:
            Its value, SI, in W.
        """
        reader = self._readers.get(name)
        if reader is not None:
            return reader()
        if is_membership(name):
            point, region = membership(name)
            return self._contains(self._regions[region], self.compute(point, values))
        if name in self._predicates:
            return bool(self._predicates[name](values))
        if name in self._numbers:
            return self._count(self._numbers[name], values)
        if name in self.sealed:
            return self.sealed[name]
        thing, _, part = name.partition(".")
        if thing in self._scene.coatings:
            within = partial(self._contains, self._regions[part.rpartition(".")[0]])
            return self._world.coating_of(thing).wiped_share_where(within)
        timer, _, longest = name.partition(".")
        return self._ticks[timer][bool(longest)] * TICK

    def _count(self, term: t.Term, values: Mapping[str, Any]) -> int:
        read = {name: values[name] for name in t.variables_of(term)}
        exact = {name: Fraction(one) if isinstance(one, float) else one for name, one in read.items()}
        number = evaluate(term, exact)
        assert isinstance(number, Fraction)  # noqa: S101  the type of such a truth
        return round(number)

    def _contains(self, region: Region, point: Vector3) -> bool:
        frame = _W
        if region.of is not None:
            is_body = region.of in self._scene.bodies
            frame = self._world.pose_of(BodyPart(region.of)) if is_body else self._poses[region.of]
        inside = to_frame(frame, point)
        return all(low <= at <= high for low, at, high in zip(region.low, inside, region.high, strict=True))


class _Values(dict[str, Any]):
    """Values of scalar variables at one moment, each computed when it is first asked for."""

    def __init__(self, state: SceneState) -> None:
        super().__init__()
        self._state = state

    def __missing__(self, name: str) -> Any:
        vector, _, axis = name.rpartition(".")
        if vector and axis in ("x", "y", "z"):
            for part, value in zip("xyz", self._state.compute(vector, self), strict=True):
                self[f"{vector}.{part}"] = value
            return self[name]
        value = self[name] = self._state.compute(name, self)
        return value


def _compiled(condition: SceneCondition) -> Predicate:
    ranges = {
        scalar.name: (-_LIMIT, _LIMIT)
        for variable in variables_of(condition.term).values()
        for scalar in scalar_variables(variable)
        if isinstance(scalar.type, RealType)
    }
    return compile_condition(condition.term, ranges)


def _readers(scene: Scene, poses: Mapping[str, Pose], world: SimulatedWorld) -> dict[str, Callable[[], Any]]:
    """Return a function that reads each variable of bodies, places and instruments."""
    found: dict[str, Callable[[], Any]] = {
        "robot.base": lambda: world.robot_points()[0],
        "robot.tool": lambda: world.robot_points()[1],
    }
    for name in scene.places:
        found[name] = partial(_place, poses[name])
    for name, body in scene.bodies.items():
        found |= _body_readers(BodyPart(name), world)
        if isinstance(body.shape, UrdfModel):
            for link in body.shape.links:
                part = BodyPart(name, link)
                found[f"{name}.{link}.position"] = partial(_position, world, part)
            for joint in body.shape.joints:
                part = BodyPart(name, joint)
                found[f"{name}.{joint}"] = partial(world.joint_position, part)
    for name, instrument in scene.instruments.items():
        match instrument:
            case ForceInstrument(first, second):
                found[name] = partial(world.force_between, first, second)
            case LoadInstrument(of):
                found[name] = partial(world.load_on, of)
            case PositionInstrument(of):
                found[name] = partial(_position, world, of)
            case JointInstrument(part):
                found[name] = partial(world.joint_position, part)
    for name in scene.coatings:
        found[f"{name}.wiped"] = partial(_wiped_share, world, name)
    return found


def _body_readers(part: BodyPart, world: SimulatedWorld) -> dict[str, Callable[[], Any]]:
    return {
        f"{part.body}.position": partial(_position, world, part),
        f"{part.body}.yaw": lambda: yaw_of(world.pose_of(part).orientation),
        f"{part.body}.tilt": lambda: _tilt(world.pose_of(part)),
        f"{part.body}.held": lambda: world.is_held(part.body),
    }


def _wiped_share(world: SimulatedWorld, coating: str) -> float:
    return world.coating_of(coating).wiped_share


def _place(pose: Pose) -> Vector3:
    return pose.position


def _position(world: SimulatedWorld, part: BodyPart) -> Vector3:
    return world.pose_of(part).position


def _tilt(pose: Pose) -> float:
    """Return the angle between a body's z axis and the vertical, rad."""
    top = to_world(Pose((0.0, 0.0, 0.0), pose.orientation), (0.0, 0.0, 1.0))
    return acos(min(1.0, max(-1.0, top[2])))
