"""Concurrent motions of one robot, merged into one motion of its joints and its base.

A motion has completed the fraction s(u) of its path, u the fraction of its duration that has passed. It never
goes back, so it stays on the rest of its path, and stands at the end once it is over. Two motions are not
synchronized: one may be halted, and a stop brings each to rest in its own time. So no relation between their
positions is assumed: whatever each does, both are on the rest of their paths.

Rates. The tool's velocity in W is the base's plus that relative to the base; the base does not turn, so the
same holds for acceleration and jerk, and the sum of both bounds is a bound.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.motion.bezier import remaining_path
from aeros.runtime.motion.kinematic_bounds import ForwardKinematics
from aeros.runtime.motion.swept_volume import SweptMotion
from aeros.runtime.ports import JointVector, Trajectory, Vec3
from aeros.skill import Action

_PROGRESS_MARGIN = 1e-9
"""Fraction of its path subtracted from a motion's progress: more than rounding can add."""


class ConcurrentMotion(NamedTuple):
    """A motion under way while another one is to begin.

    action: the action, parameters in SI.
    plan: its motion.
    elapsed_s: the time since it began, s.
    is_halting: it comes to rest before its end.
    """

    action: Action
    plan: Trajectory
    elapsed_s: float
    is_halting: bool = False


def concurrent_motions(
    active_motions: Iterable[tuple[ActiveAction, Any, bool]], now: float
) -> list[ConcurrentMotion]:
    """Select the actions under way that move the robot's body.

    Args:
        active_motions: each action under way, its planned motion, and True if it is halting.
        now: plant time, s.

    Returns:
        Their motions.
    """
    return [
        ConcurrentMotion(active.action, plan, now - active.decided_at, is_halting)
        for active, plan, is_halting in active_motions
        if isinstance(plan, Trajectory)
    ]


class RemainingMotion(NamedTuple):
    """The rest of a motion.

    motion: the whole motion.
    s: the fraction of its path that is behind it, from 0 to 1.
    """

    motion: Trajectory
    s: float = 0.0


class MergedMotion(NamedTuple):
    """The motion of the joints and the motion of the base from now on; a single motion is both."""

    joints: RemainingMotion
    base: RemainingMotion

    @property
    def is_single_motion(self) -> bool:
        """True if one motion moves joints and base."""
        return self.joints.motion is self.base.motion

    def swept_motion(self) -> SweptMotion:
        """Return the motion in the form that the sweep checks.

        Returns:
            The rest of the joint path and of the base's path.
        """
        arm, s = self.joints
        paths = tuple(remaining_path(path, s) for path in arm.joint_paths)
        slack = arm.servo.joint_tolerance if arm.servo else (0.0,) * len(arm.body.dh_rows)
        return SweptMotion(arm.body, paths, slack, *_remaining_base_path(self.base), self.is_single_motion)

    def base_at_end(self) -> Vec3:
        """Return the position of the base when all motions are over.

        Returns:
            The position in W, m.
        """
        return _add(self.base.motion.base, self.base.motion.base_path)

    def tool_at_end(self) -> Vec3:
        """Return the position of the tool when all motions are over.

        Returns:
            The position in W, m.
        """
        arm = self.joints.motion
        tool = ForwardKinematics(arm.body, arm.joint_paths[0][-1][3]).frames[-1].to_base(arm.body.tool_offset)
        return _add(self.base_at_end(), tool)


def merge_motions(plan: Trajectory, concurrent_motions: Sequence[ConcurrentMotion]) -> MergedMotion | str:
    """Merge a planned motion with those under way, from now on.

    Args:
        plan: the motion that is to begin.
        concurrent_motions: the motions under way.

    Returns:
        The merged motion, or the reason why nothing can be said about it.
    """
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
    """Return True if any joint leaves its position.

    Args:
        motion: a planned motion.
    """
    start = motion.joint_paths[0][0][0]
    return motion.servo is not None or any(q != start for piece in motion.joint_paths[0] for q in piece)


def moves_base(motion: Trajectory) -> bool:
    """Return True if the base travels.

    Args:
        motion: a planned motion.
    """
    return any(motion.base_path)


def commanded_joint_position(concurrent_motion: ConcurrentMotion) -> JointVector:
    """Compute the joint position that a motion under way has reached by its own time.

    Args:
        concurrent_motion: a motion under way.

    Returns:
        The position of each joint, rad.
    """
    return remaining_path(concurrent_motion.plan.joint_paths[0], _progress(concurrent_motion))[0][0]


def _progress(concurrent_motion: ConcurrentMotion) -> float:
    """Return the least fraction of its path that a motion has completed; 0 if its clock cannot be used."""
    u = concurrent_motion.elapsed_s / concurrent_motion.plan.duration
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
