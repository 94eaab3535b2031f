"""The physics plant: executes allowed actions on a robot in a physics engine at 240 ticks a second.

It implements `aeros.runtime.ports.Plant` and decides nothing. It refuses what it cannot do before any
motion, and stops within the tick in which the monitor names a rule.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from math import hypot
from typing import Any, Final, NamedTuple, Protocol, TypedDict, Unpack

import numpy as np

from aeros.runtime.ports import CameraPicture, CameraView, PersonFigure, Readings
from aeros.sim.engine.engine import Engine
from aeros.sim.engine.people import People, Person
from aeros.sim.engine.robot import PhysicalRobot
from aeros.sim.engine.scanned_cell import PhysicsCell
from aeros.sim.engine.world import EngineWorld
from aeros.sim.fixed_step_plant import CAMERA_TICKS, FixedStepPlant, PictureSource
from aeros.sim.geometry import Camera, Vector3
from aeros.sim.layouts.survey import NO_SURVEY_ERRORS
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.errors import BlockedError
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.odometry import WheelOdometry
from aeros.sim.scanners.area_sensor import AreaSensor
from aeros.sim.scanners.person_distance import RobotPosture
from aeros.sim.scanners.scanner_set import ScannerSet
from aeros.sim.scenes.physics_scene import PhysicsScene
from aeros.sim.scenes.scene import PhysicalScene
from aeros.sim.sensor_model import SensorModel
from aeros.sim.sensors import SCANNER_RANGE, GroundTruth, Sensors
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.scene import Scene
from aeros.spec.model.sensor_errors import AreaScanners, OdometryErrors, SurveyErrors

BLOCKED_DISTANCE: Final = 0.015
"""Distance of a link from its commanded place above which the robot is blocked, m (unhindered: 0.002).

It is the clearance of the reference site: what was decided for whole motions holds no farther.
"""

_SETTLE_TICKS: Final = 120
"""Ticks in which a new world comes to rest before its clock starts."""


TruthListener = Callable[[GroundTruth], None]
"""Receives the ground truth after every tick, to judge an experiment; nothing that acts may use it."""


class PlantParts(NamedTuple):
    """The parts of a physics plant that a disturbance can act on.

    Attributes:
        engine: the physics engine.
        world: the simulated world.
        robot: the robot.
        scene: the scene with its objects.
        sensors: sensor models between true values and readings.
        people: simulated people.
        scanners: scanners that measure how far people are; None if that is measured exactly.
    """

    engine: Engine
    world: EngineWorld
    robot: PhysicalRobot
    scene: PhysicalScene
    sensors: Sensors
    people: People
    scanners: ScannerSet | None = None


class Viewer(Protocol):
    """Something that shows the world to people, in a window or in a film, and changes nothing in it."""

    def begin(self, parts: PlantParts) -> None:
        """Take the parts of the plant; called once, before the first tick.

        Args:
            parts: parts of the plant; nothing of them may be changed.
        """

    def tick(self, world: EngineWorld, view: Camera) -> None:
        """Show the world after a tick.

        Args:
            world: the simulated world; it must not be changed.
            view: a camera that sees the whole scene.
        """

    def close(self) -> None:
        """Finish the recording or close the window; safe to call twice."""


class NoDisturbance:
    """Hooks for faults, each of which does nothing."""

    def attach(self, parts: PlantParts) -> None:
        """Take the parts of the plant; called once, while its clock stands at 0.

        Args:
            parts: parts of the plant that the disturbance may act on.
        """

    def before_tick(self) -> None:
        """Act on the world; called in each tick after the motors are set and before the world steps."""

    def disturb_picture(self, picture: CameraPicture) -> CameraPicture:
        """Disturb a picture that has just been taken.

        Args:
            picture: the picture.

        Returns:
            What the camera delivers.
        """
        return picture

    def skill_began(self, skill: str) -> None:
        """Note that a skill begins.

        Args:
            skill: as `MODULE.SKILL`.
        """

    def skill_ended(self, skill: str) -> None:
        """Note that a skill has ended.

        Args:
            skill: as `MODULE.SKILL`.
        """


class PlantOptions(TypedDict, total=False):
    """Optional keyword arguments of a physics plant.

    Attributes:
        spectators: windows and recorders that show the world; none by default.
        people: simulated people on scripted paths; nobody by default.
        odometry: errors of wheel odometry; none by default.
        scanners: scanners that measure how far people are; by default that is measured exactly.
        sensors: sensor models by name of the state variable; variables without one are measured exactly and
            without delay.
        referee: is given the ground truth after every tick; none by default.
        disturbance: faults, active from the start of the clock; none by default.
        engine: the physics engine, its world empty; one of PyBullet by default.
    """

    spectators: Sequence[Viewer]
    people: Sequence[Person]
    sensors: Mapping[str, SensorModel] | None
    odometry: OdometryErrors
    scanners: AreaScanners | None
    referee: TruthListener | None
    disturbance: NoDisturbance | None
    engine: Engine | None


class PhysicsPlant(FixedStepPlant):
    """A scene simulated with physics, with a robot, sensors, people and faults.

    The clock starts at 0 after the scene has settled.

    Args:
        scene: objects, cameras and how the robot is built.
        seed: of layout, sensor noise and people.
        **options: see `PlantOptions`.

    Raises:
        UserError: two bodies overlap at the start.
    """

    def __init__(self, scene: PhysicalScene, seed: int, **options: Unpack[PlantOptions]) -> None:
        people = options.get("people", ())
        self._scene = scene
        self._spectators = options.get("spectators", ())
        self._referee = options.get("referee")
        self.sensors = Sensors(seed, options.get("sensors"))
        self._engine = options.get("engine") or make_bullet_engine()
        self._world = self._engine.world
        wheels = WheelOdometry(RandomSource(seed), *options.get("odometry", OdometryErrors()))
        robot = self._engine.add_robot(scene.robot, wheels)
        try:
            scene.build(self._engine, robot, RandomSource(seed))
        except UserError:
            self._world.close()
            raise
        for _ in range(_SETTLE_TICKS):
            self._world.step()
        self._world.ticks = 0
        scanners = options.get("scanners")
        floor = 0.0 if scanners is None else scanners.floor
        self._people = People(self._engine, robot.body, people, RandomSource(seed), floor)
        self._area_sensor = None if scanners is None else self._set_up(scanners, robot, RandomSource(seed))
        self._disturbance = options.get("disturbance") or NoDisturbance()
        self._simulated = robot
        devices = None if self._area_sensor is None else self._area_sensor.devices
        parts = PlantParts(self._engine, self._world, robot, scene, self.sensors, self._people, devices)
        self._disturbance.attach(parts)
        super().__init__(robot, scene.cameras)
        if self._area_sensor is not None:
            self._area_sensor.start(RobotPosture(self._state.q, self._state.base_position))
        self._truth = GroundTruth(0, self._fast_values())
        self._slow_quantities = tuple(self._ground_truth().values.keys() - self._truth.values.keys())
        self.sensors.sample(self._truth)
        for camera in scene.initial_cameras:
            # Taken before the clock starts, and so neither late nor lost, nor with faults.
            self._publish(self.sensors.disturb(self._picture(camera), 0))
        for viewer in self._spectators:
            viewer.begin(parts)

    def now(self) -> float:
        """Implement `Plant.now`: simulated seconds since the scene settled."""
        return self._world.time

    def observe(self) -> Readings:
        """Implement `Plant.observe`: current readings."""
        return self.sensors.read(self._ground_truth())

    def truth(self) -> Mapping[str, int]:
        """Judge the goals by what is true in the world, for a referee; nothing that acts may call it.

        Returns:
            The truth, or the number, of each state variable that the scene defines.
        """
        return self._scene.truth()

    def people(self) -> tuple[PersonFigure, ...]:
        """Locate the simulated people, for viewers; nothing that acts may call it.

        Returns:
            The people where they truly are.
        """
        return tuple(self._people.figures())

    def skill_began(self, skill: str) -> None:
        """Implement `Plant.skill_began`: tell the disturbance."""
        self._disturbance.skill_began(skill)

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """Implement `Plant.skill_ended`: tell the disturbance."""
        self._disturbance.skill_ended(skill)

    def close(self) -> None:
        """Implement `Plant.close`: close the viewers and end the simulation."""
        with ExitStack() as closing:
            closing.callback(self._world.close)
            for viewer in self._spectators:
                closing.callback(viewer.close)

    # Internals.

    def _set_up(self, scanners: AreaScanners, robot: PhysicalRobot, chance: RandomSource) -> AreaSensor:
        cell = PhysicsCell(self._engine, robot, self._people, scanners.floor + scanners.height)
        return AreaSensor(scanners, cell, chance, robot.model, carriage=robot.has_carriage)

    def _look(self, camera: str) -> PictureSource:
        picture = self._disturbance.disturb_picture(self._picture(camera))
        return lambda: picture

    def _camera_motion(self, camera: str) -> Iterator[None]:
        """Take a picture; a camera with a sensor model may deliver it late, noisy or never."""
        picture = self.sensors.deliver(self._look(camera)(), self._world.ticks)
        for _ in range(CAMERA_TICKS + self.sensors.delay(camera)):
            yield
        if picture is not None:
            self._publish(picture)

    def _picture(self, name: str) -> CameraPicture:
        camera, believed = self._scene.camera(name), self._scene.believed_camera(name)
        image = self._world.renderer.render(camera)
        return CameraPicture(
            name,
            self._world.time,
            camera.width,
            camera.height,
            image.rgb.tobytes(),
            image.depth.astype(np.float32).tobytes(),
            CameraView(believed.eye, believed.target, believed.up, believed.field_of_view),
        )

    def _publish(self, picture: CameraPicture) -> None:
        self._pictures[picture.camera] = lambda: picture

    def _step_world(self) -> None:
        self._disturbance.before_tick()
        self._world.step()
        self._scene.tick()
        if self._people.walkers:
            self._people.update(self._world.time)
        for viewer in self._spectators:
            viewer.tick(self._world, self._scene.view)

    def _measure(self) -> None:
        if self._area_sensor is not None:
            posture = RobotPosture(self._state.q, self._state.base_position)
            self._area_sensor.tick(self._world.ticks, posture)
        self._truth = GroundTruth(self._world.ticks, self._fast_values())
        is_slow_sampled = self.sensors.needs_sampling(self._slow_quantities)
        self.sensors.sample(self._ground_truth() if is_slow_sampled else self._truth)
        if self._referee is not None:
            base, tool = self._simulated.true_points()
            true = {
                **self._truth.values,
                "contact_force": self._simulated.net_contact_force(),
                "base_position": base,
                "tool_position": tool,
                "human_distance": self._true_distance(),
            }
            self._referee(GroundTruth(self._truth.tick, true))

    def _monitor_values(self) -> Mapping[str, Any]:
        return self.sensors.monitor_values(self._truth)

    def _ground_truth(self) -> GroundTruth:
        """Return the ground truth of now, including the scene's."""
        values = {**self._truth.values, "holding": self._robot.is_holding(), **self._scene.measure()}
        return GroundTruth(self._truth.tick, values)

    def _fast_values(self) -> dict[str, Any]:
        values = super()._fast_values()
        if self._area_sensor is None:
            values["human_distance"] = self._true_distance()
        elif self._area_sensor.reading is None:
            del values["human_distance"]
        else:
            values["human_distance"] = self._area_sensor.reading
        return values

    def _true_distance(self) -> float:
        """Return the distance of the nearest person from the robot, m."""
        nearest = self._people.distance(SCANNER_RANGE) if self._people.walkers else SCANNER_RANGE
        return min(SCANNER_RANGE, nearest)

    def _check_tracking(self) -> None:
        if self._truth.values["tracking_error"] <= BLOCKED_DISTANCE:
            return
        state = self._state
        if hypot(*self._robot.base_tracking_error(state)) > BLOCKED_DISTANCE:
            raise BlockedError(f"blocked: the carriage is held back at {_format_point(state.base_position)}")
        raise BlockedError(f"blocked: the arm is held back at {_format_point(state.tool_position)}")


def _format_point(place: Vector3) -> str:
    x, y, z = place
    return f"({x:.3f}, {y:.3f}, {z:.3f}) m"


def make_bullet_engine(substeps: int = 1) -> Engine:
    """Make an engine of PyBullet.

    Args:
        substeps: steps of the engine in a tick of 1/240 s. Control, sensors and monitor run once a tick.

    Returns:
        The engine, its world empty.

    Raises:
        ValueError: there is not one step at least.
    """
    from aeros.sim.bullet.engine import BulletEngine
    from aeros.sim.bullet.world import PhysicsWorld

    return BulletEngine(PhysicsWorld(substeps))


def make_mujoco_engine() -> Engine:
    """Make an engine of MuJoCo.

    Returns:
        The engine, its world empty.
    """
    from aeros.sim.mujoco.engine import MujocoEngine

    return MujocoEngine()


def make_plant(
    scene: Scene,
    seed: int,
    survey: SurveyErrors = NO_SURVEY_ERRORS,
    robot: RobotModel | None = None,
    **options: Unpack[PlantOptions],
) -> PhysicsPlant:
    """Make a physics plant of a scene.

    The same scene, options, seed and actions repeat bit for bit.

    Args:
        scene: the scene.
        seed: of layout, sensor errors and people.
        survey: errors of surveyed places.
        robot: the robot; None for that of the reference site.
        **options: see `PlantOptions`.

    Returns:
        The plant, at rest, its clock at 0.

    Raises:
        UserError: the scene has no robot, a model cannot be loaded, or two bodies overlap.
    """
    return PhysicsPlant(PhysicsScene(scene, survey, robot), seed, **options)
