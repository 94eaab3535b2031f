"""Each kind of fault does what it says to bodies, motors and sensors, and nothing of it happens without."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from dataclasses import replace
from math import dist, inf, sqrt
from typing import Any

import pytest

from aeros.runtime.ports import CameraPicture, CameraView, MotionCompletion
from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.robot import BulletRobot
from aeros.sim.engine.engine import Engine
from aeros.sim.engine.people import Person, Waypoint
from aeros.sim.engine.robot import PhysicalRobot
from aeros.sim.faults.injector import FaultEvent, FaultInjector
from aeros.sim.faults.model import (
    CameraOpportunity,
    Fault,
    Opportunity,
    PersonEntersFault,
    PhysicalFault,
    PictureFault,
    SkillOpportunity,
    TimedOpportunity,
)
from aeros.sim.gilbert_elliott import GilbertElliottProcess
from aeros.sim.physics import PhysicsPlant, make_plant
from aeros.sim.randomness import RandomSource
from aeros.skill import act
from aeros.spec.declared.faults import (
    BoxFault,
    CommandDelayFault,
    GripForceFault,
    ImpulseFault,
    MisplacedPictureFault,
    MissedPictureFault,
    PadFrictionFault,
    SensorFault,
    TorqueFault,
)
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import allow, execute
from tests.unit.sim.bare_scene import BareScene
from tests.unit.sim.bullet.bullet_parts import as_bullet

pytestmark = pytest.mark.physics

ALWAYS = GilbertElliottProcess(0.0, 0.0, 1.0, 1.0, 1.0)
SKILL = "test.carry"


class Cube(BareScene):
    """A cube on a block, that can be grasped and carried."""

    pushable_objects: tuple[str, ...] = ("cube",)

    def build(self, engine: Engine, robot: PhysicalRobot, chance: RandomSource) -> None:
        world = as_bullet(engine.world)
        world.bodies.add_box((1.0, 1.0, 0.05), (0.5, 0.0, -0.025))
        world.bodies.add_box((0.10, 0.03, 0.05), (0.5, 0.1, 0.025))
        self.world = world
        self.cube = world.bodies.add_box((0.04, 0.04, 0.04), (0.5, 0.1, 0.07), mass=0.1)

    def body(self, name: str) -> int:
        return {"cube": self.cube}[name]

    def measure(self) -> Mapping[str, Any]:
        return {"cube_position": self.world.pose(self.cube).position}


class FaultyPlant:
    """A plant with faults, and the events that it reported."""

    def __init__(self, *faults: Fault, seed: int = 0) -> None:
        self.happened: list[FaultEvent] = []
        self.torques: list[float] = []
        self.plant = PhysicsPlant(Cube(), seed, disturbance=FaultInjector(faults, seed, self.happened.append))

    def do(self, kind: str, **parameters: Any) -> bool:
        return execute(self.plant, act(kind, **parameters), lambda now, values: None, inf).completed

    def move(self, x: float, y: float, z: float, speed: float = 0.25) -> bool:
        return self.do("move_tool", target=(x, y, z), yaw=0.0, speed=speed)

    def value(self, name: str) -> Any:
        return self.plant.observe()[name].value

    def hold_cube(self) -> None:
        assert self.move(0.5, 0.1, 0.15)
        assert self.move(0.5, 0.1, 0.07)
        assert self.do("grip", width=0.03, force=10.0)
        assert self.move(0.5, 0.1, 0.20)
        assert self.value("holding")


Make = Callable[..., FaultyPlant]


@pytest.fixture
def faulty_plant() -> Iterator[Make]:
    made: list[FaultyPlant] = []

    def make(*faults: Fault, seed: int = 0) -> FaultyPlant:
        made.append(FaultyPlant(*faults, seed=seed))
        return made[-1]

    yield make
    for one in made:
        one.plant.close()


def fault(
    kind: PhysicalFault | PictureFault,
    on: Opportunity | None = None,
    name: str = "it",
    process: GilbertElliottProcess = ALWAYS,
) -> Fault:
    return Fault(name, SkillOpportunity(SKILL, 0, from_first_grip=False) if on is None else on, process, kind)


def started(one: FaultyPlant) -> list[float]:
    return [happening.time for happening in one.happened if happening.event == "fault-started"]


def test_a_bump_moves_a_thing_by_force_and_without_one_it_stays(faulty_plant: Make) -> None:
    one = faulty_plant(fault(ImpulseFault("cube", 0.06, 12, (1.0, 0.0, 0.0))))
    before = one.value("cube_position")
    one.do("wait", duration=0.5)
    assert dist(one.value("cube_position"), before) < 1e-4
    one.plant.skill_began(SKILL)
    one.do("wait", duration=0.5)
    after = one.value("cube_position")
    assert 0.005 < after[0] - before[0] < 0.05
    assert abs(after[1] - before[1]) < 0.002
    assert [happening.event for happening in one.happened] == ["fault-started", "fault-ended"]
    assert one.happened[0] == FaultEvent(0.5, "fault-started", "it", "fault `it` begins (opportunity 1)", 1)


PUT = BoxFault((0.08, 0.08, 0.2), (0.45, -0.2, 0.0), spread=(0.02, 0.02, 0.0), mass=3.0, over=240)


def bounds_of_newest(one: FaultyPlant) -> tuple[tuple[float, ...], tuple[float, ...]]:
    client = as_bullet(one.plant._world).client
    newest = bullet.getBodyUniqueId(bullet.getNumBodies(physicsClientId=client) - 1, physicsClientId=client)
    low, high = bullet.getAABB(newest, physicsClientId=client)
    return low, high


@pytest.mark.parametrize("seed", [1, 2])
def test_a_box_is_put_down_at_a_place_that_the_seed_draws(seed: int, faulty_plant: Make) -> None:
    places = []
    for _ in range(2):
        one = faulty_plant(fault(PUT), seed=seed)
        one.plant.skill_began(SKILL)
        one.do("wait", duration=2.0)
        low, high = bounds_of_newest(one)
        places.append((low, high))
        assert low[2] == pytest.approx(0.0, abs=0.005)
        assert [high[axis] - low[axis] for axis in range(3)] == pytest.approx(PUT.box, abs=0.01)
        assert abs((low[0] + high[0]) / 2.0 - 0.45) < 0.025
        assert abs((low[1] + high[1]) / 2.0 + 0.2) < 0.025
    assert places[0] == places[1]


def test_a_box_is_put_down_only_when_the_arm_has_left_the_place(faulty_plant: Make) -> None:
    one = faulty_plant(fault(PUT))
    assert one.move(0.45, -0.2, 0.3)
    before = bounds_of_newest(one)
    one.plant.skill_began(SKILL)
    one.do("wait", duration=2.0)
    assert dist(bounds_of_newest(one)[0], before[0]) < 0.01
    assert one.move(0.45, 0.25, 0.3)
    one.do("wait", duration=2.0)
    low, _ = bounds_of_newest(one)
    assert low[2] == pytest.approx(0.0, abs=0.005)
    assert dist(low[:2], before[0][:2]) > 0.1


@pytest.mark.parametrize("kind", [PadFrictionFault(0.0, 240), GripForceFault(0.0, 240)])
def test_a_held_thing_falls_out_of_slippery_or_loose_fingers(kind: PhysicalFault, faulty_plant: Make) -> None:
    one = faulty_plant(fault(kind))
    one.hold_cube()
    one.do("wait", duration=1.0)
    assert one.value("holding")
    one.plant.skill_began(SKILL)
    one.do("wait", duration=1.5)
    assert one.value("cube_position")[2] < 0.08
    assert not one.value("holding")


def test_a_weak_arm_has_no_more_than_its_share_of_torque_and_is_strong_again(faulty_plant: Make) -> None:
    one = faulty_plant(fault(TorqueFault(0.15, 24)))

    def most(now: float, values: Mapping[str, Any]) -> None:
        one.torques.append(max(map(abs, values["joint_torque"])))

    def run(target: tuple[float, float, float]) -> bool:
        one.torques.clear()
        action = act("move_tool", target=target, yaw=0.0, speed=0.5)
        return execute(one.plant, action, most, inf).completed

    assert run((0.5, 0.0, 0.4))
    assert max(one.torques) > 0.15 * 87.0
    one.plant.skill_began(SKILL)
    run((0.5, 0.2, 0.4))
    assert max(one.torques[1:25]) <= 0.15 * 87.0 + 1e-6
    one.do("wait", duration=0.5)
    assert one.move(0.5, 0.0, 0.4)


def test_a_delayed_arm_follows_earlier_commands_and_catches_up(faulty_plant: Make) -> None:
    def places(*faults: Fault) -> list[tuple[float, ...]]:
        one, passed = faulty_plant(*faults), []
        one.plant.skill_began(SKILL)

        def note(now: float, values: Mapping[str, Any]) -> None:
            passed.append(values["joint_position"])

        action = act("move_tool", target=(0.45, 0.1, 0.45), yaw=0.0, speed=0.1)
        assert execute(one.plant, action, note, inf).completed
        assert dist(one.value("tool_position"), (0.45, 0.1, 0.45)) < 1e-3
        return passed

    in_time, late = places(), places(fault(CommandDelayFault(12, 120)))
    for tick in (60, 90, 110):
        assert dist(late[tick], in_time[tick - 12]) < 0.2 * dist(late[tick], in_time[tick])
    assert dist(late[180], in_time[180]) < 1e-3


def test_a_misread_quantity_is_noisy_while_it_lasts_and_others_are_not(faulty_plant: Make) -> None:
    one = faulty_plant(fault(SensorFault("tool_position", 120, noise=0.01)))
    one.do("wait", duration=0.25)
    calm = one.value("tool_position")
    one.plant.skill_began(SKILL)
    read: list[Mapping[str, Any]] = []
    execute(one.plant, act("wait", duration=0.4), lambda now, values: read.append(values), inf)
    off = [dist(values["tool_position"], calm) for values in read[2:]]
    # The mean length of three normal numbers is 1.6 of their deviation.
    assert 0.012 < sum(off) / len(off) < 0.02
    assert max(dist(values["base_position"], (0.0, 0.0, 0.0)) for values in read) < 1e-9
    one.do("wait", duration=0.3)
    assert dist(one.value("tool_position"), calm) < 1e-4


def test_a_dropout_leaves_the_previous_reading_which_ages(faulty_plant: Make) -> None:
    one = faulty_plant(fault(SensorFault("finger_gap", 240, dropout=1.0)))
    one.do("wait", duration=0.1)
    one.plant.skill_began(SKILL)
    one.do("wait", duration=0.5)
    assert one.plant.now() - one.plant.observe()["finger_gap"].time > 0.4


def test_somebody_enters_when_the_fault_begins(faulty_plant: Make) -> None:
    person = Person("it", (Waypoint((3.0, 0.0)), Waypoint((1.5, 0.0), speed=1.0)))
    one = faulty_plant(fault(PersonEntersFault(person)))
    one.do("wait", duration=0.5)
    assert one.value("human_distance") == 20.0
    one.plant.skill_began(SKILL)
    one.do("wait", duration=0.5)
    far = one.value("human_distance")
    one.do("wait", duration=1.0)
    assert one.value("human_distance") == pytest.approx(far - 1.0, abs=0.1)


def _looked(*kinds: PictureFault, looks: int = 1) -> tuple[list[CameraPicture], list[FaultEvent]]:
    faults = [
        replace(fault(kind, CameraOpportunity("table_top")), name=f"it {number}", max_count=1)
        for number, kind in enumerate(kinds)
    ]
    happened: list[FaultEvent] = []
    pictures = []
    injector = FaultInjector(faults, 1, happened.append)
    with closing(make_plant(shipped_scene("table"), 1, disturbance=injector)) as plant:
        for _ in range(looks):
            look = plant.begin(act("look", camera="table_top"))
            assert not isinstance(look, MotionCompletion)
            assert plant.advance(allow, inf) == {look: MotionCompletion(True)}
            pictures.append(plant.pictures()["table_top"])
    return pictures, happened


def test_a_dazzled_or_displaced_camera_delivers_another_picture() -> None:
    ((seen,), _), ((dazzled,), _) = _looked(), _looked(MissedPictureFault())
    assert set(dazzled.rgb) == {255} != set(seen.rgb)
    ((displaced,), _) = _looked(MisplacedPictureFault(0.06, None))
    assert dist(displaced.view.eye, seen.view.eye) == pytest.approx(0.06)
    assert (displaced.rgb, displaced.depth) == (seen.rgb, seen.depth)


def test_a_look_is_an_opportunity_while_the_skill_that_is_named_runs() -> None:
    injector = FaultInjector(
        (fault(MissedPictureFault(), CameraOpportunity("mast", SKILL)),), 1, lambda one: None
    )
    plant = PhysicsPlant(Cube(), 1, disturbance=injector)
    mast, hand = (
        CameraPicture(name, 0.0, 1, 1, b"abc", None, CameraView(*((0.0,) * 3,) * 3, 50.0))
        for name in ("mast", "hand")
    )
    assert injector.disturb_picture(mast) == mast
    plant.skill_began(SKILL)
    assert injector.disturb_picture(mast).rgb == b"\xff" * 3
    assert injector.disturb_picture(hand) == hand
    plant.skill_ended(SKILL, finished=True)
    assert injector.disturb_picture(mast) == mast
    plant.close()


def test_a_picture_is_one_opportunity_however_much_it_shows() -> None:
    (first, second), happened = _looked(MissedPictureFault(), looks=2)
    assert len(happened) == 1
    assert set(first.rgb) == {255} != set(second.rgb)


def test_a_fault_waits_for_something_held_and_passes_with_its_skill(faulty_plant: Make) -> None:
    one = faulty_plant(fault(PadFrictionFault(0.5, 12), SkillOpportunity(SKILL, 24, from_first_grip=True)))
    one.plant.skill_began(SKILL)
    one.do("wait", duration=0.5)
    one.plant.skill_ended(SKILL, finished=True)
    assert [happening.event for happening in one.happened] == ["fault-not-triggered"]
    one.plant.skill_began(SKILL)
    one.hold_cube()
    one.plant.skill_ended(SKILL, finished=True)
    events = [happening.event for happening in one.happened]
    assert events == ["fault-not-triggered", "fault-started", "fault-ended"]


@pytest.mark.parametrize("runs", [12, pytest.param(40, marks=pytest.mark.deep)])
def test_a_rate_of_p_bumps_in_a_share_p_of_the_runs(runs: int, faulty_plant: Make) -> None:
    rate = 0.4
    kind = ImpulseFault("cube", 0.06, 12, None)
    moved = 0
    for seed in range(runs):
        one = FaultyPlant(fault(kind, process=GilbertElliottProcess(0.0, 0.0, 1.0, 1.0, rate)), seed=seed)
        before = one.value("cube_position")
        one.plant.skill_began(SKILL)
        one.do("wait", duration=0.25)
        away = dist(one.value("cube_position"), before)
        one.plant.close()
        assert (away > 0.005) is bool(started(one))
        moved += away > 0.005
    assert abs(moved / runs - rate) < 1.96 * sqrt(rate * (1.0 - rate) / runs)


def test_faults_act_together_and_none_changes_when_another_happens(faulty_plant: Make) -> None:
    process = GilbertElliottProcess(0.0, 0.0, 1.0, 1.0, 0.5)
    first = fault(ImpulseFault("cube", 0.02, 12, None), TimedOpportunity(60), "first", process)
    second = fault(TorqueFault(0.9, 12), TimedOpportunity(48), "second", process)

    def times(*faults: Fault) -> dict[str, list[float]]:
        one = faulty_plant(*faults)
        one.do("wait", duration=5.0)
        return {
            each.name: [h.time for h in one.happened if h.event == "fault-started" and h.fault == each.name]
            for each in faults
        }

    both = times(first, second)
    assert both == times(second, first)
    assert both == {**times(first), **times(second)}
    assert all(5 < len(one) < 20 for one in both.values())


def test_of_several_faults_on_one_part_the_worst_counts_until_it_is_over(faulty_plant: Make) -> None:
    one = faulty_plant(fault(PadFrictionFault(0.5, 24), name="a"), fault(PadFrictionFault(0.2, 12), name="b"))
    frictions: list[float] = []
    robot = one.plant._robot
    assert isinstance(robot, BulletRobot)
    set_friction = robot.set_finger_friction

    def spy(friction: float) -> None:
        frictions.append(friction)
        set_friction(friction)

    robot.set_finger_friction = spy  # type: ignore[method-assign]
    one.plant.skill_began(SKILL)
    one.do("wait", duration=0.25)
    assert frictions == [0.2, 0.5, 1.0]
