"""Search for a way round obstacles, on the state in which a straight motion of tool or base was denied.

A link that no joint moves, as those of a standing arm, is an obstacle, too; the tool's ways lead round it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
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
from aeros.runtime.motion.link_distance import find_link_contact
from aeros.runtime.motion.obstacle_contact import as_barrier, ends_at_obstacle, resting_at_end
from aeros.runtime.motion.swept_volume import BarrierBox, MergedMotion, RemainingMotion
from aeros.runtime.motion.trajectory import HELD, LINKS_MEET, OBSTRUCTED, MotionDecider, held_object
from aeros.runtime.ports import (
    Hull,
    Plant,
    Reading,
    Readings,
    RobotBody,
    Trajectory,
    Vec3,
    known_obstacles,
    plan_sequence,
)
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
        is_obstructed = all(reason.code in (OBSTRUCTED, LINKS_MEET) for reason in denied.reasons)
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

        pairs = {reason.rule for reason in denied.reasons if reason.code == LINKS_MEET}
        standing = _met_while_standing(direct.body, pairs)
        if pairs and not standing:
            return None
        if isinstance(names, str):
            target = asked.parameters[names]
            boxes = [*map(as_barrier, known_obstacles(self._plant))]
            boxes += _boxes_of(standing, direct)
            targets = self._find_for_tool(motion, direct, target, boxes, is_allowed, failing_leg)
        elif pairs:
            return None
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
        boxes: Sequence[BarrierBox],
        is_allowed: Callable[[Vec3], bool],
        check: Check,
    ) -> list[Vec3] | None:
        """Return the way of the tool over and beside obstacles and standing links; the base stands."""
        held = held_object(motion, direct.body, self._readings)
        moving = MergedMotion(RemainingMotion(direct), RemainingMotion(direct)).swept_motion(held)
        if ends_at_obstacle(moving, known_obstacles(self._plant), float(motion.clearance)):
            return None
        room = motion.link_clearance
        if room is not None and find_link_contact(resting_at_end(moving), float(room)) is not None:
            return None
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


def _met_while_standing(body: RobotBody, pairs: Collection[str]) -> list[Hull]:
    """Return the hulls that no joint moves and that touch, directly or not, one of those of the pairs.

    Empty if one of the pairs has none.
    """
    standing = [hull for hull in body.hulls if hull.joint == 0]
    others = [hull.link for hull in body.hulls if hull.joint] + [HELD]
    met = {
        pair: [one for one in standing for other in others if pair == f"{one.link}-{other}"] for pair in pairs
    }
    if not all(met.values()):
        return []
    found = [one for hulls in met.values() for one in hulls]
    for one in found:  # it grows
        found += [each for each in standing if each not in found and _overlap(_box_of(one), _box_of(each))]
    return found


def _boxes_of(hulls: Sequence[Hull], plan: Trajectory) -> list[BarrierBox]:
    """Return the box around hulls that stand on the base of a plan, in W; none without hulls."""
    if not hulls:
        return []
    lowest, highest = zip(*map(_box_of, hulls), strict=True)
    lower, upper = (
        tuple(choose(axis) + b for axis, b in zip(zip(*ends, strict=True), plan.base, strict=True))
        for choose, ends in ((min, lowest), (max, highest))
    )
    return [BarrierBox("standing links", lower, upper, False, False, None)]


def _box_of(hull: Hull) -> tuple[Vec3, Vec3]:
    """Return the lowest and the highest corner of the box around a hull, in its frame."""
    columns = [*zip(*hull.corners, strict=True)]
    (ax, ay, az), (bx, by, bz) = map(min, columns), map(max, columns)
    r = hull.radius
    return (ax - r, ay - r, az - r), (bx + r, by + r, bz + r)


def _overlap(one: tuple[Vec3, Vec3], other: tuple[Vec3, Vec3]) -> bool:
    axes = zip(*one, *other, strict=True)
    return all(low <= other_high and other_low <= high for low, high, other_low, other_high in axes)


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
