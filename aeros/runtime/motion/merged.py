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

from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.motion.bezier import remaining_path
from aeros.runtime.motion.kinematics import ForwardKinematics
from aeros.runtime.motion.swept_volume import SweptMotion
from aeros.runtime.ports import JointVector, Trajectory, Vec3
from aeros.skill import Action

_PROGRESS_MARGIN = 1e-9
"""Share of its way that a motion is taken back by: more than what rounding takes."""


class ConcurrentMotion(NamedTuple):
    """A motion under way beside one that is to begin.

    since: how long ago it began, s.
    is_halting: it comes to rest before its end.
    """

    action: Action
    plan: Trajectory
    started_at: float
    is_halting: bool = False


def concurrent_motions(
    active_motions: Iterable[tuple[ActiveAction, Any, bool]], now: float
) -> list[ConcurrentMotion]:
    """Those that move the robot's body; of each action what began, its motion, and whether it is halting."""
    return [
        ConcurrentMotion(begun.action, plan, now - begun.decided_at, is_halting)
        for begun, plan, is_halting in active_motions
        if isinstance(plan, Trajectory)
    ]


class RemainingMotion(NamedTuple):
    """A motion from its share s of its way on."""

    motion: Trajectory
    s: float = 0.0


class MergedMotion(NamedTuple):
    """What moves the joints and what moves the base from now on; one motion alone is both."""

    joints: RemainingMotion
    base: RemainingMotion

    @property
    def is_single_motion(self) -> bool:
        """Whether it is one motion alone."""
        return self.joints.motion is self.base.motion

    def swept_motion(self) -> SweptMotion:
        """All of it as the sweep sees it."""
        arm, s = self.joints
        paths = tuple(remaining_path(path, s) for path in arm.joint_paths)
        slack = arm.servo.joint_tolerance if arm.servo else (0.0,) * len(arm.body.dh_rows)
        return SweptMotion(arm.body, paths, slack, *_remaining_base_path(self.base), self.is_single_motion)

    def base_at_end(self) -> Vec3:
        """Where the base is in W when all is over."""
        return _add(self.base.motion.base, self.base.motion.base_path)

    def tool_at_end(self) -> Vec3:
        """Where the tool is in W when all is over."""
        arm = self.joints.motion
        tool = ForwardKinematics(arm.body, arm.joint_paths[0][-1][3]).frames[-1].to_base(arm.body.tool_offset)
        return _add(self.base_at_end(), tool)


def merge_motions(plan: Trajectory, concurrent_motions: Sequence[ConcurrentMotion]) -> MergedMotion | str:
    """The motion that `plan` is beside the others, from now on, or why nothing can be said of that."""
    for action, other, _, is_halting in concurrent_motions:
        if is_halting:
            return f"the `{action.kind}` under way comes to rest, and where it will is not decided"
        if plan.servo is not None or other.servo is not None:
            return f"beside the `{action.kind}` under way: where feedback leads is not known on a moving base"
        if plan.body != other.body:
            return f"the `{action.kind}` under way is a motion of another body"
    parts = [
        RemainingMotion(plan),
        *(RemainingMotion(other.plan, _progress(other)) for other in concurrent_motions),
    ]
    turning = [part for part in parts if moves_joints(part.motion)]
    travelling = [part for part in parts if moves_base(part.motion)]
    if len(turning) > 1 or len(travelling) > 1:
        return "it and a motion under way would move the same part of the robot"
    return MergedMotion(*(movers[0] if movers else parts[0] for movers in (turning, travelling)))


def moves_joints(motion: Trajectory) -> bool:
    """Whether any joint leaves its place."""
    start = motion.joint_paths[0][0][0]
    return motion.servo is not None or any(q != start for piece in motion.joint_paths[0] for q in piece)


def moves_base(motion: Trajectory) -> bool:
    """Whether the base travels."""
    return any(motion.base_path)


def commanded_joint_position(concurrent_motion: ConcurrentMotion) -> JointVector:
    """Where the joints are to be by the motion's own time."""
    return remaining_path(concurrent_motion.plan.joint_paths[0], _progress(concurrent_motion))[0][0]


def _progress(concurrent_motion: ConcurrentMotion) -> float:
    """Which share of its way a motion has made, at least; none where the clock says nothing."""
    u = concurrent_motion.started_at / concurrent_motion.plan.duration
    if not u > 0.0:
        return 0.0
    if u >= 1.0:
        return 1.0 - _PROGRESS_MARGIN
    return max(0.0, u**3 * (10.0 - 15.0 * u + 6.0 * u * u) - _PROGRESS_MARGIN)


def _remaining_base_path(part: RemainingMotion) -> tuple[Vec3, Vec3]:
    (x, y, z), (wx, wy, wz), left = part.motion.base, part.motion.base_path, 1.0 - part.s
    return (x + part.s * wx, y + part.s * wy, z + part.s * wz), (left * wx, left * wy, left * wz)


def _add(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])
