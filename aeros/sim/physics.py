"""The physics plant: executes allowed actions on a PyBullet Panda, 240 ticks a second.

Implements `aeros.runtime.ports.Plant`.  It decides nothing: what it cannot do it refuses before any
motion, and when the monitor names a rule it stops within that tick.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from typing import Any, Final, NamedTuple, Protocol, TypedDict, Unpack

from aeros.runtime.ports import Readings
from aeros.sim.bullet.bodies import SceneBody, add_body, check_overlaps
from aeros.sim.bullet.panda import Panda
from aeros.sim.bullet.people import People, Person
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.geometry import Camera, Vector3
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.motions import BlockedError
from aeros.sim.scenes import SCENES
from aeros.sim.scenes.scene import DetectionFilter, Scene, unfiltered
from aeros.sim.sensors import SCANNER_RANGE, GroundTruth, SensorModel, Sensors
from aeros.sim.ticked_plant import CAMERA_TICKS, TickingPlant
from aeros.spec.diagnostics.errors import UserError

_BLOCKED_JOINT_ERROR: Final = 0.05
"""Distance of a joint from its set point that no unhindered motion shows (0.005 seen at most), rad."""

_BLOCKED_BASE_ERROR: Final = 0.02
"""The same of the carriage (0.0018 seen at most), m."""

_SETTLE_TICKS: Final = 120
"""Ticks a new world gets to come to rest before its clock starts."""


TruthListener = Callable[[GroundTruth], None]
"""Whoever judges an experiment: told what is true after every tick, and nothing that acts hears of it."""


class Viewer(Protocol):
    """Whoever looks on for people, by a film or a window, and changes nothing."""

    def tick(self, world: PhysicsWorld, view: Camera) -> None:
        """Look at `world` after a tick; `view` is from where its scene is seen well."""

    def close(self) -> None:
        """There is nothing more to see; safe to call twice."""


class PlantParts(NamedTuple):
    """The parts of a physics plant, which a disturbance acts on."""

    world: PhysicsWorld
    robot: Panda
    scene: Scene
    sensors: Sensors
    people: People


class NoDisturbance:
    """The hooks that a plant offers to faults; every one does nothing, so nothing goes wrong."""

    def attach(self, parts: PlantParts) -> None:
        """Take the plant's own parts; called once, when its clock stands at 0."""

    def before_tick(self) -> None:
        """Act on the world after the motors are set and before it steps."""

    def detection_filter(self, camera: str) -> DetectionFilter:
        """Return what becomes of everything in the picture that `camera` takes now."""
        return unfiltered

    def skill_began(self, skill: str) -> None:
        """Hear that `MODULE.SKILL` begins."""

    def skill_ended(self, skill: str) -> None:
        """Hear that `MODULE.SKILL` has ended."""


class PlantOptions(TypedDict, total=False):
    """Options of a physics plant, all of them keywords that may be left out.

    spectators: films and windows that show the world; none by default.
    people: simulated people on scripted paths; nobody by default.
    sensors: sensor model of each state variable that is not measured exactly and at once, by its name.
    referee: is given the true state after every tick; nobody by default.
    disturbance: faults, from when the clock runs; none by default.
    bodies: bodies that stand or lie in the scene besides its own; none by default.
    """

    spectators: Sequence[Viewer]
    people: Sequence[Person]
    sensors: Mapping[str, SensorModel] | None
    referee: TruthListener | None
    disturbance: NoDisturbance | None
    bodies: Sequence[SceneBody]


class PhysicsPlant(TickingPlant):
    """A scene in motion.  Its clock starts at 0 when everything put into the scene rests.

    Raises UserError where any two bodies overlap.
    """

    def __init__(self, scene: Scene, seed: int, **options: Unpack[PlantOptions]) -> None:
        bodies, people = options.get("bodies", ()), options.get("people", ())
        self._scene = scene
        self._spectators = options.get("spectators", ())
        self._referee = options.get("referee")
        self.sensors = Sensors(seed, options.get("sensors"))
        self._world = PhysicsWorld()
        robot = Panda(self._world, scene.robot)
        scene.build(self._world, robot, RandomSource(seed))
        placed = {add_body(self._world, body): body for body in bodies}
        names = {scene.body(name): f"the scene's `{name}`" for name in scene.pushable_objects}
        try:
            check_overlaps(self._world, placed, {**names, robot.body: "the robot"})
        except UserError:
            self._world.close()
            raise
        for _ in range(_SETTLE_TICKS):
            self._world.step()
        self._world.ticks = 0
        self._people = People(self._world, robot.body, people, RandomSource(seed))
        self._disturbance = options.get("disturbance") or NoDisturbance()
        self._disturbance.attach(PlantParts(self._world, robot, scene, self.sensors, self._people))
        super().__init__(robot, scene.cameras)
        self._truth = GroundTruth(0, self._fast_values())
        self.sensors.sample(self._truth)
        for camera in scene.initial_cameras:
            # Of before the clock started, and so before anything goes wrong.
            self._publish_detection(self.sensors.read_camera(GroundTruth(0, self._scene.detect(camera))))

    def now(self) -> float:
        """Simulated seconds since the scene came to rest."""
        return self._world.time

    def observe(self) -> Readings:
        """Robot sensors and scene now; what cameras saw, with the time they saw it."""
        return {**self._seen, **self.sensors.read(self._ground_truth())}

    def skill_began(self, skill: str) -> None:
        """Physics does not care who asked; a disturbance may."""
        self._disturbance.skill_began(skill)

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """Physics does not care who asked; a disturbance may."""
        self._disturbance.skill_ended(skill)

    def close(self) -> None:
        """Close what looks on, and end the simulation; safe to call twice."""
        with ExitStack() as closing:
            closing.callback(self._world.close)
            for one in self._spectators:
                closing.callback(one.close)

    # Inside.

    def _detect(self, camera: str) -> Mapping[str, Any]:
        return self._scene.detect(camera, self._disturbance.detection_filter(camera))

    def _detect_raw(self, camera: str) -> Iterator[None]:
        picture = GroundTruth(self._world.ticks, self._detect(camera))
        for _ in range(CAMERA_TICKS + self.sensors.delay(picture.values)):
            yield
        self._publish_detection(self.sensors.read_camera(picture))

    def _step_world(self) -> None:
        self._disturbance.before_tick()
        self._world.step()
        self._scene.tick()
        self._people.update(self._world.time)
        for one in self._spectators:
            one.tick(self._world, self._scene.view)

    def _measure(self) -> None:
        self._truth = GroundTruth(self._world.ticks, self._fast_values())
        self.sensors.sample(
            self._ground_truth() if self.sensors.needs_sampling(self._truth.values) else self._truth
        )
        if self._referee is not None:
            self._referee(self._truth)

    def _monitor_values(self) -> Mapping[str, Any]:
        return self.sensors.monitor_values(self._truth)

    def _ground_truth(self) -> GroundTruth:
        """What is true now, of the scene too."""
        values = {**self._truth.values, "holding": self._robot.is_holding(), **self._scene.measure()}
        return GroundTruth(self._truth.tick, values)

    def _fast_values(self) -> dict[str, Any]:
        values = super()._fast_values()
        values["human_distance"] = min(SCANNER_RANGE, self._people.distance(SCANNER_RANGE))
        return values

    def _check_tracking(self) -> None:
        if self._robot.tracking_error(self._state) > _BLOCKED_JOINT_ERROR:
            raise BlockedError(f"blocked: the arm is held back at {_format_point(self._state.tool_position)}")
        if self._robot.has_carriage and self._robot.base_tracking_error(self._state) > _BLOCKED_BASE_ERROR:
            raise BlockedError(
                f"blocked: the carriage is held back at {_format_point(self._state.base_position)}"
            )


def _format_point(place: Vector3) -> str:
    x, y, z = place
    return f"({x:.3f}, {y:.3f}, {z:.3f}) m"


def make_plant(scene_name: str, seed: int, **options: Unpack[PlantOptions]) -> PhysicsPlant:
    """Make a plant with scene `scene_name`, laid out by `seed`.

    The same scene, options, seed and actions repeat bit for bit.

    Raises:
        KeyError: no scene has that name.
        UserError: two bodies overlap.
    """
    return PhysicsPlant(SCENES[scene_name](), seed, **options)
