"""Ways round an obstacle for the reference robot, planned without physics, decided by the site's policy."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import cos, sin
from typing import Any, cast

import pytest

from aeros.runtime.execution.detour_search import DetourSearch, _tool_at_start
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind, Reason
from aeros.runtime.gate.port import Gate
from aeros.runtime.motion.base_contact import box_corners, enlarged_obstacle
from aeros.runtime.motion.detour import find_base_detour
from aeros.runtime.motion.trajectory import OBSTRUCTED, MotionDecider
from aeros.runtime.ports import Obstacle, Plant, Reading, RobotBody, Trajectory, plan_sequence
from aeros.sim.kinematic.plant import make_plant
from aeros.skill import Action, act
from aeros.spec.scenes.load import load_scene
from tests.shipped_scenes import shipped_scene
from tests.unit.runtime.one_step import FakeGate
from tests.unit.runtime.perception.kettle import site

CALLER = Caller("handling", "lift", {})
OBSTRUCTION = Decision(DecisionKind.DENY, None, (Reason(OBSTRUCTED, "box", "in the way"),))


class Obstructed:
    """A plant with an obstacle, in front of whose wall the arm is."""

    def __init__(self, plant: Any, box: Obstacle) -> None:
        self._plant, self._box = plant, box

    def obstacles(self) -> tuple[Obstacle, ...]:
        return (self._box,)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._plant, name)


@pytest.fixture(scope="module")
def robot() -> Iterator[Any]:
    plant = make_plant(load_scene("bare"), 0)
    yield plant
    plant.close()


def box(*place: float) -> Obstacle:
    x, y, height = place
    return Obstacle("box", (x - 0.05, y - 0.05, 0.0), (x + 0.05, y + 0.05, height), 0.0, "overhead", "bench")


def to(x: float, y: float, z: float) -> Action:
    return act("move_tool", target=(x, y, z), yaw=0.0, speed=0.2)


def searching(
    robot: Any, obstacle: Obstacle, *answers: Decision
) -> tuple[DetourSearch, Plant, MotionDecider]:
    plant = cast("Plant", Obstructed(robot, obstacle))
    gate, motions = FakeGate(site()), MotionDecider(site().motion)
    gate.answers += answers
    readings = plant.observe()
    search = DetourSearch(site().motion, cast("Gate", gate), motions, plant, readings, plant.now(), {})
    return search, plant, motions


def test_a_way_leads_round_a_box_and_every_leg_of_it_is_allowed(robot: Any) -> None:
    obstacle, target = box(0.45, -0.2, 0.4), to(0.45, -0.45, 0.3)
    search, plant, motions = searching(robot, obstacle)
    straight = plant.plan(target)
    allowed = Decision(DecisionKind.ALLOW, target, ())
    denied = motions.decide(allowed, straight, plant.observe(), (), (obstacle,))
    assert [reason.code for reason in denied.reasons] == [OBSTRUCTED]
    found = search.find(CALLER, denied, target)
    assert found is not None
    assert found.legs[-1] is target
    assert [leg.parameters["target"] for leg in found.legs] == found.targets
    readings = dict(plant.observe())
    for leg, plan in zip(found.legs, plan_sequence(plant, found.legs) or (), strict=True):
        assert isinstance(plan, Trajectory)
        readings["joint_position"] = readings["joint_position"]._replace(value=plan.joint_paths[0][0][0])
        decided = Decision(DecisionKind.ALLOW, leg, ())
        assert motions.decide(decided, plan, readings, (), (obstacle,)) is decided
    again = search.find(CALLER, denied, target)
    assert again == found, "equal worlds give equal ways"


def test_there_is_no_way_to_a_target_at_the_obstacle(robot: Any) -> None:
    search, *_ = searching(robot, box(0.45, -0.2, 0.4))
    assert search.find(CALLER, OBSTRUCTION, to(0.45, -0.2, 0.2)) is None


def test_only_an_obstacle_is_gone_round(robot: Any) -> None:
    other = Decision(DecisionKind.DENY, None, (*OBSTRUCTION.reasons, Reason("AE762", "tool", "too fast")))
    obstacle, target = box(0.45, -0.2, 0.4), to(0.45, -0.45, 0.3)
    assert searching(robot, obstacle)[0].find(CALLER, other, target) is None
    assert searching(robot, obstacle)[0].find(CALLER, Decision(DecisionKind.DENY, None, ()), target) is None
    denial = Decision(DecisionKind.DENY, None, (Reason("AE750", "workspace", "outside"),))
    assert searching(robot, obstacle, denial)[0].find(CALLER, OBSTRUCTION, target) is None
    drive = act("move_base", x=0.0, y=0.1, speed=0.1)
    assert searching(robot, obstacle)[0].find(CALLER, OBSTRUCTION, drive) is None


def test_a_plant_that_cannot_plan_ahead_is_led_round_nothing(robot: Any) -> None:
    search, plant, _ = searching(robot, box(0.45, -0.2, 0.4))
    cast("Any", plant).plan_sequence = lambda actions: None
    assert search.find(CALLER, OBSTRUCTION, to(0.45, -0.45, 0.3)) is None


def test_a_way_has_a_leg_to_each_target_and_ends_with_the_action_itself(
    robot: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    search, plant, _ = searching(robot, box(0.45, -0.2, 0.4))
    starts: list[Any] = []
    gate = cast("FakeGate", search._gate)
    targets = [(0.5, 0.1, 0.5), (0.5, -0.3, 0.5), (0.45, -0.45, 0.3)]

    def find(start: Any, target: Any, base: Any, boxes: Any, is_allowed: Any, failing_leg: Any) -> Any:
        starts.append(start)
        assert (target, len(boxes)) == (targets[-1], 1)
        gate.answers += [Decision(DecisionKind.ALLOW, action, ()), OBSTRUCTION]
        assert [is_allowed(place) for place in targets[:2]] == [True, False]
        assert failing_leg([targets[0], (3.0, 0.0, 0.0)]) == 1  # out of reach
        return targets

    monkeypatch.setattr("aeros.runtime.execution.detour_search.find_detour", find)
    action = to(0.45, -0.45, 0.3)
    found = search.find(CALLER, OBSTRUCTION, action)
    assert found is not None
    assert (found.targets, found.legs) == (targets, [to(*targets[0]), to(*targets[1]), action])
    assert found.legs[2] is action
    assert [asked[0] for asked in gate.asked] == [CALLER] * len(gate.asked)
    assert [asked[2] for asked in gate.asked] == [action, to(*targets[0]), to(*targets[1]), to(*targets[0])]
    assert all(asked[1] == search._readings for asked in gate.asked[:3])
    assert all(asked[3:] == (plant.now(), {}) for asked in gate.asked)
    assert starts == [pytest.approx(plant.observe()["tool_position"].value, abs=1e-6)]


def test_a_way_begins_where_the_tool_is_at_the_start_of_the_plan() -> None:
    bent = ((0.1, 0.2), (0.3, 0.4), (0.5, 0.6), (0.7, 0.8))
    body = RobotBody(((0.0, 0.0, 0.0), (0.5, 0.0, 0.0)), (0.5, 0.0, 0.0), ())
    later = (bent[1], bent[2], bent[3], bent[0])
    plan = Trajectory(body, ((bent, later), (later, bent)), (1.0, 2.0, 3.0), (0.0, 0.0, 0.0), 1.0)
    expected = (1.0 + 0.5 * cos(0.1) + 0.5 * cos(0.3), 2.0 + 0.5 * sin(0.1) + 0.5 * sin(0.3), 3.0)
    assert _tool_at_start(plan) == pytest.approx(expected)


def test_a_base_is_led_round_what_stands_in_the_aisle(monkeypatch: pytest.MonkeyPatch) -> None:
    kept_out: list[Any] = []

    def find(start: Any, target: Any, boxes: Any, *checks: Any) -> Any:
        kept_out.extend((one.lower, one.upper) for one in boxes)
        return find_base_detour(start, target, boxes, *checks)

    monkeypatch.setattr("aeros.runtime.execution.detour_search.find_base_detour", find)
    driving = make_plant(shipped_scene("fetch"), 0)
    lower, upper = (-0.1, 1.1, -0.3), (0.1, 1.3, -0.15)
    obstacle = Obstacle("box", lower, upper, 0.0, "aisle_top", "aisle_floor")
    target = act("move_base", x=0.0, y=2.3, speed=0.4)
    search, plant, motions = searching(driving, obstacle)
    readings = dict(plant.observe())
    allowed = Decision(DecisionKind.ALLOW, target, ())
    denied = motions.decide(allowed, plant.plan(target), readings, (), (obstacle,))
    (reason,) = denied.reasons
    assert (reason.code, reason.rule) == (OBSTRUCTED, "box")
    assert reason.text.startswith("`base` may come nearer than 15 mm to box at (0.00, 1.20) m in aisle_floor")
    found = search.find(CALLER, denied, target)
    assert found is not None
    assert found.legs[-1] is target
    assert len(found.legs) > 1
    assert [(leg.parameters["x"], leg.parameters["y"]) for leg in found.legs] == [
        end[:2] for end in found.targets
    ]
    for leg, plan in zip(found.legs, plan_sequence(plant, found.legs) or (), strict=True):
        assert isinstance(plan, Trajectory)
        readings["base_position"] = readings["base_position"]._replace(value=plan.base)
        decided = Decision(DecisionKind.ALLOW, leg, ())
        assert motions.decide(decided, plan, readings, (), (obstacle,)) is decided
    at_it = act("move_base", x=0.0, y=1.5, speed=0.4)
    assert search.find(CALLER, OBSTRUCTION, at_it) is None, "no way leads to a place at the obstacle"
    joints = {f"q{number}": 0.1 for number in range(1, 8)}
    posture = act("move_joints", **joints, speed=0.1)
    assert search.find(CALLER, OBSTRUCTION, posture) is None, "it leads to no place"
    policy = site().motion
    assert policy is not None
    assert policy.obstacles is not None
    assert policy.obstacles.base is not None
    own, clearance = box_corners(policy.obstacles.base), float(policy.clearance)
    assert kept_out == [enlarged_obstacle(own, obstacle, clearance)]
    search._motion = replace(policy, obstacles=None)
    assert search.find(CALLER, denied, target) is None, "the site compares its base with nothing"
    driving.close()


def test_each_leg_is_decided_where_those_before_it_end(robot: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    search, plant, _ = searching(robot, box(2.0, 2.0, 0.4))
    now, policy = plant.now(), site().motion
    assert policy is not None
    at_first = Reading(search._readings["base_position"].value, now - 0.01)
    search._readings = {**search._readings, "base_position": at_first}
    seen: list[tuple[Any, ...]] = []
    answers = [DecisionKind.ALLOW] * 3 + [DecisionKind.ALLOW, DecisionKind.DENY]

    def decide(caller: Caller, readings: Any, action: Action, *rest: Any) -> Decision:
        seen.append((caller, dict(readings), action, *rest))
        kind = answers.pop(0)
        return OBSTRUCTION if kind is DecisionKind.DENY else Decision(kind, action, ())

    monkeypatch.setattr(search._gate, "decide", decide)
    legs = [to(0.5, 0.1, 0.5), to(0.5, -0.1, 0.5), to(0.5, 0.0, 0.4)]
    assert search._failing_leg(policy, CALLER, legs) is None
    plans = plan_sequence(plant, legs) or ()
    for number, (leg, plan) in enumerate(zip(legs, plans, strict=True)):
        assert isinstance(plan, Trajectory)
        base = Reading(plan.base, now) if number else at_first
        joints = Reading(plan.joint_paths[0][0][0], now)
        readings = {**search._readings, "joint_position": joints, "base_position": base}
        assert seen[number] == (CALLER, readings, leg, now, {})
    assert search._failing_leg(policy, CALLER, legs) == 1, "the gate denies the second"
    answers += [DecisionKind.ALLOW] * 3
    cast("Any", plant).plan_sequence = lambda actions: plans[:1]
    assert search._failing_leg(policy, CALLER, legs) == 1, "the plant has no plan for the second"


def test_there_is_no_way_to_a_target_at_which_the_held_object_meets_the_obstacle(
    robot: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("aeros.runtime.execution.detour_search.find_detour", lambda *_: [(0.0, 0.0, 0.0)])
    search, *_ = searching(robot, box(0.45, -0.2, 0.2))
    found = []
    for is_held in (False, True):
        search._readings = {**search._readings, "holding": Reading(is_held, 0.0)}
        found.append(search.find(CALLER, OBSTRUCTION, to(0.45, -0.2, 0.25)) is not None)
    assert found == [True, False]
