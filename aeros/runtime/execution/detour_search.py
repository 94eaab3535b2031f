"""Search for a way round obstacles, on the state in which a straight motion of tool or base was denied."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from aeros.runtime.gate.decision import Caller, Decision, DecisionKind
from aeros.runtime.gate.port import Gate
from aeros.runtime.motion.base_contact import (
    BaseTravel,
    box_corners,
    enlarged_obstacle,
    find_base_contact,
)
from aeros.runtime.motion.detour import Check, find_base_detour, find_detour
from aeros.runtime.motion.kinematic_bounds import ForwardKinematics
from aeros.runtime.motion.obstacle_contact import as_barrier, ends_at_obstacle
from aeros.runtime.motion.swept_volume import MergedMotion, RemainingMotion
from aeros.runtime.motion.trajectory import OBSTRUCTED, MotionDecider, held_object
from aeros.runtime.ports import Plant, Reading, Readings, Trajectory, Vec3, known_obstacles, plan_sequence
from aeros.skill import Action
from aeros.spec.model.motion import MotionPolicy


class Detour(NamedTuple):
    """A way round obstacles.

    Attributes:
        targets: where tool or base is at the end of each leg, m; the target that was asked for is the last.
        legs: an action for each; the one that was asked for is the last.
    """

    targets: list[Vec3]
    legs: list[Action]


class DetourSearch:
    """Search on one state, in which nothing moves.

    The gate and the check of whole motions decide each leg as they will when it is its turn.

    Args:
        motion: the motion policy; None if the site has none.
        gate: decides actions.
        motions: decides their motions.
        plant: plans them.
        readings: readings of now.
        now: plant time, s.
        usage: use of quotas.
    """

    def __init__(
        self,
        motion: MotionPolicy | None,
        gate: Gate,
        motions: MotionDecider,
        plant: Plant,
        readings: Readings,
        now: float,
        usage: Mapping[str, int],
    ) -> None:
        self._motion = motion
        self._gate = gate
        self._motions = motions
        self._plant = plant
        self._readings = readings
        self._now = now
        self._usage = usage

    def find(self, caller: Caller, denied: Decision, action: Action) -> Detour | None:
        """Find a way round what is in the way of a straight motion of the tool, or of the base.

        Args:
            caller: module, skill and inputs of the request.
            denied: the decision on it.
            action: the action that it denied.

        Returns:
            The way; None if obstacles are not the only reason, or none was found.
        """
        motion = self._motion
        is_obstructed = all(reason.code == OBSTRUCTED for reason in denied.reasons)
        if motion is None or not denied.reasons or not is_obstructed:
            return None
        asked = self._decide(caller, self._readings, action).action
        direct_plans = None if asked is None else plan_sequence(self._plant, [asked])
        if asked is None or not direct_plans or type(direct_plans[0]) is not Trajectory:
            return None
        kind, direct = motion.kinds[asked.kind], direct_plans[0]
        names = kind.base_target or kind.tool_target
        if names is None:
            return None

        def leg(place: Vec3) -> Action:
            return Action(asked.kind, {**asked.parameters, **_ends_at(names, place)})

        def is_allowed(place: Vec3) -> bool:
            return self._decide(caller, self._readings, leg(place)).kind is DecisionKind.ALLOW

        def failing_leg(places: Sequence[Vec3]) -> int | None:
            return self._failing_leg(motion, caller, [leg(place) for place in places])

        if isinstance(names, str):
            target = asked.parameters[names]
            targets = self._find_for_tool(motion, direct, target, is_allowed, failing_leg)
        else:
            targets = self._find_for_base(motion, direct, is_allowed, failing_leg)
        return None if targets is None else Detour(targets, [*map(leg, targets[:-1]), action])

    def _find_for_base(
        self, motion: MotionPolicy, direct: Trajectory, is_allowed: Callable[[Vec3], bool], check: Check
    ) -> list[Vec3] | None:
        """Return the way of the base beside obstacles; None, too, if the site compares it with none."""
        driven = None if motion.obstacles is None else motion.obstacles.base
        if driven is None:
            return None
        own, clearance = box_corners(driven), float(motion.clearance)
        travel = BaseTravel(own, direct.base, direct.base_path).at_end()
        obstacles = known_obstacles(self._plant)
        if find_base_contact(travel, obstacles, clearance) is not None:
            return None
        boxes = []
        for one in obstacles:
            lower, upper = enlarged_obstacle(own, one, clearance)
            boxes.append(as_barrier(one)._replace(lower=lower, upper=upper))
        return find_base_detour(direct.base, travel.start, boxes, is_allowed, check)

    def _find_for_tool(
        self,
        motion: MotionPolicy,
        direct: Trajectory,
        target: Vec3,
        is_allowed: Callable[[Vec3], bool],
        check: Check,
    ) -> list[Vec3] | None:
        """Return the way of the tool over and beside obstacles; the base stands."""
        obstacles = known_obstacles(self._plant)
        held = held_object(motion, direct.body, self._readings)
        moving = MergedMotion(RemainingMotion(direct), RemainingMotion(direct)).swept_motion(held)
        if ends_at_obstacle(moving, obstacles, float(motion.clearance)):
            return None
        boxes = [*map(as_barrier, obstacles)]
        return find_detour(_tool_at_start(direct), target, direct.base, boxes, is_allowed, check)

    def _decide(self, caller: Caller, readings: Readings, action: Action) -> Decision:
        return self._gate.decide(caller, readings, action, self._now, self._usage)

    def _failing_leg(self, motion: MotionPolicy, caller: Caller, legs: Sequence[Action]) -> int | None:
        """Return the index of the first leg that would not be allowed, or None."""
        readings, obstacles = dict(self._readings), known_obstacles(self._plant)
        plans = plan_sequence(self._plant, legs) or ()
        for number, leg in enumerate(legs):
            plan = plans[number] if number < len(plans) else None
            if type(plan) is not Trajectory:
                return number
            readings[motion.start_variable] = Reading(plan.joint_paths[0][0][0], self._now)
            if number > 0 and motion.base_variable is not None:
                readings[motion.base_variable] = Reading(plan.base, self._now)
            decided = self._decide(caller, readings, leg)
            if self._motions.decide(decided, plan, readings, (), obstacles).kind is not DecisionKind.ALLOW:
                return number
        return None


def _tool_at_start(plan: Trajectory) -> Vec3:
    frame = ForwardKinematics(plan.body, plan.joint_paths[0][0][0]).frames[-1]
    x, y, z = frame.to_base(plan.body.tool_offset)
    base_x, base_y, base_z = plan.base
    return (base_x + x, base_y + y, base_z + z)


def _ends_at(names: str | tuple[str, str], place: Vec3) -> dict[str, Any]:
    """Return the parameters for a motion of the tool, or of the base in x and y, that ends at a place."""
    if isinstance(names, str):
        return {names: place}
    x, y = names
    return {x: place[0], y: place[1]}
