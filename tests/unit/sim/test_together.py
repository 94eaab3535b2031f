"""Several motions at the same time: each goes on as it would alone, and one that is halted comes to rest."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from math import inf
from typing import Any

import numpy as np
import pytest

from aeros.runtime.gate.decision import Decision, DecisionKind
from aeros.runtime.motion.merged import ConcurrentMotion, merge_motions
from aeros.runtime.motion.swept_volume import BarrierBox, MergedMotion, find_breach
from aeros.runtime.motion.trajectory import MotionDecider
from aeros.runtime.ports import Ball, MotionCompletion, MotionHandle, PlannedMotion, RobotBody, Trajectory
from aeros.sim.clock import TICK
from aeros.sim.physics import PhysicsPlant
from aeros.sim.robot.robot import BASE_ACCELERATION_MAX
from aeros.skill import Action, act
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.expr.scope import AxisAlignedBox as Volume
from aeros.spec.model.motion import Barrier, MotionPolicy
from aeros.spec.text.discovery import reference_site_path
from tests.unit.sim.acting import allow, recording
from tests.unit.sim.robot.panda import PANDA_BODY

DRIVE = act("move_base", x=-0.4, y=0.3, speed=0.4)
OPEN = act("grip", width=0.02, force=10.0)

pytestmark = pytest.mark.physics

SCENE = "fetch"
"""Of the fixture `plant`."""


def begin(plant: PhysicsPlant, action: Action) -> MotionHandle:
    motion = plant.begin(action)
    assert not isinstance(motion, MotionCompletion)
    return motion


def test_the_fingers_close_while_the_base_drives_and_both_arrive(plant: PhysicsPlant) -> None:
    drive, grip = begin(plant, DRIVE), begin(plant, OPEN)
    log: list[Mapping[str, Any]] = []
    assert plant.advance(recording(log), inf) == {grip: MotionCompletion(True)}
    assert log[-1]["finger_gap"] == pytest.approx(0.02, abs=1e-3)
    assert 0.0 < math.dist(log[-1]["base_position"], log[0]["base_position"]) < 0.5
    ticks = len(log)
    assert plant.advance(recording(log), inf) == {drive: MotionCompletion(True)}
    assert math.dist(log[-1]["base_position"][:2], (-0.4, 0.3)) < 1e-3
    # Each tick was one of both: the second `advance` looks once more before it goes on.
    assert plant.now() == pytest.approx((len(log) - 2) * TICK)
    assert ticks > 50


def test_a_drive_that_is_halted_comes_to_rest_within_limits_while_the_fingers_go_on(
    plant: PhysicsPlant,
) -> None:
    drive, grip = begin(plant, DRIVE), begin(plant, OPEN)
    log: list[Mapping[str, Any]] = []
    assert plant.advance(recording(log), 0.3) == {}
    assert plant.now() == pytest.approx(0.3)
    sent: list[Any] = []
    command = plant._robot.command_base

    def spy(xy: Any, speed: Any) -> None:
        sent.append(speed)
        command(xy, speed)

    plant._robot.command_base = spy  # type: ignore[method-assign]
    plant.halt(drive)
    first = plant.advance(recording(log), inf)
    second = plant.advance(recording(log), inf)
    assert {**first, **second} == {drive: MotionCompletion(False, "halted"), grip: MotionCompletion(True)}
    slower = np.linalg.norm(sent, axis=1)
    assert slower[-1] == 0.0
    assert (np.diff(slower) <= 1e-12).all()
    assert (np.linalg.norm(np.diff(sent, axis=0), axis=1) / TICK <= 1.01 * BASE_ACCELERATION_MAX).all()
    assert log[-1]["finger_gap"] == pytest.approx(0.02, abs=1e-3)


def test_halting_a_motion_affects_only_the_parts_it_moves(plant: PhysicsPlant) -> None:
    drive = begin(plant, DRIVE)
    wait = begin(plant, act("wait", duration=30.0))
    assert plant.advance(allow, 0.3) == {}
    plant.halt(wait)
    assert plant.advance(allow, inf) == {wait: MotionCompletion(False, "halted")}
    assert plant.advance(allow, inf) == {drive: MotionCompletion(True)}
    assert math.dist(plant.observe()["base_position"].value[:2], (-0.4, 0.3)) < 1e-3


def test_a_rule_that_breaks_ends_both_at_rest(plant: PhysicsPlant) -> None:
    drive, grip = begin(plant, DRIVE), begin(plant, OPEN)
    halted = MotionCompletion(False, "monitor:near")
    assert plant.advance(lambda now, _: "near" if now > 0.3 else None, inf) == {drive: halted, grip: halted}
    before = plant.observe()["base_position"].value
    wait = begin(plant, act("wait", duration=0.5))
    assert plant.advance(allow, inf) == {wait: MotionCompletion(True)}
    assert math.dist(plant.observe()["base_position"].value, before) < 1e-3


def test_a_blocked_motion_ends_both(plant: PhysicsPlant) -> None:
    drive, look = begin(plant, DRIVE), begin(plant, act("wait", duration=30.0))
    assert plant.advance(allow, 0.3) == {}
    plant._robot.q_command = plant._robot.q_command + 0.1  # as if something held the arm back
    ended = plant.advance(allow, inf)
    assert set(ended) == {drive, look}
    assert {str(one.reason).partition(":")[0] for one in ended.values()} == {"blocked"}


# The arm while the base drives.

AHEAD = act("move_base", x=0.3, y=0.1, speed=0.2)
STOW = act("move_tool", target=(0.72, 0.1, 0.4), yaw=0.0, speed=0.45)


@pytest.fixture(scope="module")
def policy() -> MotionPolicy:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    assert site.motion is not None
    return site.motion


def decided(
    plant: PhysicsPlant, policy: MotionPolicy, action: Action, *others: ConcurrentMotion
) -> tuple[PlannedMotion, list[tuple[str, str]]]:
    plan = plant.plan(action)
    allowed = Decision(DecisionKind.ALLOW, action, ())
    found = MotionDecider(policy).decide(allowed, plan, plant.observe(), others)
    return plan, [(reason.code, reason.rule) for reason in found.reasons]


def drives_for(plant: PhysicsPlant, policy: MotionPolicy, drive: Action, seconds: float) -> ConcurrentMotion:
    """A base that has been driving for some time."""
    plan, reasons = decided(plant, policy, drive)
    assert reasons == []
    assert isinstance(plan, Trajectory)
    assert not isinstance(plant.begin(drive, plan), MotionCompletion)
    assert plant.advance(allow, seconds) == {}
    return ConcurrentMotion(drive, plan, plant.now())


def test_the_arm_stows_while_the_base_drives_and_reaches_its_target(
    plant: PhysicsPlant, policy: MotionPolicy
) -> None:
    driving = drives_for(plant, policy, AHEAD, 0.5)
    plan, reasons = decided(plant, policy, STOW, driving)
    assert reasons == []
    stow = plant.begin(STOW, plan)
    log: list[Mapping[str, Any]] = []
    assert plant.advance(recording(log), inf) == {stow: MotionCompletion(True)}
    assert math.dist(log[-1]["tool_position"], (0.72, 0.1, 0.4)) < 2e-3
    assert [list(one.values()) for one in (plant.advance(recording(log), inf),)] == [[MotionCompletion(True)]]
    assert math.dist(log[-1]["base_position"][:2], (0.3, 0.1)) < 1e-3
    # Both moved at once, and together no faster than was decided of the tool.
    speeds = [one["tool_speed"] for one in log]
    assert 0.3 < max(speeds) < 0.45
    moved = math.dist(log[120]["base_position"], log[0]["base_position"])
    assert 0.02 < moved < math.dist(log[120]["tool_position"], log[0]["tool_position"]) - 0.02


def test_the_decided_motion_encloses_the_motion_of_both(plant: PhysicsPlant, policy: MotionPolicy) -> None:
    driving = drives_for(plant, policy, AHEAD, 0.5)
    plan, _ = decided(plant, policy, STOW, driving)
    assert isinstance(plan, Trajectory)
    merged = merge_motions(plan, [driving])
    assert isinstance(merged, MergedMotion)
    plant.begin(STOW, plan)
    log: list[Mapping[str, Any]] = []
    while plant._under_way:
        plant.advance(recording(log), inf)
    tools = [one["tool_position"] for one in log]
    # A wall just beyond where the tool ever was is clear of it by that, and one nearer is not.
    tool = RobotBody(
        PANDA_BODY.dh_rows, PANDA_BODY.tool_offset, (Ball("tool", 7, PANDA_BODY.tool_offset, 0.0),)
    )
    moving = merged.swept_motion()._replace(body=tool)
    for axis, side in ((0, 1.0), (1, 1.0), (1, -1.0), (2, 1.0)):
        farthest = max(side * p[axis] for p in tools)
        for beyond, is_clear in ((0.06, True), (-0.01, False)):
            lower, upper = [-9.0] * 3, [9.0] * 3
            (lower if side > 0.0 else upper)[axis] = side * (farthest + beyond)
            box = BarrierBox("wall", tuple(lower), tuple(upper), False, False, None)  # type: ignore[arg-type]
            assert (find_breach(moving, [box], 0.0) is None) is is_clear, (axis, side, beyond)


def test_motions_allowed_alone_are_denied_if_together_they_hit_a_barrier(
    plant: PhysicsPlant, policy: MotionPolicy
) -> None:
    wall = Barrier("off-the-wall", "wall", _wall(0.8), False, False, None, "a wall")
    walled = replace(policy, barriers=(*policy.barriers, wall))
    here = act("move_tool", target=(0.6, 0.0, 0.4), yaw=0.0, speed=0.45)
    assert decided(plant, walled, here)[1] == []
    driving = drives_for(plant, walled, act("move_base", x=0.2, y=0.0, speed=0.2), 0.2)
    there = act("move_tool", target=(0.8, 0.0, 0.4), yaw=0.0, speed=0.45)
    assert decided(plant, walled, there, driving)[1] == [("AE763", "off-the-wall")]
    assert decided(plant, policy, there, driving)[1] == []


def _wall(x: float) -> Volume:
    lower, upper = (Fraction(x), Fraction(-3), Fraction(-3)), (Fraction(9), Fraction(3), Fraction(3))
    return Volume(lower, upper)


def test_a_base_may_not_drive_off_with_a_tool_that_was_asked_to_be_somewhere(
    plant: PhysicsPlant, policy: MotionPolicy
) -> None:
    here = act("move_tool", target=(0.5, 0.1, 0.4), yaw=0.0, speed=0.2)
    plan, reasons = decided(plant, policy, here)
    assert reasons == []
    assert isinstance(plan, Trajectory)
    plant.begin(here, plan)
    assert plant.advance(allow, 0.2) == {}
    moving = ConcurrentMotion(here, plan, plant.now())
    assert ("AE761", "target") in decided(plant, policy, AHEAD, moving)[1]


def test_an_arm_whose_base_is_halted_misses_its_target(plant: PhysicsPlant, policy: MotionPolicy) -> None:
    driving = drives_for(plant, policy, AHEAD, 0.5)
    plan, _ = decided(plant, policy, STOW, driving)
    stow = plant.begin(STOW, plan)
    assert plant.advance(allow, 0.8) == {}
    drive = next(motion for motion in plant._under_way if motion != stow)
    plant.halt(drive)
    assert plant.advance(allow, inf) == {drive: MotionCompletion(False, "halted")}
    ended = plant.advance(allow, inf)
    assert isinstance(stow, int)
    assert (ended[stow].reason or "").startswith("blocked: the tool stopped")


def test_actions_impossible_while_the_base_drives_are_refused(
    plant: PhysicsPlant, policy: MotionPolicy
) -> None:
    drives_for(plant, policy, AHEAD, 0.5)
    for action, reason in (
        (act("move_tool", target=(0.72, 0.1, 0.4), yaw=0.0, speed=0.2), "the base alone moves the tool"),
        (act("slide", target=(0.72, 0.1, 0.4), force=5.0, speed=0.1), "not allowed while the base drives"),
    ):
        plan = plant.plan(action)
        assert isinstance(plan, MotionCompletion)
        assert reason in (plan.reason or "")
