"""Monitor of motions under feedback: the measured speeds are those that the plant declared.

The gate decides a motion under feedback by the bounds that the plant states (`ServoBounds`). Here they
are compared with measured joints, over windows long enough that noise of one tick does not count.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from math import dist, isfinite
from typing import Any, Final

from aeros.kinematic_chain import frames_of, mounting_of
from aeros.runtime.ports import Reading, Trajectory

DECLARED_RATES: Final = "declared-rates"
"""Name under which a motion is stopped that is faster than the plant declared it."""

_WINDOW_S: Final = 0.05
"""Length of a window, s."""

_JOINT_TOLERANCE: Final = 0.005
_TOOL_TOLERANCE: Final = 0.003
"""Allowance for tracking in a window: rad of each joint and m of the tool (measured: 0.5 mrad and 2 mm)."""


class FeedbackRates:
    """Check of one motion under feedback.

    Args:
        plan: the motion as it was decided, with `servo`.
        variable: state variable that measures the joints.
    """

    def __init__(self, plan: Trajectory, variable: str) -> None:
        self._servo = plan.servo
        self._variable = variable
        self._mountings = [mounting_of(row) for row in plan.body.dh_rows]
        self._tool_offset = plan.body.tool_offset
        self._window: deque[tuple[float, tuple[float, ...], tuple[float, ...]]] = deque()

    def is_broken(self, now: float, measured: Mapping[str, Any]) -> bool:
        """Add a tick, and compare the distance covered in the last window with the declared speeds.

        Args:
            now: plant time, s.
            measured: values (SI) or readings, by vocabulary name.

        Returns:
            True if a joint or the tool went farther than the declared speed allows. False for ticks without
            well-formed joints, which other checks refuse.
        """
        value, servo = measured.get(self._variable), self._servo
        time = value.time if type(value) is Reading else now
        joints = value.value if type(value) is Reading else value
        if servo is None or not isinstance(joints, tuple | list) or len(joints) != len(self._mountings):
            return False
        if not all(type(one) is float and isfinite(one) for one in joints):
            return False
        if self._window and time <= self._window[-1][0]:
            return False
        tool = frames_of(self._mountings, joints)[-1].to_base(self._tool_offset)
        while self._window and self._window[0][0] < time - _WINDOW_S:
            self._window.popleft()
        self._window.append((time, tuple(joints), tool))
        start, were, tool_was = self._window[0]
        lasted = time - start
        return dist(tool, tool_was) > servo.tool_speed * lasted + _TOOL_TOLERANCE or any(
            abs(one - was) > speed * lasted + _JOINT_TOLERANCE
            for one, was, speed in zip(joints, were, servo.speed, strict=True)
        )
