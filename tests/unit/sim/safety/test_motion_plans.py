"""The physics plant executes its planned motions exactly, and the reference site accepts them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from aeros.runtime.gate.compiled.rules import MonitorRules
from aeros.runtime.gate.decision import Decision, DecisionKind
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.monitor.history import HistoryTracker
from aeros.runtime.monitor.monitor import RuntimeMonitor
from aeros.runtime.motion.kinematic_bounds import ForwardKinematics
from aeros.runtime.motion.trajectory import MotionDecider
from aeros.runtime.ports import MotionCompletion, NoMotion, Trajectory
from aeros.sim.clock import TICK
from aeros.sim.physics import PhysicsPlant
from aeros.sim.robot.kinematics import forward_kinematics
from aeros.sim.robot.profile import minimum_jerk
from aeros.skill import Action, act
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from tests.unit.sim.acting import allow, execute, recording
from tests.unit.sim.robot.panda import PANDA, PANDA_BODY, Q_MAX, Q_MIN, QD_MAX, READY_POSTURE

pytestmark = pytest.mark.physics

SCENE = "bare"
"""Of the fixture `plant`."""

FOREVER = 1e9
MOVE = act("move_tool", target=(0.5, 0.2, 0.1), yaw=0.5, speed=0.25)


@pytest.fixture(scope="module")
def site() -> Site:
    found = load_site(reference_site_path(), Diagnostics())
    assert found is not None
    return found


# The body.


def test_both_kinematics_put_the_tool_in_the_same_place() -> None:
    chance = np.random.default_rng(0)
    for q in chance.uniform(Q_MIN, Q_MAX, (50, 7)):
        expected = forward_kinematics(PANDA, q[None, :])[0][0]
        assert (
            math.dist(
                ForwardKinematics(PANDA_BODY, q.tolist()).frames[-1].to_base(PANDA_BODY.tool_offset), expected
            )
            < 1e-12
        )


# What is decided is what is done.


def test_the_set_points_of_a_move_are_those_of_the_trajectory_that_was_decided(plant: PhysicsPlant) -> None:
    plan = plant.plan(MOVE)
    assert isinstance(plan, Trajectory)
    sent: list[Any] = []
    command = plant._robot.command

    def spy(q: Any, qd: Any) -> None:
        sent.append(q)
        command(q, qd)

    plant._robot.command = spy  # type: ignore[method-assign]
    assert execute(plant, MOVE, allow, FOREVER, plan).completed
    ticks = round(plan.duration / TICK)
    pieces = np.array(plan.joint_paths[0])
    s = minimum_jerk(np.arange(1, ticks + 1) / ticks)[0]
    index = np.minimum((s * len(pieces)).astype(int), len(pieces) - 1)
    u = (s * len(pieces) - index)[:, None]
    a, b, c, d = (pieces[index, corner] for corner in range(4))
    expected = (1 - u) ** 3 * a + 3 * (1 - u) ** 2 * u * b + 3 * (1 - u) * u**2 * c + u**3 * d
    assert np.abs(np.array(sent[:ticks]) - expected).max() < 1e-12


def test_a_motion_that_was_planned_elsewhere_or_earlier_is_refused_before_motion(plant: PhysicsPlant) -> None:
    plan = plant.plan(MOVE)
    assert execute(plant, act("wait", duration=0.1), allow, FOREVER).completed
    before = plant.now()
    for stale in (plan, NoMotion("a guess")):
        ended = execute(plant, MOVE, allow, FOREVER, stale)
        assert not ended.completed
        assert (ended.reason or "").startswith("stale")
    assert plant.now() == before


def test_planning_moves_nothing_and_refuses_impossible_actions(plant: PhysicsPlant) -> None:
    assert isinstance(plant.plan(act("grip", width=0.08, force=5.0)), NoMotion)
    far = plant.plan(act("move_tool", target=(0.9, 0.5, 0.3), yaw=0.0, speed=0.25))
    assert isinstance(far, MotionCompletion)
    assert (far.reason or "").startswith("unreachable")
    assert plant.now() == 0.0


@pytest.mark.parametrize("speed", [0.05, 0.25, 0.5])
def test_the_reference_site_allows_the_plans_of_the_plant(
    plant: PhysicsPlant, site: Site, speed: float
) -> None:
    decider = MotionDecider(site.motion)
    for target, yaw in (((0.5, 0.2, 0.1), 0.0), ((0.4, -0.3, 0.3), 1.0), ((0.55, 0.1, 0.02), -0.5)):
        action = act("move_tool", target=target, yaw=yaw, speed=speed)
        plan = plant.plan(action)
        decision = decider.decide(Decision(DecisionKind.ALLOW, action, ()), plan, plant.observe())
        assert decision.reasons == ()
        assert execute(plant, action, allow, FOREVER, plan).completed


def to_joints(q: np.ndarray[Any, Any], speed: float) -> Action:
    return act("move_joints", **{f"q{joint}": float(one) for joint, one in enumerate(q, 1)}, speed=speed)


@pytest.mark.parametrize("speed", [0.05, 0.25, 0.5])
def test_joints_move_as_the_reference_site_allows_and_no_faster_than_asked(
    plant: PhysicsPlant, site: Site, speed: float
) -> None:
    decider, chance = MotionDecider(site.motion), np.random.default_rng(1)
    for _ in range(3):
        q = np.clip(READY_POSTURE + chance.uniform(-0.4, 0.4, 7), Q_MIN, Q_MAX)
        action = to_joints(q, speed)
        plan = plant.plan(action)
        assert isinstance(plan, Trajectory)
        assert plan.joint_paths[0][-1][3] == pytest.approx(q.tolist(), abs=1e-12)
        decision = decider.decide(Decision(DecisionKind.ALLOW, action, ()), plan, plant.observe())
        assert decision.reasons == ()
        log: list[Mapping[str, Any]] = []
        assert execute(plant, action, recording(log), FOREVER, plan).completed
        assert max(one["tool_speed"] for one in log) <= 1.02 * speed
        assert np.abs(np.array(log[-1]["joint_position"]) - q).max() < 1e-3


def test_a_joint_is_not_asked_beyond_its_limits(plant: PhysicsPlant, site: Site) -> None:
    for joint, limit in ((0, Q_MAX[0] + 1e-3), (3, Q_MAX[3] + 1e-3), (5, Q_MIN[5] - 1e-3), (6, math.nan)):
        q = np.array(READY_POSTURE)
        q[joint] = limit
        plan = plant.plan(to_joints(q, 0.25))
        assert isinstance(plan, MotionCompletion)
        assert f"`q{joint + 1}`" in str(plan.reason)
    below = np.array(READY_POSTURE)
    below[[1, 3]] = 1.5, -1.2
    assert ("AE763", "links-off-the-bench") in _denied(plant, site, to_joints(below, 0.25))


def _denied(plant: PhysicsPlant, site: Site, action: Action) -> list[tuple[str, str]]:
    decision = Decision(DecisionKind.ALLOW, action, ())
    found = MotionDecider(site.motion).decide(decision, plant.plan(action), plant.observe())
    return [(reason.code, reason.rule) for reason in found.reasons]


def test_a_target_at_which_the_hand_would_hit_the_bench_is_denied(plant: PhysicsPlant, site: Site) -> None:
    low = act("move_tool", target=(0.5, 0.1, -0.03), yaw=0.0, speed=0.25)
    assert ("AE763", "links-off-the-bench") in _denied(plant, site, low)


def test_a_way_through_the_arms_own_column_is_denied(plant: PhysicsPlant, site: Site) -> None:
    around = act("move_tool", target=(0.0, 0.3, 0.3), yaw=0.0, speed=0.25)
    assert _denied(plant, site, around) == [("AE763", "off-the-column")]


# A violation is a protective stop within one tick.


def _runaway(rates: list[float]) -> Callable[[PhysicsPlant], None]:
    """From 0.25 s on, an arm whose drives accelerate to these joint speeds whatever their set points."""

    def fault(plant: PhysicsPlant) -> None:
        command = plant._robot.command
        state: dict[str, Any] = {"q": READY_POSTURE.copy(), "qd": np.zeros(7)}

        def run_away(q: Any, qd: Any) -> None:
            if plant._world.ticks < 60 or state.get("stopped"):
                command(q, qd)
                if plant._world.ticks < 60:
                    state["q"] = q
                return
            limit = 8.0 * TICK
            state["qd"] = state["qd"] + np.clip(np.array(rates) - state["qd"], -limit, limit)
            state["q"] = state["q"] + state["qd"] * TICK
            command(state["q"], state["qd"])

        halt = plant._come_to_rest

        def come_to_rest(ask: Callable[[], str | None]) -> None:
            state["stopped"] = True
            halt(ask)

        plant._robot.command = run_away  # type: ignore[method-assign]
        plant._come_to_rest = come_to_rest  # type: ignore[method-assign]

    return fault


def _approach(plant: PhysicsPlant) -> None:
    """Somebody walks up to the arm at 1.6 m/s."""
    measure = plant._fast_values

    def walked() -> dict[str, Any]:
        return {**measure(), "human_distance": max(0.0, 2.0 - 1.6 * plant.now())}

    plant._fast_values = walked  # type: ignore[method-assign]


def _too_near(values: Mapping[str, Any]) -> bool:
    # S at 0.1 m/s: 1.6·(0.105 + 0.34) + 0.1·0.105 + 0.1·0.34/2 + 0.1 + 0.05 + 0.01 m.
    return bool(values["human_distance"] < 0.8995)


@pytest.mark.parametrize(
    ("fault", "violated", "rule"),
    [
        (
            _runaway([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 4.0]),
            lambda values: bool((np.abs(values["joint_velocity"]) > QD_MAX).any()),
            "joint-speeds",
        ),
        (
            _runaway([2.1, -2.1, 0.0, 2.1, 0.0, 2.5, 0.0]),
            lambda values: values["tool_speed"] > 1.7,
            "tool-speed",
        ),
        (_approach, _too_near, "arm-separation"),
    ],
    ids=["joint speed", "tool speed", "separation"],
)
def test_a_violation_is_a_protective_stop_within_one_tick(
    plant: PhysicsPlant,
    site: Site,
    fault: Callable[[PhysicsPlant], None],
    violated: Callable[[Mapping[str, Any]], bool],
    rule: str,
) -> None:
    action = act("move_tool", target=(0.45, 0.1, 0.35), yaw=0.0, speed=0.1)
    fault(plant)
    # A fault this sudden changes torques faster than their limit, which is a violation of its own.
    site = replace(site, rules=tuple(rule for rule in site.rules if rule.id != "joint-torque-rates"))
    watch = RuntimeMonitor(MonitorRules(site), HistoryTracker(site))
    watch.add(ActiveAction(action, plant.observe(), plant.now(), 0))
    violations: list[int] = []
    stops: list[int] = []
    halt = plant._come_to_rest

    def monitor(now: float, values: Mapping[str, Any]) -> str | None:
        if violated(values):
            violations.append(plant._world.ticks)
        return watch(now, values)

    def come_to_rest(ask: Callable[[], str | None]) -> None:
        stops.append(plant._world.ticks)
        halt(ask)

    plant._come_to_rest = come_to_rest  # type: ignore[method-assign]
    ended = execute(plant, action, monitor, FOREVER)
    assert ended.reason == f"monitor:{rule}"
    assert violations[0] > 0
    # Stopped once, in the tick it was first measured in; seen once in each tick that it lasts while braking.
    assert stops == violations[:1]
    assert violations == sorted(set(violations))
    assert max(map(abs, plant.observe()["joint_velocity"].value)) < 0.02


# The arm against itself.

FOLD = act("move_joints", q1=0.0, q2=-0.785, q3=0.0, q4=-2.356, q5=0.0, q6=0.05, q7=-0.8, speed=0.3)
"""All joints stay inside their limits, and the hand ends 56 mm inside the forearm."""


def _decide(plant: PhysicsPlant, site: Site, action: Action) -> Decision:
    allowed = Decision(DecisionKind.ALLOW, action, ())
    return MotionDecider(site.motion).decide(allowed, plant.plan(action), plant.observe())


def test_a_motion_that_folds_the_hand_into_the_forearm_is_denied(plant: PhysicsPlant, site: Site) -> None:
    found = _decide(plant, site, FOLD)
    assert [(reason.code, reason.rule) for reason in found.reasons] == [("AE765", "link5-link7")]
    assert found.reasons[0].text.startswith("`link7` may come within ")
    shorter = act("move_joints", **{**FOLD.parameters, "q6": 1.0})
    assert _decide(plant, site, shorter).kind is DecisionKind.ALLOW


def test_a_motion_that_passes_through_a_link_on_its_way_is_denied(plant: PhysicsPlant, site: Site) -> None:
    # Between two turns of the wrist, at both of which it is clear, the hand would pass through the forearm.
    one, other = ({**FOLD.parameters, "q6": 0.7, "q7": turn} for turn in (1.0, -2.0))
    assert _decide(plant, site, act("move_joints", **one)).kind is DecisionKind.ALLOW
    assert execute(plant, act("move_joints", **one), allow, FOREVER).completed
    found = _decide(plant, site, act("move_joints", **other))
    assert [reason.code for reason in found.reasons] == ["AE765"]
    # The way around it: lift the wrist first.
    for bent in (one, other):
        lifted = act("move_joints", **{**bent, "q6": 1.5})
        assert _decide(plant, site, lifted).kind is DecisionKind.ALLOW
        assert execute(plant, lifted, allow, FOREVER).completed
    assert _decide(plant, site, act("move_joints", **other)).kind is DecisionKind.ALLOW


def test_the_simulated_arm_does_not_pass_through_itself(plant: PhysicsPlant) -> None:
    ended = execute(plant, FOLD, allow, FOREVER)
    assert not ended.completed
    assert ended.reason is not None
    assert ended.reason.startswith("blocked: the arm is held back")
