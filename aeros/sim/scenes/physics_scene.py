"""Any scene with physics: bodies, coatings, seals and instruments as its file declares them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from aeros.sim.engine.engine import Engine, PlacedBody
from aeros.sim.engine.overlaps import check_overlaps
from aeros.sim.engine.robot import PhysicalRobot
from aeros.sim.geometry import Camera, Pose, Vector3, add
from aeros.sim.layouts.camera_checks import Carriage, SeeingCamera
from aeros.sim.layouts.cameras import camera_in_world, fixed_camera
from aeros.sim.layouts.coating import CoatingMap
from aeros.sim.layouts.conditions import SceneState
from aeros.sim.layouts.placement import place_things
from aeros.sim.layouts.survey import NO_SURVEY_ERRORS, Marker, Survey, markers_of
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot import RobotOptions
from aeros.sim.robot.robot_file import reference_robot
from aeros.spec.model.scene import BodyPart, PositionInstrument, Scene
from aeros.spec.model.sensor_errors import SurveyErrors
from aeros.spec.scenes.load import require_robot

_MARKER_DEPTH: Final = 0.05
"""Greatest depth of a place below the surface that carries its marker, m."""

_COATED_SURFACE: Final = 0.0
"""Height of the surfaces that coatings cover, in W, m."""


class PhysicsScene:
    """A scene with physics. It implements `PhysicalScene`, and `SimulatedWorld` for its conditions.

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
        assert scene.view is not None  # noqa: S101  for the type checker
        self.scene = scene
        self._measured = tuple(scene.measured())
        self._survey_errors = survey
        mount, model = scene.robot, robot or reference_robot()
        self.robot = RobotOptions(model, carriage=mount.carriage, base=mount.base)
        self.view = fixed_camera(scene.view)
        self.pushable_objects = scene.movable
        self.cameras: tuple[str, ...] = tuple(scene.cameras)
        self.initial_cameras: tuple[str, ...] = tuple(
            name for name, camera in scene.cameras.items() if camera.at_start
        )

    def build(self, engine: Engine, robot: PhysicalRobot, chance: RandomSource) -> None:
        """Implement `PhysicalScene.build`: every body where it was drawn, every coating unwiped."""
        self._engine = engine
        self._world = world = engine.world
        self._robot = robot
        self._poses = place_things(self.scene, chance)
        self._bodies: dict[str, PlacedBody] = {}
        for name, body in self.scene.bodies.items():
            self._bodies[name] = engine.add_body(body, self._poses[name])
        check_overlaps(
            world, {placed.number: placed.body for placed in self._bodies.values()}, {robot.body: "the robot"}
        )
        self._coatings = {name: CoatingMap(coating) for name, coating in self.scene.coatings.items()}
        self._pictures = {
            name: engine.add_painted_rectangle(coating.low, coating.high, _COATED_SURFACE)
            for name, coating in self.scene.coatings.items()
        }
        for name in self._coatings:
            self._paint(name)
        self.state = SceneState(self.scene, self._poses, self)
        self._survey = Survey(markers_of(self.scene, self._poses), self._survey_errors, chance)

    def tick(self) -> None:
        """Implement `PhysicalScene.tick`: wipe what is pressed on, and judge seals and timers."""
        for name, coating in self._coatings.items():
            self._wipe(name, coating)
        self.state.tick()

    def measure(self) -> Mapping[str, Any]:
        """Implement `PhysicalScene.measure`: surveyed places and instruments."""
        cameras = [
            SeeingCamera(
                name,
                self.camera(name),
                self.believed_camera(name),
                self.scene.cameras[name].frame == "cell" or not self._robot.has_carriage,
            )
            for name in self.cameras
        ]
        carriage = None
        if self._robot.has_carriage:
            base, drift = self._robot.true_points()[0], self._robot.odometry.drift
            carriage = Carriage(base, add(base, (*drift, 0.0)))
        surveyed = self._survey.measure(self._world.ticks, cameras, self._is_hidden, carriage)
        return {
            variable: surveyed[name] if name in surveyed else self._instrument(name, surveyed)
            for variable, name in self._measured
        }

    def _is_hidden(self, eye: Vector3, marker: Marker) -> bool:
        met = self._world.first_on_way(eye, marker.position)
        if met is None:
            return False
        body, left = met
        if marker.fixture is not None:
            return body != self._bodies[marker.fixture].number
        return left > _MARKER_DEPTH

    def _instrument(self, name: str, surveyed: Mapping[str, Vector3]) -> Any:
        """Return what an instrument measures; a position from where its fixture is taken to be."""
        value, instrument = self.state.value(name), self.scene.instruments[name]
        if isinstance(instrument, PositionInstrument):
            fixture = self._poses[instrument.of.body].position
            return add(value, self._survey.offset_near(fixture, surveyed))
        return value

    def body(self, name: str) -> int:
        """Implement `PhysicalScene.body`, for every body of the scene.

        Raises:
            KeyError: there is no such body.
        """
        return self._bodies[name].number

    def placed_bodies(self) -> Mapping[str, PlacedBody]:
        """Implement `PhysicalScene.placed_bodies`."""
        return self._bodies

    def coatings(self) -> Mapping[str, CoatingMap]:
        """Implement `PhysicalScene.coatings`."""
        return self._coatings

    def camera(self, name: str) -> Camera:
        """Implement `PhysicalScene.camera`.

        Raises:
            KeyError: there is no such camera.
        """
        base, tool = self._robot.true_points()
        return camera_in_world(self.scene.cameras[name], base, tool, self._robot.tool_command()[1])

    def believed_camera(self, name: str) -> Camera:
        """Implement `PhysicalScene.believed_camera`.

        Raises:
            KeyError: there is no such camera.
        """
        declared, (base, tool) = self.scene.cameras[name], self._robot.true_points()
        if declared.frame != "cell":
            drift = (*self._robot.odometry.drift, 0.0)
            base, tool = add(base, drift), add(tool, drift)
        return camera_in_world(declared, base, tool, self._robot.tool_command()[1])

    def truth(self) -> Mapping[str, int]:
        """Implement `PhysicalScene.truth`."""
        return self.state.truth()

    # Implement `SimulatedWorld`.

    def pose_of(self, part: BodyPart) -> Pose:
        """Implement `SimulatedWorld.pose_of`."""
        placed = self._bodies[part.body]
        link = -1 if part.part is None else placed.links[part.part]
        return self._world.frame_pose(placed.number) if link < 0 else self._world.pose(placed.number, link)

    def joint_position(self, joint: BodyPart) -> float:
        """Implement `SimulatedWorld.joint_position`."""
        placed = self._bodies[joint.body]
        return self._world.joint_position(placed.number, placed.joints[joint.part or ""])

    def force_between(self, first: BodyPart, second: BodyPart) -> float:
        """Implement `SimulatedWorld.force_between`."""
        one, other = self._bodies[first.body], self._bodies[second.body]
        link = None if second.part is None else other.links[second.part]
        contacts = self._world.contacts(other.number, one.number, link)
        if first.part is not None:
            contacts = [contact for contact in contacts if contact.link_b == one.links[first.part]]
        return sum((contact.force for contact in contacts), 0.0)

    def load_on(self, part: BodyPart) -> float:
        """Implement `SimulatedWorld.load_on`."""
        placed = self._bodies[part.body]
        link = -1 if part.part is None else placed.links[part.part]
        contacts = self._world.contacts(placed.number, link=link)
        # A normal points towards the loaded body.
        return max(0.0, -sum(one.force * one.normal[2] for one in contacts if one.body_b != placed.number))

    def is_held(self, body: str) -> bool:
        """Implement `SimulatedWorld.is_held`."""
        number = self._bodies[body].number
        contacts = [one for one in self._world.contacts(number) if one.body_b != number]
        fingers = {one.link_b for one in contacts if one.body_b == self._robot.body} & set(
            self._robot.fingers
        )
        return len(fingers) == 2 and all(one.body_b == self._robot.body for one in contacts)

    def coating_of(self, name: str) -> CoatingMap:
        """Implement `SimulatedWorld.coating_of`."""
        return self._coatings[name]

    def robot_points(self) -> tuple[Vector3, Vector3]:
        """Implement `SimulatedWorld.robot_points`."""
        return self._robot.true_points()

    def seal(self, joint: BodyPart, friction: float) -> None:
        """Implement `SimulatedWorld.seal`."""
        placed = self._bodies[joint.body]
        self._engine.set_joint_friction(placed.number, placed.joints[joint.part or ""], friction)

    def _wipe(self, name: str, coating: CoatingMap) -> None:
        declared = coating.coating
        wiper = BodyPart(declared.wiped_by)
        if self.force_between(wiper, BodyPart(declared.on)) > declared.force:
            before = coating.wiped_share
            coating.wipe(self.pose_of(wiper))
            if coating.wiped_share != before:
                self._paint(name)

    def _paint(self, name: str) -> None:
        """Show a coating to cameras."""
        self._world.renderer.paint(self._pictures[name], self._coatings[name].picture())
