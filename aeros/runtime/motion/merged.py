"""Several motions of one robot as one: who moves the joints, who the base, and what is left of each.

A motion has made the share s(u) of its way, u the share of its duration that has passed; it never goes
back, so it stays on the rest of its way, and stands at the end of that once it is over.  Two motions do
not keep in step: one may be halted, and a stop brings each to rest in a time of its own.  So nothing is
taken of where one is while the other is somewhere: whatever each does, both are on the rest of their ways.

Rates.  The tool's velocity in W is the base's plus that relative to it; the base does not turn, so the
same holds of acceleration and jerk, and the sum of both bounds is a bound.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from aeros.runtime.gate.joint_rules import Begun
from aeros.runtime.motion.bezier import rest_of
from aeros.runtime.motion.kinematics import Posture
from aeros.runtime.motion.swept_volume import Moving
from aeros.runtime.ports import Joints, Trajectory, Triple
from aeros.skill import Action

_EARLIER = 1e-9
"""Share of its way that a motion is taken back by: more than what rounding takes."""


class Companion(NamedTuple):
    """A motion under way beside one that is to begin.

    since: how long ago it began, s.
    is_halting: it comes to rest before its end.
    """

    action: Action
    plan: Trajectory
    since: float
    is_halting: bool = False


def companions_of(under_way: Iterable[tuple[Begun, Any, bool]], now: float) -> list[Companion]:
    """Those that move the robot's body; of each action what began, its motion, and whether it is halting."""
    return [
        Companion(begun.action, plan, now - begun.time, is_halting)
        for begun, plan, is_halting in under_way
        if isinstance(plan, Trajectory)
    ]


class Part(NamedTuple):
    """A motion from its share s of its way on."""

    motion: Trajectory
    s: float = 0.0


class Merged(NamedTuple):
    """What moves the joints and what moves the base from now on; one motion alone is both."""

    joints: Part
    base: Part

    @property
    def is_one(self) -> bool:
        """Whether it is one motion alone."""
        return self.joints.motion is self.base.motion

    def moving(self) -> Moving:
        """All of it as the sweep sees it."""
        arm, s = self.joints
        paths = tuple(rest_of(path, s) for path in arm.paths)
        slack = arm.servo.slack if arm.servo else (0.0,) * len(arm.body.rows)
        return Moving(arm.body, paths, slack, *_rest_of_way(self.base), self.is_one)

    def base_at_end(self) -> Triple:
        """Where the base is in W when all is over."""
        return _plus(self.base.motion.base, self.base.motion.way)

    def tool_at_end(self) -> Triple:
        """Where the tool is in W when all is over."""
        arm = self.joints.motion
        tool = Posture(arm.body, arm.paths[0][-1][3]).frames[-1].place(arm.body.tool)
        return _plus(self.base_at_end(), tool)


def merge(plan: Trajectory, others: Sequence[Companion]) -> Merged | str:
    """The motion that `plan` is beside the others, from now on, or why nothing can be said of that."""
    for action, other, _, is_halting in others:
        if is_halting:
            return f"the `{action.kind}` under way comes to rest, and where it will is not decided"
        if plan.servo is not None or other.servo is not None:
            return f"beside the `{action.kind}` under way: where feedback leads is not known on a moving base"
        if plan.body != other.body:
            return f"the `{action.kind}` under way is a motion of another body"
    parts = [Part(plan), *(Part(other.plan, _made(other)) for other in others)]
    turning = [part for part in parts if moves_joints(part.motion)]
    travelling = [part for part in parts if moves_base(part.motion)]
    if len(turning) > 1 or len(travelling) > 1:
        return "it and a motion under way would move the same part of the robot"
    return Merged(*(movers[0] if movers else parts[0] for movers in (turning, travelling)))


def moves_joints(motion: Trajectory) -> bool:
    """Whether any joint leaves its place."""
    start = motion.paths[0][0][0]
    return motion.servo is not None or any(q != start for piece in motion.paths[0] for q in piece)


def moves_base(motion: Trajectory) -> bool:
    """Whether the base travels."""
    return any(motion.way)


def posture_now(other: Companion) -> Joints:
    """Where the joints are to be by the motion's own time."""
    return rest_of(other.plan.paths[0], _made(other))[0][0]


def _made(other: Companion) -> float:
    """Which share of its way a motion has made, at least; none where the clock says nothing."""
    u = other.since / other.plan.duration
    if not u > 0.0:
        return 0.0
    if u >= 1.0:
        return 1.0 - _EARLIER
    return max(0.0, u**3 * (10.0 - 15.0 * u + 6.0 * u * u) - _EARLIER)


def _rest_of_way(part: Part) -> tuple[Triple, Triple]:
    (x, y, z), (wx, wy, wz), left = part.motion.base, part.motion.way, 1.0 - part.s
    return (x + part.s * wx, y + part.s * wy, z + part.s * wz), (left * wx, left * wy, left * wz)


def _plus(a: Triple, b: Triple) -> Triple:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])
