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
from aeros.runtime.motion.swept_volume import MergedMotion, RemainingMotion, moves_joints
from aeros.runtime.ports import JointVector, Trajectory
from aeros.skill import Action

_PROGRESS_MARGIN = 1e-9
"""Fraction of its path subtracted from a motion's progress: more than rounding can add."""


class ConcurrentMotion(NamedTuple):
    """A motion under way while another one is to begin.

    Attributes:
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
            return f"the `{action.kind}` under way is coming to rest, and its final position is not known yet"
        if plan.servo is not None or other.servo is not None:
            return f"during the `{action.kind}` under way: feedback on a moving base cannot be bounded"
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


def moves_base(motion: Trajectory) -> bool:
    """Check the base's displacement in a motion.

    Args:
        motion: a planned motion.

    Returns:
        True if the base travels.
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
