"""Each kind of violation, provoked by what happens to the robot: a stop in the tick in which it is measured.

Nothing that is measured is made up: links are pushed, drives are weak, a body is in the way, somebody comes.
Violations are found by ground truth and the numbers of record, beside the monitor.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

from aeros.runtime.gate.compiled.rules import MonitorRules
from aeros.runtime.gate.decision import Decision, DecisionKind
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.monitor.history import HistoryTracker
from aeros.runtime.monitor.monitor import RuntimeMonitor
from aeros.runtime.motion.trajectory import MotionDecider
from aeros.sim.bullet.client import bullet
from aeros.sim.clock import TICK
from aeros.sim.engine.people import Person, Waypoint
from aeros.sim.geometry import Vector3
from aeros.sim.physics import NoDisturbance, PhysicsPlant, PlantParts
from aeros.sim.robot.robot import RobotOptions
from aeros.sim.sensors import GroundTruth
from aeros.skill import Action, act
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from tests.unit.sim.acting import allow, execute, recording
from tests.unit.sim.bare_scene import BareScene
from tests.unit.sim.bullet.bullet_parts import as_bullet, as_panda
from tests.unit.sim.robot.panda import PANDA, Q_MAX, QD_MAX, QDD_MAX, READY_POSTURE, TAU_MAX

pytestmark = pytest.mark.physics

FOREVER = 1e9
BEGINS = 0.25
"""Time at which a disturbance begins, s: the arm is on its way by then."""

SLOWLY = act("move_tool", target=(0.45, 0.1, 0.35), yaw=0.0, speed=0.1)

Values = Mapping[str, Any]


@dataclass
class Rough(NoDisturbance):
    """From `BEGINS` on one drive is weak and a link is pushed, until the plant stops.

    weak: the joint, and the torque that it has left, N·m.
    push: forces in W, N, on the arm's link of this number, each at a place relative to that link.
    """

    weak: tuple[int, float] = (7, 12.0)
    link: int = 7
    push: tuple[tuple[Vector3, Vector3], ...] = ()
    is_over: bool = False

    def attach(self, stage: PlantParts) -> None:
        self._stage = stage

    def before_tick(self) -> None:
        world, robot = as_bullet(self._stage.world), as_panda(self._stage.robot)
        joint, torque = self.weak
        if world.time < BEGINS or self.is_over:
            robot.torque_limits[joint - 1] = float(TAU_MAX[joint - 1])
            return
        robot.torque_limits[joint - 1] = torque
        link = robot._arm[self.link - 1]
        place = world.pose(robot.body, link).position
        for force, arm in self.push:
            at = tuple(a + b for a, b in zip(place, arm, strict=True))
            bullet.applyExternalForce(
                robot.body, link, force, at, bullet.WORLD_FRAME, physicsClientId=world.client
            )


def turn(force: float) -> tuple[tuple[Vector3, Vector3], ...]:
    """A couple about the vertical, of 0.2 N·m for each N: nothing but the last joint gives way."""
    return (((0.0, force, 0.0), (0.1, 0.0, 0.0)), ((0.0, -force, 0.0), (-0.1, 0.0, 0.0)))


@dataclass(frozen=True)
class Provocation:
    """A disturbance, the rule that the true values then violate, and the reason expected for the stop.

    posture: where the arm begins, rad.
    load: mass of hand and load together, known to the drives' model, kg; None for the hand alone.
    """

    rule: str
    message: str
    violated: Callable[[Values], bool]
    rough: Callable[[], NoDisturbance] = NoDisturbance
    people: tuple[Person, ...] = ()
    obstacle: bool = False
    load: float | None = None
    posture: tuple[float, ...] = tuple(READY_POSTURE.tolist())
    action: Action = SLOWLY


class Obstructed(BareScene):
    """The bare cell with the robot in some posture, and perhaps a block in its way, or a load in its hand."""

    def __init__(self, posture: tuple[float, ...], obstacle: bool, load: float | None = None) -> None:
        self.robot = RobotOptions(PANDA, posture=posture)
        self._obstacle = obstacle
        self._load = load

    def build(self, engine: Any, robot: Any, chance: Any) -> None:
        super().build(engine, robot, chance)
        world = engine.world
        if self._load is not None:
            bullet.changeDynamics(robot.body, robot._wrist, mass=self._load, physicsClientId=world.client)
        if self._obstacle:
            world.bodies.add_box((0.1, 0.1, 0.3), (0.38, 0.18, 0.45))


def at_its_end() -> tuple[float, ...]:
    """The last joint 20 mrad inside its limit, which is as near as motions go."""
    return (*READY_POSTURE[:6].tolist(), float(Q_MAX[6]) - 0.02)


STANDING = Person("stands", (Waypoint((0.3, 1.5)),))
"""Within the warning distance, and far enough for the arm to move slowly."""

WALKING = Person("walks", (Waypoint((0.3, 3.0)), Waypoint((0.3, 0.0), speed=1.6)))

KINDS = {
    "position": Provocation(
        "joint-positions",
        "joint_position[j7] is ",
        lambda values: values["joint_position"][6] > Q_MAX[6],
        lambda: Rough(weak=(7, 1.0), push=turn(-5.5)),
        posture=at_its_end(),
        action=act(
            "move_tool", target=(0.35, 0.0, 0.45), yaw=float(READY_POSTURE[6] - Q_MAX[6] + 0.02), speed=0.1
        ),
    ),
    "speed": Provocation(
        "joint-speeds",
        "abs(joint_velocity[j7]) is ",
        lambda values: bool((np.abs(values["joint_velocity"]) > QD_MAX).any()),
        lambda: Rough(weak=(7, 4.0), push=turn(40.0)),
    ),
    "torque": Provocation(
        "joint-torques",
        "abs(joint_torque[j2]) is ",
        lambda values: bool((np.abs(values["joint_torque"]) > 0.95 * TAU_MAX).any()),
        load=10.0,  # three times what the arm may carry, so that reaching out is too much for joint 2
        action=act("move_tool", target=(0.6, 0.1, 0.35), yaw=0.0, speed=0.2),
    ),
    "link speed": Provocation(
        "link-speeds-near-person",
        "link_speed is ",
        lambda values: values["link_speed"] > 0.25,
        lambda: Rough(weak=(1, 5.0), link=6, push=(((0.0, 100.0, 0.0), (0.0, 0.0, 0.0)),)),
        people=(STANDING,),
    ),
    "distance": Provocation(
        "arm-separation",
        "human_distance is ",
        # S at 0.1 m/s: 1.6·(0.105 + 0.34) + 0.1·0.105 + 0.1·0.34/2 + 0.1 + 0.05 + 0.01 m.
        lambda values: values["human_distance"] < 0.8995,
        people=(WALKING,),
    ),
    "torque rate": Provocation(
        "joint-torque-rates",
        "abs(joint_torque_rate[j",
        lambda values: max(map(abs, values["joint_torque_rate"])) > 1000.0,
        lambda: Rough(weak=(1, 5.0), link=6, push=(((0.0, 100.0, 0.0), (0.0, 0.0, 0.0)),)),
    ),
    "contact force": Provocation(
        "collision-force",
        "contact_force is ",
        lambda values: values["contact_force"] > 65.0,
        obstacle=True,
    ),
}


@dataclass
class Run:
    """Result of an action, watched by the site's monitor.

    truths: of every tick; violated: the ticks in which the numbers of record are; stopped: when `stop` came.
    sent: set points from then on.
    """

    reason: str | None = None
    message: str = ""
    truths: list[GroundTruth] = field(default_factory=list)
    violated: list[int] = field(default_factory=list)
    stopped: list[int] = field(default_factory=list)
    sent: list[tuple[Any, Any]] = field(default_factory=list)


@pytest.fixture(scope="module")
def site() -> Site:
    found = load_site(reference_site_path(), Diagnostics())
    assert found is not None
    return found


SUDDEN = ("joint-torque-rates", "collision-force")
"""Rules that sudden pushes break before any other: torques change, and show the force."""


def without_sudden(site: Site, kept: str) -> Site:
    """The site without those of the rules `SUDDEN` that are not `kept`."""
    return replace(site, rules=tuple(one for one in site.rules if one.id == kept or one.id not in SUDDEN))


def run(kind: Provocation, site: Site) -> Run:
    site = without_sudden(site, kind.rule)
    recorded, rough = Run(), kind.rough()
    plant = PhysicsPlant(
        Obstructed(kind.posture, kind.obstacle, kind.load),
        0,
        people=kind.people,
        referee=recorded.truths.append,
        disturbance=rough,
    )
    watch = RuntimeMonitor(MonitorRules(site), HistoryTracker(site))
    watch.add(ActiveAction(kind.action, plant.observe(), plant.now(), 0))
    come_to_rest, command = plant._come_to_rest, plant._robot.command

    def monitor(now: float, values: Values) -> str | None:
        if not recorded.stopped and kind.violated(values):
            recorded.violated.append(plant._world.ticks)
        return watch(now, values)

    def stop(ask: Callable[[], str | None]) -> None:
        recorded.stopped.append(plant._world.ticks)
        recorded.sent.append((plant._robot.q_command, plant._robot.qd_command))
        if isinstance(rough, Rough):
            rough.is_over = True
        come_to_rest(ask)

    def spy(q: Any, qd: Any) -> None:
        if recorded.stopped:
            recorded.sent.append((q, qd))
        command(q, qd)

    plant._come_to_rest, plant._robot.command = stop, spy  # type: ignore[method-assign]
    recorded.reason = execute(plant, kind.action, monitor, FOREVER).reason
    recorded.message = str(watch.violation)
    plant.close()
    return recorded


@pytest.fixture(scope="module", params=KINDS)
def provoked(request: pytest.FixtureRequest, site: Site) -> tuple[Provocation, Run]:
    kind = KINDS[request.param]
    return kind, run(kind, site)


def test_each_kind_stops_in_the_tick_in_which_it_is_measured(provoked: tuple[Provocation, Run]) -> None:
    kind, recorded = provoked
    assert recorded.reason == f"monitor:{kind.rule}"
    assert recorded.violated[0] >= BEGINS / TICK
    assert recorded.stopped == recorded.violated


def test_a_stop_message_names_quantity_value_and_bound(provoked: tuple[Provocation, Run]) -> None:
    kind, recorded = provoked
    one = next(one for one in recorded.message.split(", ") if one.startswith(kind.message))
    value, bound = re.fullmatch(r".* is (\S+) .*\(at (?:most|least) (\S+) .*\)", one).groups()  # type: ignore[union-attr]
    assert (float(value) < float(bound)) is ("at least" in one)
    assert float(value) != float(bound)


def test_the_stop_keeps_to_the_limits_of_record_and_comes_to_rest(provoked: tuple[Provocation, Run]) -> None:
    """Of joints: acceleration as measured from tick to tick, torque, and speed after what it begins with."""
    kind, recorded = provoked
    stopping = [truth.values for truth in recorded.truths if truth.tick >= recorded.stopped[0]]
    rates = np.array([values["joint_velocity"] for values in stopping])
    if not kind.obstacle:  # which brakes the arm as hard as it likes
        assert (np.abs(np.diff(rates, axis=0)) / TICK <= QDD_MAX).all()
        assert (np.abs(rates) <= np.maximum(np.abs(rates[0]), 0.02)).all()
    # The first set point is that of the motion; of a joint that does not follow, the next is what it does.
    commanded = np.array([rate for _, rate in recorded.sent])[1:]
    assert (np.abs(np.diff(commanded, axis=0)) / TICK <= 0.9001 * QDD_MAX).all()
    assert (np.abs([values["joint_torque"] for values in stopping]) <= TAU_MAX).all()
    assert np.abs(rates[-1]).max() < 0.02


def test_an_arm_that_met_something_stops_pushing_and_can_leave() -> None:
    plant = PhysicsPlant(Obstructed(tuple(READY_POSTURE.tolist()), obstacle=True), 0)

    def hard(now: float, values: Values) -> str | None:
        return "hard" if values["contact_force"] > 65.0 else None

    assert execute(plant, SLOWLY, hard, FOREVER).reason == "monitor:hard"
    forces: list[Values] = []
    assert execute(plant, act("wait", duration=0.2), recording(forces), FOREVER).completed
    assert forces[-1]["contact_force"] < 10.0
    back = act("move_tool", target=(0.307, 0.0, 0.487), yaw=0.0, speed=0.1)
    assert execute(plant, back, allow, FOREVER).completed
    assert plant.observe()["contact_force"].value < 0.5  # the observer's own error
    plant.close()


def test_an_arm_that_sagged_through_its_stop_is_planned_from_where_it_is(site: Site) -> None:
    weak = Rough(weak=(4, 17.0))
    plant = PhysicsPlant(BareScene(), 0, disturbance=weak)
    ended = execute(plant, SLOWLY, allow, FOREVER)
    assert ended.reason is not None
    assert ended.reason.startswith("blocked")
    weak.is_over = True
    execute(plant, act("wait", duration=0.2), allow, FOREVER)
    plan, readings = plant.plan(SLOWLY), plant.observe()
    decided = MotionDecider(site.motion).decide(Decision(DecisionKind.ALLOW, SLOWLY, ()), plan, readings)
    assert decided.reasons == ()
    assert execute(plant, SLOWLY, allow, FOREVER, plan).completed
    plant.close()


@pytest.mark.parametrize("name", KINDS)
def test_nothing_stops_without_the_provocation(name: str, site: Site) -> None:
    people = (STANDING,) if KINDS[name].people else ()
    calm = replace(KINDS[name], rough=NoDisturbance, people=people, obstacle=False, load=None)
    recorded = run(calm, site)
    assert (recorded.reason, recorded.violated, recorded.stopped) == (None, [], [])
