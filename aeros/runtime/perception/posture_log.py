"""Log of the robot's postures: where it was when a picture was taken, which arrives later."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from aeros.runtime.ports import JointVector, Reading, Vec3
from aeros.spec.model.motion import MotionPolicy

_TICKS: Final = 240
"""Number of control ticks whose postures are kept: a picture arrives after exposure, read-out and delay."""


class Posture(NamedTuple):
    """Posture of the robot.

    Attributes:
        time: plant time, s.
        joints: positions of its joints, rad.
        base: of the arm's base in W, m.
    """

    time: float
    joints: JointVector
    base: Vec3


class PostureLog:
    """The postures of the latest control ticks."""

    def __init__(self) -> None:
        self._postures: deque[Posture] = deque(maxlen=_TICKS)

    def note(self, policy: MotionPolicy, now: float, measured: Mapping[str, Any]) -> None:
        """Remember where the robot is, for a picture that is taken now.

        Args:
            policy: names the variables that measure it.
            now: plant time, s.
            measured: measured values or readings by name.
        """
        joints = value_of(measured.get(policy.start_variable))
        base = (
            (0.0, 0.0, 0.0) if policy.base_variable is None else value_of(measured.get(policy.base_variable))
        )
        if joints is not None and base is not None:
            self._postures.append(Posture(now, joints, base))

    def at(self, time: float) -> Posture | None:
        """Return the posture at a time.

        Args:
            time: plant time, s.

        Returns:
            The one that was noted nearest to it; None if none was.
        """
        return min(self._postures, key=lambda one: abs(one.time - time), default=None)


def value_of(measured: Any) -> Any:
    """Return a measured value.

    Args:
        measured: a value or a reading of one.

    Returns:
        The value.
    """
    return measured.value if isinstance(measured, Reading) else measured
