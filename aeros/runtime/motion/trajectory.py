"""Decisions about whole motions before they start: the motion that the plant plans for an allowed action.

The gate has decided the action; this decides its motion: that it starts at the robot's position and ends
where the action asks, that no joint and not the tool exceed the site's limits at any time, nor the tool the
speed that the action names, that no link meets a barrier, and that no two links meet each other. All bounds
are upper bounds (`kinematic_bounds`, `swept_volume`). So an acceptable motion may be denied
if it comes closer to a limit than the bounds are wide, but no other is allowed.

If other motions are under way, the same is decided of all of them together, from now on (`merged`): also that
those still end where their actions asked, and that the tool, carried by the base, keeps in W to the speed of
the action that moves the arm. The base keeps to the speed of the action that drives it.

The commanded motion is decided. The site's clearance covers the robot's deviation from it, such as lag behind
set points, and the monitor watches it. What the robot holds is enclosed as the site says, unless it is
measured that it holds nothing. It does not move while it grips or releases (`joint_rules`). What it holds
may touch a surface that the action names, near the motion's start and target (`surface_contact`).
A plant's statement that an action moves nothing is trusted.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain, product
from math import dist, inf, isfinite
from typing import Any, Final

from aeros.kinematic_chain import PRISMATIC, is_prismatic
from aeros.runtime.gate.decision import Decision, DecisionKind, Reason
from aeros.runtime.motion.base_contact import BaseTravel, box_corners, find_base_contact
from aeros.runtime.motion.bezier import joint_box
from aeros.runtime.motion.kinematic_bounds import (
    MotionRates,
    add_rates,
    base_rates,
    is_c2_continuous,
    joint_rates,
    tool_rates,
)
from aeros.runtime.motion.link_distance import find_link_contact
from aeros.runtime.motion.merged import ConcurrentMotion, commanded_joint_position, merge_motions
from aeros.runtime.motion.nearest_approach import find_nearest_approach
from aeros.runtime.motion.obstacle_contact import (
    ends_at_obstacle,
    find_held_contact,
    find_obstacle_contact,
    trimmed_held_space,
)
from aeros.runtime.motion.surface_contact import SurfaceBreach, SurfaceLimits, find_surface_breach
from aeros.runtime.motion.swept_volume import (
    BarrierBox,
    BarrierBreach,
    MergedMotion,
    SweptMotion,
    find_breach,
    moves_joints,
)
from aeros.runtime.ports import (
    Ball,
    Hull,
    JointVector,
    MotionCompletion,
    NoMotion,
    Obstacle,
    PlannedMotion,
    Readings,
    RobotBody,
    ServoBounds,
    Trajectory,
    Vec3,
)
from aeros.skill import Action
from aeros.spec.model.motion import Barrier, MotionPolicy

_RATES = ("speed", "acceleration", "jerk")


LINKS_MEET: Final = "AE765"
"""Code of a link that may come too near to another link."""

OBSTRUCTED: Final = "AE766"
"""Code of the reason that something which a picture shows is in the way."""


class MotionDecider:
    """Decider of motions under one site's motion policy; `decide` is pure and total."""

    def __init__(self, policy: MotionPolicy | None) -> None:
        self._policy = policy
        if policy is None:
            return
        self._unit = _joint_unit(policy)
        self._lowest, self._highest = _floats(policy.lowest), _floats(policy.highest)
        self._joint_rates = [MotionRates(*map(float, one)) for one in zip(*policy.joint_limits, strict=True)]
        self._moving, self._turning = (
            MotionRates(*map(float, one))
            for one in (policy.tool_limits.translation, policy.tool_limits.rotation)
        )
        self._boxes = [_box(barrier) for barrier in policy.barriers]
        self._barriers = {barrier.id: barrier for barrier in policy.barriers}

    def covers_kind(self, kind: str) -> bool:
        """Look an action kind up among those that move the robot.

        Args:
            kind: an action kind.

        Returns:
            True if actions of the kind are decided as whole motions.
        """
        return self._policy is not None and kind in self._policy.kinds

    def decide(
        self,
        decision: Decision,
        plan: PlannedMotion,
        readings: Readings,
        concurrent_motions: Sequence[ConcurrentMotion] = (),
        obstacles: Sequence[Obstacle] = (),
    ) -> Decision:
        """Decide the motion of an action that the gate has decided.

        Args:
            decision: the gate's decision.
            plan: the plant's plan for the action that the decision allows.
            readings: the readings of the decision.
            concurrent_motions: the motions under way, of kinds that the policy covers.
            obstacles: what pictures show and nobody declared.

        Returns:
            `decision`, or a denial if the motion violates the policy.
        """
        action, policy = decision.action, self._policy
        if (
            action is None
            or policy is None
            or not self.covers_kind(action.kind)
            or type(plan) is MotionCompletion
        ):
            return decision
        reasons = self._objections(policy, action, plan, readings, concurrent_motions, obstacles)
        return Decision(DecisionKind.DENY, None, reasons) if reasons else decision

    def _objections(
        self,
        policy: MotionPolicy,
        action: Action,
        plan: object,
        readings: Readings,
        concurrent_motions: Sequence[ConcurrentMotion],
        obstacles: Sequence[Obstacle],
    ) -> tuple[Reason, ...]:
        if type(plan) is NoMotion:
            return ()
        if type(plan) is not Trajectory:
            return (Reason("AE760", action.kind, "the plant did not return the motion that it would make"),)
        fault = self._malformed(policy, plan)
        if fault is not None:
            return (Reason("AE760", action.kind, f"the motion is malformed: {fault}"),)
        for other in concurrent_motions:
            fault = self._malformed(policy, other.plan)
            if fault is not None:
                text = f"the `{other.action.kind}` under way is malformed: {fault}"
                return (Reason("AE764", action.kind, text),)
        merged = merge_motions(plan, concurrent_motions)
        if isinstance(merged, str):
            return (Reason("AE764", action.kind, merged),)
        moving = merged.swept_motion(held_object(policy, merged.joints.motion.body, readings))
        reasons = [
            *_start_mismatch(policy, plan.joint_paths[0][0][0], readings, "the motion starts"),
            *_base_mismatch(policy, moving.base, readings),
            *_end_mismatch(policy, action, merged, "the motion ends"),
        ]
        for other in concurrent_motions:
            subject = f"the `{other.action.kind}` under way"
            if moves_joints(other.plan):
                reasons += _start_mismatch(policy, commanded_joint_position(other), readings, f"{subject} is")
            reasons += _end_mismatch(policy, other.action, merged, f"{subject} would end")
        reasons += self._joints_too_fast(plan)
        motions = [(action, plan), *((other.action, other.plan) for other in concurrent_motions)]
        reasons += self._tool_too_fast(policy, motions, merged)
        reasons += _base_too_fast(policy, merged)
        reasons += self._breaches(policy, action, plan if merged.is_single_motion else None, moving)
        if moves_joints(merged.joints.motion):
            reasons += _link_contacts(policy, moving)
        if obstacles:
            reasons += _obstacle_contacts(policy, moving, obstacles)
        return tuple(dict.fromkeys(reasons))

    # Form.

    def _malformed(self, policy: MotionPolicy, plan: Trajectory) -> str | None:
        """Return the fault of a malformed motion, or None; total for everything a plant may return."""
        try:
            return self._motion_fault(policy, plan)
        except (TypeError, ValueError, AttributeError, IndexError) as fault:
            return str(fault) or type(fault).__name__

    def _motion_fault(self, policy: MotionPolicy, plan: Trajectory) -> str | None:
        joints = len(policy.lowest)
        if not _is_immutable(plan):
            return "one of its parts is not of the type that it has to be, or no tuple"
        if (
            not plan.joint_paths
            or not all(plan.joint_paths)
            or (plan.servo is None and len(plan.joint_paths) != 1)
        ):
            return "it does not have one path, or several under feedback"
        columns = [column for path in plan.joint_paths for piece in path for column in piece]
        if any(len(piece) != 4 for path in plan.joint_paths for piece in path):
            return "a segment does not have four control points"
        if len(plan.body.dh_rows) != joints or any(len(column) != joints for column in columns):
            return f"it does not have {joints} joints"
        numbers = [
            *chain.from_iterable(columns),
            *plan.base,
            *plan.base_path,
            plan.duration,
            *_other_numbers(plan),
        ]
        if set(map(type, numbers)) != {float} or not all(map(isfinite, numbers)):
            return _number_fault(numbers)
        if plan.duration <= 0.0:
            return "its duration is not above 0 s"
        fault = _prismatic_fault(policy, plan.body)
        if fault is not None:
            return fault
        if plan.servo is not None and any(plan.base_path):
            return "the base travels under feedback"
        if any(not _moves_with_joint(ball, joints) for ball in plan.body.balls):
            return "a sphere of the body moves with no joint, or has no radius"
        if not all(is_c2_continuous(path) for path in plan.joint_paths):
            return "its segments do not join smoothly, so its jerk has no bound"
        links = {ball.link for ball in plan.body.balls}
        named = {link for box in self._boxes for link in box.links or ()} - {HELD}
        if not links or named - links:
            return f"the body has no link `{min(named - links, default='')}`"
        return _hull_fault(plan.body, joints, policy.link_clearance is not None)

    # Limits.

    def _joints_too_fast(self, plan: Trajectory) -> list[Reason]:
        reasons = []
        for path in plan.joint_paths:
            middle, width = joint_box(list(path))
            slack = plan.servo.joint_tolerance if plan.servo else (0.0,) * len(middle)
            for joint, (m, w, s) in enumerate(zip(middle, width, slack, strict=True)):
                if m - w - s < self._lowest[joint] or m + w + s > self._highest[joint]:
                    reasons.append(
                        _range_reason(
                            joint + 1,
                            (m - w - s, m + w + s),
                            (self._lowest[joint], self._highest[joint]),
                            self._unit,
                        )
                    )
        for joint, (rates, limit) in enumerate(zip(_joint_rates(plan), self._joint_rates, strict=True), 1):
            unit = self._unit
            reasons += _limit_violations(
                f"joint-{joint}", f"joint {joint}", rates, limit, (f"{unit}/s", f"{unit}/s²", f"{unit}/s³")
            )
        return reasons

    def _tool_too_fast(
        self, policy: MotionPolicy, motions: list[tuple[Action, Trajectory]], merged: MergedMotion
    ) -> list[Reason]:
        requested = [
            (name, action.parameters[name], plan)
            for action, plan in motions
            if (name := policy.kinds[action.kind].peak_speed) is not None
        ]
        arm, base = merged.joints.motion, merged.base.motion
        limit = min([self._moving.speed, *(speed for _, speed, plan in requested if plan is arm)])
        carried = base_rates(base.base_path, base.duration)
        relative, turning = _tool_rates(arm, limit - carried.speed)
        moving = add_rates(relative, carried)
        reasons = _limit_violations("tool", "the tool", moving, self._moving, ("m/s", "m/s²", "m/s³"))
        if turning is not None:
            reasons += _limit_violations(
                "tool-turning", "the tool's rotation", turning, self._turning, ("rad/s", "rad/s²", "rad/s³")
            )
        for name, speed, plan in requested:
            reached = moving.speed if plan is arm else carried.speed if plan is base else 0.0
            if reached > speed:
                part = "tool" if plan is arm else "base"
                text = f"the {part} may reach {reached:.4g} m/s; {speed:.4g} m/s was decided"
                reasons.append(Reason("AE762", name, text))
        return reasons

    # Barriers.

    def _breaches(
        self, policy: MotionPolicy, action: Action, plan: Trajectory | None, moving: SweptMotion
    ) -> list[Reason]:
        """Report a barrier that a link or what is held may meet; `plan` is None if two motions are merged."""
        clearance, surface = float(policy.clearance), policy.kinds[action.kind].surface
        touched: list[BarrierBox] = []
        if surface is not None and plan is not None and moving.held is not None:
            touched = [box for box in self._boxes if self._barriers[box.id].volume in surface.volumes]
        others = [box for box in self._boxes if box not in touched]
        breach = find_breach(moving, others, clearance)
        if breach is not None and breach.link == HELD:
            breach = _find_breach_closely(moving, others, clearance)
        if breach is None and touched:
            breach = find_breach(moving._replace(held=None), touched, clearance)
        if breach is not None:
            box = next(one for one in self._boxes if one.id == breach.barrier)
            if breach.link == HELD and box.is_in_base_frame:
                moving = moving._replace(held=trimmed_held_space(moving, [box], clearance))
            return [_barrier_reason(self._barriers[breach.barrier], box, breach, moving, clearance)]
        if surface is None or plan is None:
            return []
        limits = SurfaceLimits(float(surface.distance or 0), float(surface.speed))
        for box in touched:
            if box.links is None or HELD in box.links:
                place = find_surface_breach(plan, moving, [box], clearance, limits)
                if place is not None:
                    return [_surface_reason(self._barriers[box.id], place, limits)]
        return []


def _barrier_reason(
    barrier: Barrier, box: BarrierBox, breach: BarrierBreach, moving: SweptMotion, clearance: float
) -> Reason:
    """Say how near the link of a breach comes to the barrier, and how near it may come."""
    nearest = find_nearest_approach(moving, box, breach.link)
    distance, volume = nearest.distance, f"the volume `{barrier.volume}`"
    needed, place = _mm(clearance), f"at {_percent(nearest.path_parameter)} of the path"
    if distance > clearance:
        text = (
            f"`{breach.link}` may come nearer than {needed} to the faces of {volume} at "
            f"{_percent(breach.path_parameter)} of the path: it is {_mm(distance)} from them "
            f"{place}, too near to show that it keeps {needed} on the way"
        )
    elif distance >= 0.0:
        text = (
            f"`{breach.link}` comes as near as {_mm(distance)} to the faces of {volume} {place}; "
            f"{needed} are needed"
        )
    else:
        verb = "leaves" if barrier.keep_inside else "enters"
        text = (
            f"`{breach.link}` {verb} {volume} by {_mm(-distance)} {place}; it has to keep "
            f"{needed} from its faces"
        )
    return Reason("AE763", barrier.id, f"{text}: {barrier.rationale}")


def _mm(length: float) -> str:
    """Write a length in m as millimetres."""
    return f"{1000.0 * length:.3g} mm"


def _percent(path_parameter: float) -> str:
    return f"{100.0 * path_parameter:.0f} %"


def _surface_reason(barrier: Barrier, place: SurfaceBreach, limits: SurfaceLimits) -> Reason:
    text = (
        f"`{HELD}` may enter the volume `{barrier.volume}` at {_percent(place.path_parameter)} of the "
        f"path, {_mm(place.distance)} from the target and at {place.speed:.3g} m/s; allowed are "
        f"{_mm(limits.distance)} and {limits.speed:.3g} m/s: {barrier.rationale}"
    )
    return Reason("AE763", barrier.id, text)


HELD: Final = "held"
"""Name by which barriers and reasons call a held object."""


def _find_breach_closely(
    moving: SweptMotion, boxes: list[BarrierBox], clearance: float
) -> BarrierBreach | None:
    """Search as `find_breach`, but compare what is held closely with volumes that move with the base."""
    own = [box for box in boxes if box.is_in_base_frame and not box.keep_inside]
    of_held = [box for box in own if box.links is None or HELD in box.links]
    return (
        find_breach(moving, [box for box in boxes if box not in own], clearance)
        or find_breach(moving._replace(held=None), own, clearance)
        or find_held_contact(moving, of_held, clearance)
    )


def held_object(policy: MotionPolicy, body: RobotBody, readings: Readings) -> Hull | None:
    """Return the space of what the robot holds.

    Args:
        policy: the site's motion policy.
        body: the robot.
        readings: readings of now.

    Returns:
        The space; None if the site has none, or it is measured that nothing is held.
    """
    if policy.held is None:
        return None
    measured = readings.get(policy.held.variable)
    if measured is not None and measured.value is False:
        return None
    box = policy.held.box
    x, y, z = body.tool_offset
    corners = product(*zip(_floats(box.lower), _floats(box.upper), strict=True))
    return Hull(HELD, len(body.dh_rows), tuple([(x + a, y + b, z + c) for a, b, c in corners]), 0.0)


def _link_contacts(policy: MotionPolicy, moving: SweptMotion) -> list[Reason]:
    """Report two links that may come nearer to each other than the site's clearance between links."""
    if policy.link_clearance is None:
        return []
    clearance = float(policy.link_clearance)
    contact = find_link_contact(moving, clearance)
    if contact is None:
        return []
    text = (
        f"`{contact.outer}` may come within {_mm(contact.distance)} of `{contact.inner}` at "
        f"{_percent(contact.path_parameter)} of the path; links keep {_mm(clearance)} apart"
    )
    return [Reason(LINKS_MEET, f"{contact.inner}-{contact.outer}", text)]


def _obstacle_contacts(
    policy: MotionPolicy, moving: SweptMotion, obstacles: Sequence[Obstacle]
) -> list[Reason]:
    """Report an obstacle that a link, what is held, or the base that drives, may come too near to."""
    clearance = float(policy.clearance)
    breach = find_obstacle_contact(moving, obstacles, clearance)
    is_at_target = breach is not None and ends_at_obstacle(moving, obstacles, clearance)
    driven = None if policy.obstacles is None else policy.obstacles.base
    if breach is None and driven is not None and any(moving.base_path):
        travel = BaseTravel(box_corners(driven), moving.base, moving.base_path)
        breach = find_base_contact(travel, obstacles, clearance)
        is_at_target = find_base_contact(travel.at_end(), obstacles, clearance) is not None
    if breach is None:
        return []
    obstacle = next(one for one in obstacles if one.name == breach.barrier)
    target = ", and at its target" if is_at_target else ""
    text = (
        f"`{breach.link}` may come nearer than {_mm(clearance)} to {obstacle} at "
        f"{_percent(breach.path_parameter)} of the path{target}; `{obstacle.camera}` saw it"
    )
    return [Reason(OBSTRUCTED, obstacle.name, text)]


def _is_immutable(plan: Trajectory) -> bool:
    """Tell if a plan is made of tuples and of the types of its parts, so that it stays as it was decided."""
    body, servo = plan.body, plan.servo
    if type(body) is not RobotBody or (servo is not None and type(servo) is not ServoBounds):
        return False
    pieces = [*chain.from_iterable(plan.joint_paths)]
    corners = [*chain.from_iterable(hull.corners for hull in body.hulls)]
    sequences = [
        *(plan.joint_paths, *plan.joint_paths, *pieces, *chain.from_iterable(pieces)),
        *(plan.base, plan.base_path, body.dh_rows, *body.dh_rows, body.tool_offset),
        *(body.balls, *(ball.centre for ball in body.balls)),
        *(body.hulls, *(hull.corners for hull in body.hulls), *corners),
        *(body.exempt_pairs, *body.exempt_pairs),
    ]
    if servo is not None:
        sequences += [servo.joint_tolerance, servo.speed, servo.acceleration, servo.jerk]
    names = [*chain.from_iterable(body.exempt_pairs), *(ball.link for ball in body.balls)]
    names += [hull.link for hull in body.hulls]
    return (
        {type(one) for one in sequences} == {tuple}
        and all(type(one) is str for one in names)
        and all(type(ball) is Ball and len(ball) == len(Ball._fields) for ball in body.balls)
        and all(type(hull) is Hull and len(hull) == len(Hull._fields) for hull in body.hulls)
    )


def _moves_with_joint(part: Ball | Hull, joints: int) -> bool:
    return type(part.joint) is int and 0 <= part.joint <= joints and part.radius >= 0.0


def _hull_fault(body: RobotBody, joints: int, are_links_checked: bool) -> str | None:
    """Return the fault of the hulls that distances are computed with, or None.

    are_links_checked: the site keeps links apart, so each link needs a hull.
    """
    names = [hull.link for hull in body.hulls]
    missing = {ball.link for ball in body.balls} - {*names}
    if missing and are_links_checked:
        return f"the body has no hull of its link `{min(missing)}`, so distances between links are unknown"
    for hull in body.hulls:
        if not (_moves_with_joint(hull, joints) and hull.corners):
            return f"the hull of `{hull.link}` moves with no joint, has no corner or no radius"
        if any(len(corner) != 3 for corner in hull.corners):
            return f"a corner of the hull of `{hull.link}` does not have three coordinates"
        if any(ball.joint != hull.joint for ball in body.balls if ball.link == hull.link):
            return f"the hull of `{hull.link}` does not move with its spheres"
    if are_links_checked and any(len(pair) != 2 or not {*pair} <= {*names} for pair in body.exempt_pairs):
        return "a pair of links that needs no check is not two of the links"
    return None


def _joint_unit(policy: MotionPolicy) -> str:
    """Return the unit in which the site writes positions of joints."""
    return "jpos" if policy.is_mixed else "rad"


def _prismatic_fault(policy: MotionPolicy, body: RobotBody) -> str | None:
    """Return why a site's numbers do not hold for the prismatic joints of a body, or None.

    In a site in rad they would be compared with numbers of another unit. A link moves by the whole way of a
    prismatic joint, so its lever is 1 m/m; with a shorter one the site's tolerances are wrong.
    """
    levers = () if policy.tracking is None else policy.tracking.levers
    for number, row in enumerate(body.dh_rows):
        if not is_prismatic(row):
            continue
        if not policy.is_mixed:
            return f"joint {number + 1} is prismatic, and the site has joint positions in rad, not in jpos"
        if levers and levers[number] < 1:
            return f"joint {number + 1} is prismatic, and the site's lever of it is below 1 m/jpos"
    return None


def _start_mismatch(
    policy: MotionPolicy, posture: JointVector, readings: Readings, subject: str
) -> list[Reason]:
    """Report a joint that is not measured where the motion has it now."""
    measured = readings.get(policy.start_variable)
    if measured is None:
        return [Reason("AE761", policy.start_variable, "the joint positions are not known")]
    distance = max(abs(a - b) for a, b in zip(posture, measured.value, strict=True))
    if distance <= float(policy.start_tolerance):
        return []
    return [
        Reason(
            "AE761",
            policy.start_variable,
            f"{subject} {distance:.3g} {_joint_unit(policy)} from the measured position of a joint",
        )
    ]


def _base_mismatch(policy: MotionPolicy, base: Vec3, readings: Readings) -> list[Reason]:
    """Report a base that is not measured where the motion has it now, within the bound on tracking."""
    name, tracking = policy.base_variable, policy.tracking
    if name is None or tracking is None:
        return []
    measured = readings.get(name)
    if measured is None:
        return [Reason("AE761", name, "the position of the base is not known")]
    distance = dist(base, measured.value)
    if distance <= float(tracking.bound):
        return []
    return [Reason("AE761", name, f"the motion has the base {_mm(distance)} from its measured position")]


def _end_mismatch(policy: MotionPolicy, action: Action, merged: MergedMotion, subject: str) -> list[Reason]:
    """Report tool, joints or base that end elsewhere than the action asked, when all motions are over."""
    targets, parameters, tolerance = policy.kinds[action.kind], action.parameters, float(policy.end_tolerance)
    reasons = []
    if targets.tool_target is not None:
        distance = dist(merged.tool_at_end(), parameters[targets.tool_target])
        if not distance <= tolerance:
            text = f"{subject} {_mm(distance)} from the target of the tool"
            reasons.append(Reason("AE761", targets.tool_target, text))
    if targets.joint_target is not None:
        ends = (parameters[name] for name in targets.joint_target)
        each = [abs(a - b) for a, b in zip(merged.joints.motion.joint_paths[0][-1][3], ends, strict=True)]
        # Compare each, because `max` may hide a NaN.
        if not all(distance <= _JOINT_TOLERANCE for distance in each):
            text = f"{subject} {max(each):.3g} {_joint_unit(policy)} from the target of a joint"
            reasons.append(Reason("AE761", targets.joint_target[0], text))
    if targets.base_target is not None:
        x, y = targets.base_target
        distance = dist(merged.base_at_end()[:2], (parameters[x], parameters[y]))
        if not distance <= tolerance:
            text = f"{subject} {_mm(distance)} from the target of the base"
            reasons.append(Reason("AE761", x, text))
    return reasons


def _base_too_fast(policy: MotionPolicy, merged: MergedMotion) -> list[Reason]:
    if policy.base_limits is None:
        return []
    motion = merged.base.motion
    rates, (speed, acceleration) = (
        base_rates(motion.base_path, motion.duration),
        map(float, policy.base_limits),
    )
    # The base has no jerk limit: on a very short path jerk is large and does not matter.
    return _limit_violations(
        "base", "the base", rates, MotionRates(speed, acceleration, inf), ("m/s", "m/s²", "m/s³")
    )


def _joint_rates(plan: Trajectory) -> list[MotionRates]:
    """Return the bounds of the joints; under feedback those that the plant guarantees."""
    servo = plan.servo
    if servo is None:
        return joint_rates(plan.joint_paths[0], plan.duration)
    return [MotionRates(*bounds) for bounds in zip(servo.speed, servo.acceleration, servo.jerk, strict=True)]


def _tool_rates(plan: Trajectory, speed_limit: float) -> tuple[MotionRates, MotionRates | None]:
    """Return the bounds of the tool relative to the base, and of its rotation (None if not stated)."""
    servo = plan.servo
    if servo is not None:
        return MotionRates(servo.tool_speed, servo.tool_acceleration, servo.tool_jerk), None
    if not moves_joints(plan):
        return _REST_TOLERANCE, _REST_TOLERANCE
    return tool_rates(plan.body, plan.joint_paths[0], plan.duration, speed_limit)


_REST_TOLERANCE: Final = MotionRates(0.0, 0.0, 0.0)

_JOINT_TOLERANCE: Final = 1e-6
"""Distance of a joint from its requested end that rounding explains, rad or m."""


def _range_reason(joint: int, bounds: tuple[float, float], limits: tuple[float, float], unit: str) -> Reason:
    (low, high), (lowest, highest) = bounds, limits
    text = (
        f"joint {joint} may be from {low:.4g} to {high:.4g} {unit}; "
        f"its limits are {lowest:.4g} and {highest:.4g} {unit}"
    )
    return Reason("AE762", f"joint-{joint}", text)


def _limit_violations(
    rule: str, what: str, rates: MotionRates, limit: MotionRates, units: tuple[str, str, str]
) -> list[Reason]:
    return [
        Reason(
            "AE762",
            f"{rule}-{name}",
            f"the {name} of {what} may reach {a:.4g} {unit}; the limit is {b:.4g} {unit}",
        )
        for name, a, b, unit in zip(_RATES, rates, limit, units, strict=True)
        if not a <= b
    ]


def _other_numbers(plan: Trajectory) -> list[float]:
    """Return every number of a plan except paths, base and duration.

    Raises:
        ValueError: a point does not have three coordinates.
    """
    body, servo = plan.body, plan.servo
    if any(
        len(p) != 3
        for p in (plan.base, plan.base_path, body.tool_offset, *(ball.centre for ball in body.balls))
    ):
        raise ValueError("a point does not have three coordinates")
    if any(len(row) not in (3, 4, 5) for row in body.dh_rows):
        raise ValueError("a joint does not have three to five parameters")
    if any(is_prismatic(row) and row[-1] != PRISMATIC for row in body.dh_rows):
        raise ValueError("the fifth parameter of a joint is not that of a prismatic one")
    numbers = [*body.tool_offset, *chain.from_iterable(body.dh_rows)]
    for ball in body.balls:
        numbers += [*ball.centre, ball.radius]
    for hull in body.hulls:
        numbers += [*chain.from_iterable(hull.corners), hull.radius]
    if servo is not None:
        numbers += [*_per_joint(servo, len(body.dh_rows)), servo.tool_speed, servo.tool_acceleration]
        numbers.append(servo.tool_jerk)
    return numbers


def _number_fault(numbers: Sequence[object]) -> str:
    """Say what is wrong with numbers of which one is no float or not finite."""
    other = next((number for number in numbers if type(number) is not float), None)
    if other is None:
        return "one of its numbers is not finite"
    return f"one of its numbers, {other!r}, is of the type `{type(other).__name__}`; it needs `float`"


def _per_joint(servo: ServoBounds, joints: int) -> list[float]:
    rows = (servo.joint_tolerance, servo.speed, servo.acceleration, servo.jerk)
    if any(len(row) != joints for row in rows):
        raise ValueError(f"its feedback does not have {joints} joints")
    return [*chain.from_iterable(rows)]


def _box(barrier: Barrier) -> BarrierBox:
    (lx, ly, lz), (ux, uy, uz) = _floats(barrier.box.lower), _floats(barrier.box.upper)
    lower, upper = (lx, ly, lz), (ux, uy, uz)
    return BarrierBox(barrier.id, lower, upper, barrier.keep_inside, barrier.is_in_base_frame, barrier.links)


def _floats(values: Any) -> tuple[float, ...]:
    return tuple(float(value) for value in values)
