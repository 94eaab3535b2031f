"""Run a task in a cell that is not as the robot takes it to be.

`python -m benchmarks.starts TASK --deviation NAME` counts how often a goal is reached so, on physics.  The
robot's own numbers (cameras, survey, sizes) stay those of the scene's file.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import replace
from math import cos, radians, sin
from typing import Any, Final, NamedTuple

import numpy as np

from aeros.cli.main import main as run_aeros
from aeros.sim import physics
from aeros.sim.bullet import body_factory
from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.engine import BulletEngine
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.engine.engine import Engine
from aeros.sim.engine.robot import PhysicalRobot
from aeros.sim.engine.world import Image
from aeros.sim.geometry import Camera, Pose, Vector3, add, camera_axes
from aeros.sim.layouts.coating import CoatingMap
from aeros.sim.layouts.survey import NO_SURVEY_ERRORS
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.model import RobotModel
from aeros.sim.scenes.physics_scene import PhysicsScene
from aeros.sim.sensor_model import SensorModel
from aeros.spec.model.scene import (
    Basin,
    Box,
    Coating,
    Compound,
    Cylinder,
    Placement,
    Scene,
    SceneBody,
    Shape,
    Sphere,
    UrdfModel,
)
from aeros.spec.model.sensor_errors import SurveyErrors


class Deviation(NamedTuple):
    """Differences of the true cell from what the robot takes it to be.

    Attributes:
        turn: of every camera about the directions right, up and ahead in its picture, degrees.
        shift: distance of every camera from its place, in a direction drawn by the seed, m.
        lift: height of tables, stands and all that is on them above their own, m.
        scale: size of loose things over their own.
        light: brightness over that of white light.
        colour_noise: standard deviation of the noise of each colour of a pixel, of 255; None as the site has
        it.
        after: time from which cameras are turned and moved, s; before it they are where they should be.
    """

    turn: Vector3 = (0.0, 0.0, 0.0)
    shift: float = 0.0
    lift: float = 0.0
    scale: float = 1.0
    light: float = 1.0
    colour_noise: float | None = None
    after: float = 0.0


DEVIATIONS: Final[Mapping[str, Deviation]] = {
    "none": Deviation(),
    "camera-tilted": Deviation(turn=(1.0, 0.0, 0.0)),
    "camera-panned": Deviation(turn=(0.0, 1.0, 0.0)),
    "camera-rolled": Deviation(turn=(0.0, 0.0, 1.0)),
    "camera-moved": Deviation(shift=0.01),
    "camera-knocked": Deviation(turn=(1.0, 1.0, 2.0), shift=0.015),
    "camera-knocked-in-mid-task": Deviation(turn=(1.0, 1.0, 2.0), shift=0.015, after=14.0),
    "table-higher": Deviation(lift=0.02),
    "table-lower": Deviation(lift=-0.02),
    "things-smaller": Deviation(scale=0.85),
    "things-larger": Deviation(scale=1.2),
    "noisy-pictures": Deviation(colour_noise=10.0),
    "bright-light": Deviation(light=1.3),
    "dim-light": Deviation(light=0.7),
    "all-at-once": Deviation((1.0, -1.0, 1.0), 0.005, 0.02, 0.85, colour_noise=10.0),
    "all-at-once-larger": Deviation((-1.0, 1.0, -1.0), 0.005, -0.02, 1.2, colour_noise=10.0),
}
"""By name: one deviation each, but for the last two."""

_GROUND: Final = "floor"
"""Body that is no table; a scene that is combined has it under a name that ends so."""


class DeviatingScene(PhysicsScene):
    """A scene whose true cell deviates from its file.

    Args:
        scene: the scene as the robot takes it to be.
        survey: errors of surveyed places.
        robot: the robot; None for that of the reference site.
        deviation: how the true cell differs.
        seed: of the direction in which cameras are moved.
    """

    def __init__(
        self,
        scene: Scene,
        survey: SurveyErrors,
        robot: RobotModel | None,
        deviation: Deviation,
        seed: int,
    ) -> None:
        super().__init__(_deviate(scene, deviation), survey, robot)
        self._deviation = deviation
        way = RandomSource(seed).generator("deviation").standard_normal(3)
        x, y, z = (deviation.shift * way / np.linalg.norm(way)).tolist()
        self._shift: Vector3 = (x, y, z)
        self._timed: PhysicsWorld | None = None

    def build(self, engine: Engine, robot: PhysicalRobot, chance: RandomSource) -> None:
        """Implement `PhysicalScene.build`."""
        assert isinstance(engine, BulletEngine)  # noqa: S101  for the type checker
        world = self._timed = engine.world
        load, scale = body_factory.load_model, self._deviation.scale
        try:
            body_factory.load_model = lambda *given, **named: _load_scaled(scale, *given, **named)
            super().build(engine, robot, chance)
        finally:
            body_factory.load_model = load
        self._coatings = {
            name: _LiftedCoating(coating, self._deviation.lift)
            for name, coating in self.scene.coatings.items()
        }
        for number in self._pictures.values():
            lifted = (0.0, 0.0, self._deviation.lift)
            bullet.resetBasePositionAndOrientation(number, lifted, (0, 0, 0, 1), physicsClientId=world.client)
        render, light = world.renderer.render, self._deviation.light

        def render_in_light(camera: Camera) -> Image:
            image = render(camera)
            return image._replace(rgb=np.clip(image.rgb * light, 0, 255).astype(np.uint8))

        if light != 1.0:
            world.renderer.render = render_in_light  # type: ignore[method-assign]

    def camera(self, name: str) -> Camera:
        """Implement `PhysicalScene.camera`: turned and moved."""
        camera = super().camera(name)
        if self._timed is not None and self._timed.time < self._deviation.after:
            return camera
        right, up, ahead = (np.array(axis) for axis in camera_axes(camera))
        for axis, angle in zip((right, up, ahead), self._deviation.turn, strict=True):
            up, ahead = (_turned(way, axis, radians(angle)) for way in (up, ahead))
        x, y, z = ahead.tolist()
        u, v, w = up.tolist()
        eye = add(camera.eye, self._shift)
        return replace(camera, eye=eye, target=add(eye, (x, y, z)), up=(u, v, w))

    def measure(self) -> Mapping[str, Any]:
        """Implement `PhysicalScene.measure`: heights are those of the setup, when no table was lifted."""
        lift = (0.0, 0.0, -self._deviation.lift)
        return {
            name: add(value, lift) if isinstance(value, tuple) else value
            for name, value in super().measure().items()
        }


class _LiftedCoating(CoatingMap):
    """A coating of a table that is higher than it should be."""

    def __init__(self, coating: Coating, lift: float) -> None:
        super().__init__(coating)
        self._lift = lift

    def wipe(self, pose: Pose) -> None:
        """Wipe as `CoatingMap.wipe`."""
        super().wipe(Pose(add(pose.position, (0.0, 0.0, -self._lift)), pose.orientation))


def _turned(way: Any, axis: Any, angle: float) -> Any:
    """Turn a direction about a unit axis: Rodrigues' formula."""
    along = axis * (axis @ way)
    return along + (way - along) * cos(angle) + np.cross(axis, way) * sin(angle)


def _load_scaled(scale: float, path: str, position: Vector3, orientation: Any, **named: Any) -> int:
    if named["fixed"]:
        scale = 1.0
    body: int = bullet.loadURDF(
        path,
        position,
        orientation,
        useFixedBase=named["fixed"],
        globalScaling=scale,
        physicsClientId=named["client"],
    )
    return body


def _deviate(scene: Scene, deviation: Deviation) -> Scene:
    lift, scale = deviation.lift, deviation.scale
    places = {name: _lifted(one, lift) for name, one in scene.places.items()}
    placed = {
        # What stands on the floor would be in a floor that is not lowered, too.
        name: body
        if name.endswith(_GROUND) and lift > 0.0
        else replace(body, placement=_lifted(body.placement, lift))
        for name, body in scene.bodies.items()
    }
    coatings = {
        name: one._replace(face=(one.face[0] * scale, one.face[1] * scale, one.face[2] * scale))
        for name, one in scene.coatings.items()
    }
    sized = {name: _scaled(body, scale) if body.is_movable else body for name, body in placed.items()}
    return replace(scene, places=places, bodies=sized, coatings=coatings)


def _lifted(placement: Placement, lift: float) -> Placement:
    """Lift what is placed in W; all else is lifted with its frame."""
    if placement.frame is not None:
        return placement
    return placement._replace(position=add(placement.position, (0.0, 0.0, lift)))


def _scaled(body: SceneBody, scale: float) -> SceneBody:
    """Scale a thing about the middle of its underside."""
    up = (0.0, 0.0, (scale - 1.0) * _underside(body.shape))
    x, y, z = (part * scale for part in body.placement.anchor)
    alternative = body.placement.alternative
    placement = body.placement._replace(
        position=add(body.placement.position, up),
        anchor=(x, y, z),
        alternative=alternative and alternative._replace(position=add(alternative.position, up)),
    )
    return replace(body, shape=_scaled_shape(body.shape, scale), placement=placement)


def _underside(shape: Shape) -> float:
    match shape:
        case Box(edges):
            return edges[2] / 2.0
        case Cylinder(_, height):
            return height / 2.0
        case Sphere(radius):
            return radius
        case UrdfModel(underside=depth):
            return depth
    return 0.0


def _scaled_shape(shape: Shape, scale: float) -> Shape:
    match shape:
        case Box((x, y, z)):
            return Box((x * scale, y * scale, z * scale))
        case Cylinder(radius, height):
            return Cylinder(radius * scale, height * scale)
        case Sphere(radius):
            return Sphere(radius * scale)
        case Basin() | Compound() | UrdfModel():
            return shape


def main() -> None:
    """Run `aeros` with a physics plant whose cell deviates."""
    name, *given = sys.argv[1:]
    deviation = DEVIATIONS[name]

    def make_plant(
        scene: Scene,
        seed: int,
        survey: SurveyErrors = NO_SURVEY_ERRORS,
        robot: RobotModel | None = None,
        **options: Any,
    ) -> physics.PhysicsPlant:
        models: dict[str, SensorModel] = dict(options.pop("sensors", None) or {})
        if deviation.colour_noise is not None:
            for camera in scene.cameras:
                noisy = models.get(camera, SensorModel())
                models[camera] = replace(noisy, colour_noise=deviation.colour_noise)
        deviating = DeviatingScene(scene, survey, robot, deviation, seed)
        return physics.PhysicsPlant(deviating, seed, sensors=models, **options)

    physics.make_plant = make_plant
    sys.argv = ["aeros", *given]
    raise SystemExit(run_aeros())
