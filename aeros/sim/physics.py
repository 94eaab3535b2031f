"""The physics plant: executes allowed actions on a PyBullet Panda, 240 ticks a second.

Implements `aeros.runtime.ports.Plant`.  It decides nothing: what it cannot do it refuses before any
motion, and when the monitor names a rule it stops within that tick.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from aeros.runtime.ports import Completion, Monitor, Motion, Motionless, Plan, Reading, Readings, Trajectory
from aeros.sim.motions import PLANNERS, BlockedError, Planned, settle
from aeros.sim.panda import PARTS, Panda, RobotState
from aeros.sim.parameters import Parameters, RefusedError
from aeros.sim.people import People, Person
from aeros.sim.profile import TICK
from aeros.sim.randomness import Chance
from aeros.sim.scenes import SCENES
from aeros.sim.scenes.scene import Scene
from aeros.sim.sensing import SCANNER_RANGE, SensorModel, Sensors, Truth
from aeros.sim.undisturbed import Stage, Undisturbed
from aeros.sim.video import Recorder
from aeros.sim.world import World
from aeros.skill import Action

_BLOCKED: Final = 0.05
"""Distance of a joint from its set point that no unhindered motion shows (0.005 seen at most), rad."""

_LOOK_TICKS: Final = 24
"""Exposure and read-out of a camera, ticks (0.1 s)."""

_SETTLE_TICKS: Final = 120
"""Ticks a new world gets to come to rest before its clock starts."""


@dataclass
class _UnderWay:
    """A motion tick by tick, and the parts that it moves.

    plan: what was stated of it; None while it comes to rest.
    is_set: its motors are set for the tick to come.
    """

    ticks: Iterator[None]
    moves: Collection[str]
    plan: Plan | None = None
    is_set: bool = False
    is_halting: bool = False


Referee = Callable[[Truth], None]
"""Whoever judges an experiment: told what is true after every tick, and nothing that acts hears of it."""


class PhysicsPlant:
    """A scene in motion.  Its clock starts at 0 when everything put into the scene rests.

    people: who walks about in it.
    sensors: between what is true in the scene and what `observe` and the monitor get.
    disturbance: what goes wrong once the clock runs; nothing by default.
    """

    def __init__(
        self,
        scene: Scene,
        seed: int,
        recorder: Recorder | None = None,
        *,
        people: Sequence[Person] = (),
        sensors: Mapping[str, SensorModel] | None = None,
        referee: Referee | None = None,
        disturbance: Undisturbed | None = None,
    ) -> None:
        self._scene = scene
        self._recorder = recorder
        self._referee = referee
        self.sensors = Sensors(seed, sensors)
        self._world = World()
        self._robot = Panda(self._world, scene.robot)
        scene.build(self._world, self._robot, Chance(seed))
        for _ in range(_SETTLE_TICKS):
            self._world.step()
        self._world.ticks = 0
        self._people = People(self._world, self._robot.body, people, Chance(seed))
        self._disturbance = disturbance or Undisturbed()
        self._disturbance.attach(Stage(self._world, self._robot, scene, self.sensors, self._people))
        self._seen: dict[str, Reading] = {}
        self._state = self._robot.sense()
        self._truth = Truth(0, self._fast_values())
        self.sensors.sample(self._truth)
        self._planned: tuple[int, Planned] | None = None
        self._under_way: dict[Motion, _UnderWay] = {}
        self._begun = 0

    def now(self) -> float:
        """Simulated seconds since the scene came to rest."""
        return self._world.time

    def observe(self) -> Readings:
        """Robot sensors and scene now; what cameras saw, with the time they saw it."""
        return {**self._seen, **self.sensors.read(self._whole_truth())}

    def plan(self, action: Action) -> Plan:
        """The motion that `action` is, from here and now."""
        try:
            planned = self._plan(action)
        except RefusedError as refusal:
            return Completion(False, str(refusal))
        self._planned = (self._world.ticks, planned)
        return planned.plan

    def begin(self, action: Action, decided: Plan | None = None) -> Motion | Completion:
        """Begin the motion of what was decided, if that is what was planned last, and just now."""
        plan = self.plan(action) if decided is None else decided
        if isinstance(plan, Completion):
            return plan
        planned, self._planned = self._planned, None
        if planned is None or planned[0] != self._world.ticks or planned[1].plan is not plan:
            return Completion(False, "stale: what was decided is not what was planned from here and now")
        self._begun += 1
        motion = Motion(self._begun)
        self._under_way[motion] = _UnderWay(planned[1].motion, planned[1].moves, plan)
        return motion

    def advance(self, monitor: Monitor, until: float) -> Mapping[Motion, Completion]:
        """Tick by tick; `monitor` sees the fast values before the first and after every one.

        Whatever is blocked ends everything: something is where nothing was expected.
        """
        rule = monitor(self.now(), self.sensors.values(self._truth))
        try:
            while rule is None:
                ended = self._set_motors()
                if ended or self.now() + TICK > until:
                    return ended
                self._tick(stopping=any(one.is_halting and "arm" in one.moves for one in self._all()))
                rule = monitor(self.now(), self.sensors.values(self._truth))
        except BlockedError as obstacle:
            self._robot.yield_here()
            return self._stopped(str(obstacle))
        return self._stopped(f"monitor:{rule}")

    def halt(self, motion: Motion) -> None:
        """Bring what `motion` moves to rest inside its limits; the fingers keep their grip."""
        one = self._under_way[motion]
        # What the motors are set to already is done first: a set point left out is a jerk.
        self._under_way[motion] = _UnderWay(
            self._coming_to_rest(one.moves), one.moves, is_set=one.is_set, is_halting=True
        )

    def stop(self) -> None:
        """Bring arm and base to rest inside their limits and hold; the fingers keep their grip."""
        if any(one.is_set for one in self._all()):
            self._tick(stopping=True)
        self._under_way.clear()
        for _ in self._coming_to_rest(PARTS):
            self._tick(stopping=True)

    def skill_began(self, skill: str) -> None:
        """Physics does not care who asked; a disturbance may."""
        self._disturbance.skill_began(skill)

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """Physics does not care who asked; a disturbance may."""
        self._disturbance.skill_ended(skill)

    def close(self) -> None:
        """Write the film, if one is taken, and end the simulation; safe to call twice."""
        if self._recorder is not None:
            self._recorder.close()
        self._world.close()

    # Inside.

    def _all(self) -> Collection[_UnderWay]:
        return self._under_way.values()

    def _set_motors(self) -> dict[Motion, Completion]:
        """Set each motor for the tick to come, once; those motions that are at their end."""
        ended = {}
        for motion, one in self._under_way.items():
            if one.is_set:
                continue
            try:
                next(one.ticks)
            except StopIteration:
                ended[motion] = Completion(False, "halted") if one.is_halting else Completion(True)
            else:
                one.is_set = True
        for motion in ended:
            del self._under_way[motion]
        return ended

    def _stopped(self, why: str) -> dict[Motion, Completion]:
        """Everything under way, over."""
        motions = list(self._under_way)
        self.stop()
        return dict.fromkeys(motions, Completion(False, why))

    def _coming_to_rest(self, parts: Collection[str]) -> Iterator[None]:
        yield from self._robot.stopping(parts)
        yield from settle(self._robot)

    def _plan(self, action: Action) -> Planned:
        parameters = Parameters(action.parameters)
        if action.kind == "look":
            camera = parameters.word("camera")
            parameters.done()
            return Planned(Motionless("it takes a picture"), self._look(camera))
        planner = PLANNERS.get(action.kind)
        if planner is None:
            raise RefusedError(f"unknown kind: `{action.kind}`")
        return planner(self._robot, parameters, self._drive())

    def _drive(self) -> Trajectory | None:
        """What was stated of the motion of the base under way."""
        plans = [one.plan for one in self._all() if "base" in one.moves]
        return next((plan for plan in plans if isinstance(plan, Trajectory)), None)

    def _look(self, camera: str) -> Iterator[None]:
        """Take a picture, hand over what it shows once it is read out."""
        try:
            found = self._scene.look(camera, self._disturbance.seen)
        except KeyError:
            raise RefusedError(f"unknown camera: `{camera}`") from None
        return self._read_out(Truth(self._world.ticks, found))

    def _read_out(self, picture: Truth) -> Iterator[None]:
        for _ in range(_LOOK_TICKS + self.sensors.delay(picture.values)):
            yield
        self._seen.update(self.sensors.read_once(picture))

    def _tick(self, *, stopping: bool = False) -> None:
        self._disturbance.before_tick()
        self._world.step()
        self._scene.tick()
        self._people.walk(self._world.time)
        if self._recorder is not None:
            self._recorder.tick(self._world)
        self._state = self._robot.sense()
        self._truth = Truth(self._world.ticks, self._fast_values())
        self.sensors.sample(
            self._whole_truth() if self.sensors.look_back(self._truth.values) else self._truth
        )
        if self._referee is not None:
            self._referee(self._truth)
        for one in self._all():
            one.is_set = False
        if not stopping and self._robot.tracking_error(self._state) > _BLOCKED:
            raise BlockedError(f"blocked: the arm is held back at {_spell(self._state)}")

    def _whole_truth(self) -> Truth:
        """What is true now, of the scene too."""
        values = {**self._truth.values, "holding": self._robot.is_holding(), **self._scene.measure()}
        return Truth(self._truth.tick, values)

    def _fast_values(self) -> dict[str, Any]:
        """What is true of the robot and people around it, by vocabulary name, SI, positions in W."""
        state = self._state
        return {
            "joint_position": state.q,
            "joint_velocity": state.qd,
            "joint_torque": state.torque,
            "tool_position": state.tool_position,
            "tool_speed": state.tool_speed,
            "finger_gap": state.finger_gap,
            "grip_force": min(self._robot.finger_forces()),
            "human_distance": min(SCANNER_RANGE, self._people.distance(SCANNER_RANGE)),
            "estop_pressed": False,
            "base_position": state.base_position,
        }


def _spell(state: RobotState) -> str:
    x, y, z = state.tool_position
    return f"({x:.3f}, {y:.3f}, {z:.3f}) m"


def make_plant(
    scene_name: str,
    seed: int,
    record: Path | None = None,
    *,
    people: Sequence[Person] = (),
    sensors: Mapping[str, SensorModel] | None = None,
    referee: Referee | None = None,
    disturbance: Undisturbed | None = None,
) -> PhysicsPlant:
    """A plant with scene `scene_name`, laid out by `seed`; `record` names a `.webp` film to write.

    The same scene, people, sensors, seed and actions repeat bit for bit.  Raises KeyError for an unknown
    scene.
    """
    scene = SCENES[scene_name]()
    recorder = None if record is None else Recorder(record, scene.view)
    return PhysicsPlant(
        scene,
        seed,
        recorder,
        people=people,
        sensors=sensors,
        referee=referee,
        disturbance=disturbance,
    )
