"""Any scene without physics: what its file declares of bodies that can be held, surfaces and coatings.

Not modelled: links and joints, but for what a press folds; forces, but for those of a press; compounds and
models as obstacles.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from aeros.sim.geometry import Pose, Vector3, add, to_world, yaw_of
from aeros.sim.kinematic.objects import CylindricalObject, GraspableObject, ObjectSet, Surface, slab
from aeros.sim.kinematic.scenes.overlaps import check_overlaps
from aeros.sim.kinematic.scenes.press import FoldingPress, Handle
from aeros.sim.layouts.camera_checks import SeeingCamera
from aeros.sim.layouts.cameras import camera_in_world
from aeros.sim.layouts.coating import CoatingMap
from aeros.sim.layouts.conditions import SceneState
from aeros.sim.layouts.placement import place_things
from aeros.sim.layouts.survey import NO_SURVEY_ERRORS, Survey, markers_of
from aeros.sim.pictures.late_picture import LatePicture
from aeros.sim.pictures.scene_solids import SceneSolids, carriage_solid, decals_of, robot_solids
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot import RobotOptions, RobotState
from aeros.sim.robot.robot_file import reference_robot
from aeros.sim.scanners.sections import Section, cut
from aeros.spec.model.scene import (
    Basin,
    BodyPart,
    Box,
    Compound,
    Cylinder,
    PositionInstrument,
    Scene,
    SceneBody,
    Shape,
    Sphere,
    UrdfModel,
)
from aeros.spec.model.sensor_errors import SurveyErrors
from aeros.spec.scenes.load import require_robot


class DeclaredScene:
    """A scene by geometry alone. It implements `KinematicScene`, and `SimulatedWorld` for its conditions.

    Args:
        scene: the scene.
        survey: errors of surveyed places.
        robot: the robot; None for that of the reference site.

    Raises:
        UserError: it has no robot or no view.
    """

    def __init__(
        self, scene: Scene, survey: SurveyErrors = NO_SURVEY_ERRORS, robot: RobotModel | None = None
    ) -> None:
        require_robot(scene)
        assert scene.robot is not None  # noqa: S101  for the type checker
        self.scene = scene
        self._measured = tuple(scene.measured())
        self._survey_errors = survey
        self._ticks = 0
        mount, model = scene.robot, robot or reference_robot()
        self.robot = RobotOptions(model, carriage=mount.carriage, base=mount.base)
        self.cameras: tuple[str, ...] = tuple(scene.cameras)
        self.initial_cameras: tuple[str, ...] = tuple(
            name for name, camera in scene.cameras.items() if camera.at_start
        )

    def build(self, chance: RandomSource) -> ObjectSet:
        """Implement `KinematicScene.build`: everything where it was drawn, on the surface under it."""
        bodies = self.scene.bodies
        self._poses = place_things(self.scene, chance)
        check_overlaps(self.scene, self._poses)
        self._objects = {
            name: _object(body, self._poses[name]) for name, body in bodies.items() if body.grip is not None
        }
        self.presses: dict[str, FoldingPress] = {}
        lids: dict[BodyPart, Handle] = {}
        for name, press in self.scene.presses.items():
            axis, height = self._poses[press.lid.body].position, _height(bodies[press.filling].shape)
            self.presses[name] = FoldingPress(press, axis, height, lids.get(press.lid))
            lids[press.lid] = self.presses[name].handle
        surfaces = [
            surface
            for name, body in bodies.items()
            if not body.is_movable
            for surface in _surfaces(body.shape, self._poses[name])
        ]
        self._things = ObjectSet((*self._objects.values(), *lids.values()), surfaces)
        self._coatings = {name: CoatingMap(coating) for name, coating in self.scene.coatings.items()}
        self._robot_points = (self.robot.base, self.robot.base)
        self.state = SceneState(self.scene, self._poses, self)
        self._survey = Survey(markers_of(self.scene, self._poses), self._survey_errors, chance)
        self._solids = SceneSolids(self.scene)
        self._cut: tuple[object, tuple[Section, ...]] | None = None
        return self._things

    def place_robot(self, state: RobotState) -> None:
        """Implement `KinematicScene.place_robot`."""
        self._robot_points = (state.base_position, state.tool_position)

    def tick(self, state: RobotState) -> None:
        """Implement `KinematicScene.tick`: wipe, fold, and judge seals and timers."""
        self.place_robot(state)
        self._ticks += 1
        for coating in self._coatings.values():
            wiper = self._objects.get(coating.coating.wiped_by)
            if wiper is not None and self._things.holds(wiper) and self._things.load > coating.coating.force:
                coating.wipe(wiper.pose)
        for press in self.presses.values():
            press.tick(
                self.pose_of(BodyPart(press.press.folds.body)),
                is_held=self.is_carried(press.press.folds.body),
                is_filled=self._is_filled(press),
                is_sealed=self.state.sealed[press.press.seal],
            )
        self.state.tick()

    def measure(self) -> Mapping[str, Any]:
        """Implement `KinematicScene.measure`: surveyed places and instruments."""
        cameras = [
            SeeingCamera(name, placed, placed, one.frame == "cell")
            for name, one in self.scene.cameras.items()
            if one.frame != "hand"
            for placed in (camera_in_world(one, *self._robot_points, 0.0),)
        ]
        surveyed = self._survey.measure(self._ticks, cameras, lambda eye, marker: False)
        return {
            variable: surveyed[name] if name in surveyed else self._instrument(name, surveyed)
            for variable, name in self._measured
        }

    def _instrument(self, name: str, surveyed: Mapping[str, Vector3]) -> Any:
        """Return what an instrument measures; a position from where its fixture is taken to be."""
        value, instrument = self.state.value(name), self.scene.instruments[name]
        if isinstance(instrument, PositionInstrument):
            fixture = self._poses[instrument.of.body].position
            return add(value, self._survey.offset_near(fixture, surveyed))
        return value

    def truth(self) -> Mapping[str, int]:
        """Implement `KinematicScene.truth`."""
        return self.state.truth()

    def sections(self, height: float) -> Sequence[Section]:
        """Implement `KinematicScene.sections`."""
        poses = {
            name: pose
            for name, reach in self._solids.reach.items()
            if abs((pose := self.pose_of(BodyPart(name))).position[2] - height) < reach
        }
        if self._cut is None or self._cut[0] != (height, poses):
            cuts = (cut(one, height) for one in self._solids.placed(self, poses))
            self._cut = ((height, poses), tuple(one for one in cuts if one is not None))
        return self._cut[1]

    def see(self, camera: str, state: RobotState, yaw: float, time: float) -> LatePicture:
        """Implement `KinematicScene.see`: bodies, coatings and the robot.

        Raises:
            KeyError: there is no such camera.
        """
        view = camera_in_world(self.scene.cameras[camera], state.base_position, state.tool_position, yaw)
        solids = [*self._solids.placed(self), *robot_solids(self.robot.model, state.q, state.base_position)]
        if self.robot.carriage:
            solids.append(carriage_solid(state.base_position))
        return LatePicture(camera, time, view, solids, decals_of(self._coatings))

    def is_carried(self, body: str) -> bool:
        """Say if a body moves with the hand, lifted or not.

        Args:
            body: its name.

        Returns:
            True if it does.
        """
        thing = self._objects.get(body)
        return thing is not None and self._things.holds(thing)

    # Implement `SimulatedWorld`.

    def pose_of(self, part: BodyPart) -> Pose:
        """Implement `SimulatedWorld.pose_of`: a link moves with its body, but for the handle of a press."""
        for press in self.presses.values():
            if part == press.press.handle:
                return press.handle.pose
        thing = self._objects.get(part.body)
        return self._poses[part.body] if thing is None else thing.pose

    def joint_position(self, joint: BodyPart) -> float:
        """Implement `SimulatedWorld.joint_position`: 0 but for the joints of a press."""
        for press in self.presses.values():
            if joint == press.press.folds:
                return press.fold
            if joint == press.press.lid:
                return press.handle.angle
        return 0.0

    def force_between(self, first: BodyPart, second: BodyPart) -> float:
        """Implement `SimulatedWorld.force_between`: 0 but between the two sides of a press."""
        for press in self.presses.values():
            if {first.body, second.body} == {press.press.filling, press.press.folds.body}:
                return press.force_on_filling(is_filled=self._is_filled(press))
        return 0.0

    def load_on(self, part: BodyPart) -> float:
        """Implement `SimulatedWorld.load_on`: 0 but on the bed of a press; things have no weight here."""
        return sum(press.load() for press in self.presses.values() if part == BodyPart(press.press.lid.body))

    def is_held(self, body: str) -> bool:
        """Implement `SimulatedWorld.is_held`."""
        return self.is_carried(body) and self._things.is_lifted(self._objects[body])

    def coating_of(self, name: str) -> CoatingMap:
        """Implement `SimulatedWorld.coating_of`."""
        return self._coatings[name]

    def robot_points(self) -> tuple[Vector3, Vector3]:
        """Implement `SimulatedWorld.robot_points`."""
        return self._robot_points

    def seal(self, joint: BodyPart, friction: float) -> None:
        """Implement `SimulatedWorld.seal`: presses read the seal itself."""

    def _is_filled(self, press: FoldingPress) -> bool:
        filled: bool = self.state.value(f"{press.press.filling}.position in {press.press.inside}")
        return filled


def _object(body: SceneBody, pose: Pose) -> GraspableObject:
    """Return a body that can be held."""
    assert body.grip is not None  # noqa: S101  for the type checker
    shape, surface = body.shape, None
    is_round = isinstance(shape, Cylinder | Sphere)
    if isinstance(shape, UrdfModel) and shape.surfaces:
        (x, y, z), size = shape.surfaces[0]
        surface = slab(x, y, z, *size)
    kind = CylindricalObject if is_round else GraspableObject
    return kind(pose, body.grip.low, body.grip.high, _underside(shape), surface)


def _underside(shape: Shape) -> float:
    """Return the depth of a shape's lowest point below its frame, m."""
    match shape:
        case UrdfModel():
            return shape.underside
        case Compound(parts):
            return max(_height(part.shape) / 2 - part.position[2] for part in parts)
        case Basin():
            return 0.0
    return _height(shape) / 2


def _height(shape: Shape) -> float:
    """Return the height of a shape, m; 0 for a model, whose height is not known."""
    match shape:
        case Box((_, _, height)) | Cylinder(_, height) | Basin((_, _, height)):
            return height
        case Sphere(radius):
            return 2.0 * radius
        case Compound(parts):
            ends = [(part.position[2], _height(part.shape) / 2) for part in parts]
            return max(z + half for z, half in ends) - min(z - half for z, half in ends)
    return 0.0


def _surfaces(shape: Shape, pose: Pose) -> Iterator[Surface]:
    """Yield the surfaces on which things can lie on a fixed body, in W."""
    yaw = yaw_of(pose.orientation)
    for middle, (length, width) in _own_surfaces(shape):
        yield slab(*to_world(pose, middle), length, width, yaw)


def _own_surfaces(shape: Shape) -> Iterator[tuple[Vector3, tuple[float, float]]]:
    match shape:
        case Box((length, width, height)):
            yield (0.0, 0.0, height / 2), (length, width)
        case Cylinder(radius, height):
            yield (0.0, 0.0, height / 2), (2.0 * radius, 2.0 * radius)
        case Basin((length, width, _)):
            yield (0.0, 0.0, 0.0), (length, width)
        case Compound(parts):
            for part in parts:
                x, y, z = part.position
                for (a, b, c), size in _own_surfaces(part.shape):
                    yield (x + a, y + b, z + c), size
        case UrdfModel():
            yield from shape.surfaces
