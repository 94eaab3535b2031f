"""Decides a whole motion before it starts: what the plant would do for an allowed action.

The gate has decided the action, this decides what the action becomes: that it starts where the robot is
and ends where it was asked to, that no joint and not the tool exceed the site's limits at any time of
it, nor the tool the speed that the action names, and that no link meets a barrier.  All bounds are
upper bounds (`peaks`, `sweep`), so a motion may be refused that would have been in order, by the width
of the bound, and none is allowed that is not.

Decided is the commanded motion.  What the robot does differently, as it lags behind its set points, is
what the site's clearance is for, and the monitor's to watch; what the robot holds is not enclosed.
A plant that states that an action moves nothing is believed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import chain
from math import dist, isfinite
from typing import Any

from aeros.runtime.bezier import span_of
from aeros.runtime.decision import Decision, Reason, Verdict
from aeros.runtime.kinematics import Posture, norm
from aeros.runtime.peaks import Rates, joint_rates, smooth, timed, tool_rates
from aeros.runtime.ports import Completion, Motionless, Plan, Readings, Servo, Trajectory, Triple
from aeros.runtime.sweep import Box, breach_of
from aeros.skill import Action
from aeros.spec.model import Barrier, MotionKind, MotionPolicy

_RATES = ("speed", "acceleration", "jerk")


class MotionDecider:
    """Decides motions under one site's motion policy; `decide` is pure and total."""

    def __init__(self, policy: MotionPolicy | None) -> None:
        self._policy = policy
        if policy is None:
            return
        self._lowest, self._highest = _floats(policy.lowest), _floats(policy.highest)
        self._joint_rates = [Rates(*map(float, one)) for one in zip(*policy.rates, strict=True)]
        self._moving, self._turning = (
            Rates(*map(float, one)) for one in (policy.tool.moving, policy.tool.turning)
        )
        self._boxes = [_box(barrier) for barrier in policy.barriers]
        self._barriers = {barrier.id: barrier for barrier in policy.barriers}

    def governs(self, kind: str) -> bool:
        """Whether actions of the kind are decided as whole motions."""
        return self._policy is not None and kind in self._policy.kinds

    def decide(
        self, decision: Decision, plan: Plan, readings: Readings, others: Iterable[Plan | None] = ()
    ) -> Decision:
        """`decision`, or a denial where what it allows becomes a motion that is not in order.

        others: what the plant said of the actions under way.
        """
        action, policy = decision.action, self._policy
        if action is None or policy is None or not self.governs(action.kind) or type(plan) is Completion:
            return decision
        reasons = self._objections(policy, action, plan, readings)
        if type(plan) is not Motionless and any(type(other) is Trajectory for other in others):
            text = "the robot moves already, and both motions together were not decided"
            reasons = (*reasons, Reason("AE764", action.kind, text))
        return Decision(Verdict.DENY, None, reasons) if reasons else decision

    def _objections(
        self, policy: MotionPolicy, action: Action, plan: object, readings: Readings
    ) -> tuple[Reason, ...]:
        if type(plan) is Motionless:
            return ()
        if type(plan) is not Trajectory:
            return (Reason("AE760", action.kind, "the plant does not say what motion it would make"),)
        fault = self._malformed(policy, plan)
        if fault is not None:
            return (Reason("AE760", action.kind, f"the motion is malformed: {fault}"),)
        asked = policy.kinds[action.kind]
        return (
            *_misplaced(policy, asked, action.parameters, plan, readings),
            *self._too_fast(asked, action.parameters, plan),
            *self._breaches(policy, plan),
        )

    # Form.

    def _malformed(self, policy: MotionPolicy, plan: Trajectory) -> str | None:
        """Why nothing can be said of the motion, or None; total over whatever the plant put into it."""
        try:
            return self._fault(policy, plan)
        except (TypeError, ValueError, AttributeError) as fault:
            return str(fault) or type(fault).__name__

    def _fault(self, policy: MotionPolicy, plan: Trajectory) -> str | None:
        joints = len(policy.lowest)
        if not plan.paths or not all(plan.paths) or (plan.servo is None and len(plan.paths) != 1):
            return "it has not one path, or under feedback several"
        columns = [column for path in plan.paths for piece in path for column in piece]
        if any(len(piece) != 4 for path in plan.paths for piece in path):
            return "a piece has not four control points"
        if len(plan.body.rows) != joints or any(len(column) != joints for column in columns):
            return f"it is not about {joints} joints"
        numbers = chain(chain.from_iterable(columns), plan.base, plan.way, (plan.duration,), _numbers(plan))
        if not all(type(number) is float and isfinite(number) for number in numbers):
            return "something of it is not a finite number"
        if plan.duration <= 0.0:
            return "it takes no time"
        if plan.servo is not None and any(plan.way):
            return "the base travels under feedback"
        if any(not 0 <= ball.joint <= joints or ball.radius < 0.0 for ball in plan.body.balls):
            return "a ball of the body moves with no joint, or has no radius"
        if not all(smooth(path) for path in plan.paths):
            return "its pieces do not meet, so its jerk has no bound"
        links = {ball.link for ball in plan.body.balls}
        named = {link for box in self._boxes for link in box.links or ()}
        if not links or named - links:
            return f"the body has no link `{min(named - links, default='')}`"
        return None

    # Limits.

    def _too_fast(self, asked: MotionKind, parameters: Mapping[str, Any], plan: Trajectory) -> list[Reason]:
        reasons = []
        for path in plan.paths:
            middle, width = span_of(list(path))
            slack = plan.servo.slack if plan.servo else (0.0,) * len(middle)
            for joint, (m, w, s) in enumerate(zip(middle, width, slack, strict=True)):
                if m - w - s < self._lowest[joint] or m + w + s > self._highest[joint]:
                    reasons.append(
                        Reason("AE762", f"joint-{joint + 1}", f"joint {joint + 1} may leave its limits")
                    )
        speed = parameters[asked.peak_speed] if asked.peak_speed else self._moving.speed
        joints, moving, turning = _rates(plan, min(speed, self._moving.speed))
        for joint, (found, limit) in enumerate(zip(joints, self._joint_rates, strict=True), 1):
            reasons += _above(f"joint-{joint}", f"joint {joint}", found, limit, ("rad/s", "rad/s²", "rad/s³"))
        reasons += _above("tool", "the tool", moving, self._moving, ("m/s", "m/s²", "m/s³"))
        if turning is not None:
            reasons += _above(
                "tool-turning", "the tool's turning", turning, self._turning, ("rad/s", "rad/s²", "rad/s³")
            )
        if asked.peak_speed and moving.speed > speed:
            text = f"the tool may reach {moving.speed:.4g} m/s where {speed:.4g} m/s was decided"
            reasons.append(Reason("AE762", asked.peak_speed, text))
        return list(dict.fromkeys(reasons))

    # Barriers.

    def _breaches(self, policy: MotionPolicy, plan: Trajectory) -> list[Reason]:
        found = breach_of(plan, self._boxes, float(policy.clearance))
        if found is None:
            return []
        barrier = self._barriers[found.barrier]
        where = "may leave" if barrier.inside else "may enter"
        text = (
            f"`{found.link}` {where} the volume `{barrier.volume}` at {100.0 * found.at:.0f} % of the way, "
            f"or comes nearer than the clearance: {barrier.rationale}"
        )
        return [Reason("AE763", barrier.id, text)]


def _misplaced(
    policy: MotionPolicy,
    asked: MotionKind,
    parameters: Mapping[str, Any],
    plan: Trajectory,
    readings: Readings,
) -> list[Reason]:
    """Where the motion starts and ends."""
    reasons = []
    start, end = plan.paths[0][0][0], plan.paths[0][-1][3]
    measured = readings.get(policy.starts_at)
    if measured is None:
        reasons.append(Reason("AE761", policy.starts_at, "where the joints are is not known"))
    else:
        away = max(abs(a - b) for a, b in zip(start, measured.value, strict=True))
        if not away <= float(policy.starts_within):
            text = f"the motion starts {away:.3g} rad from where a joint is"
            reasons.append(Reason("AE761", policy.starts_at, text))
    base = _plus(plan.base, plan.way)
    if asked.tool_ends_at is not None:
        tool = _plus(base, Posture(plan.body, end).frames[-1].place(plan.body.tool))
        away = dist(tool, parameters[asked.tool_ends_at])
        if not away <= float(policy.ends_within):
            text = f"the motion ends {1000.0 * away:.3g} mm from where the tool was asked to be"
            reasons.append(Reason("AE761", asked.tool_ends_at, text))
    if asked.base_ends_at is not None:
        x, y = asked.base_ends_at
        away = dist(base[:2], (parameters[x], parameters[y]))
        if not away <= float(policy.ends_within):
            text = f"the motion ends {1000.0 * away:.3g} mm from where the base was asked to be"
            reasons.append(Reason("AE761", x, text))
    return reasons


def _rates(plan: Trajectory, speed_limit: float) -> tuple[list[Rates], Rates, Rates | None]:
    """Of the joints, the tool, and the tool's turning; under feedback those that the plant keeps to."""
    servo = plan.servo
    if servo is not None:
        joints = [Rates(*one) for one in zip(servo.speed, servo.acceleration, servo.jerk, strict=True)]
        return joints, Rates(servo.tool_speed, servo.tool_acceleration, servo.tool_jerk), None
    path = plan.paths[0]
    joints = joint_rates(path, plan.duration)
    if all(rate == (0.0, 0.0, 0.0) for rate in joints):
        return joints, timed(norm(plan.way), 0.0, 0.0, plan.duration), Rates(0.0, 0.0, 0.0)
    return joints, *tool_rates(plan.body, path, plan.way, plan.duration, speed_limit)


def _above(rule: str, what: str, found: Rates, limit: Rates, units: tuple[str, str, str]) -> list[Reason]:
    return [
        Reason(
            "AE762", f"{rule}-{name}", f"{what} may reach a {name} of {a:.4g} {unit}; {b:.4g} is the limit"
        )
        for name, a, b, unit in zip(_RATES, found, limit, units, strict=True)
        if not a <= b
    ]


def _numbers(plan: Trajectory) -> list[float]:
    """Every other number in it."""
    body, servo = plan.body, plan.servo
    if any(len(p) != 3 for p in (plan.base, plan.way, body.tool, *(ball.centre for ball in body.balls))):
        raise ValueError("a point has not three coordinates")
    found = [*body.tool, *chain.from_iterable(body.rows)]
    for ball in body.balls:
        found += [*ball.centre, ball.radius]
    if servo is not None:
        found += [*_per_joint(servo, len(body.rows)), servo.tool_speed, servo.tool_acceleration]
        found.append(servo.tool_jerk)
    return found


def _per_joint(servo: Servo, joints: int) -> list[float]:
    rows = (servo.slack, servo.speed, servo.acceleration, servo.jerk)
    if any(len(row) != joints for row in rows):
        raise ValueError(f"its feedback is not about {joints} joints")
    return [*chain.from_iterable(rows)]


def _box(barrier: Barrier) -> Box:
    (lx, ly, lz), (ux, uy, uz) = _floats(barrier.box.lower), _floats(barrier.box.upper)
    lower, upper = (lx, ly, lz), (ux, uy, uz)
    return Box(barrier.id, lower, upper, barrier.inside, barrier.in_base, barrier.links)


def _floats(values: Any) -> tuple[float, ...]:
    return tuple(float(value) for value in values)


def _plus(a: Triple, b: Triple) -> Triple:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])
