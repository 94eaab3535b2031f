"""Joint positions that the controller holds while nothing moves, as far as joint states tell."""

from __future__ import annotations

from aeros.wired_arm.arm import Joints


class CommandedJoints:
    """Commanded positions of resting joints: the end of the last motion if they are there, else as measured.

    So errors of a controller that holds its joints a little off do not add up, motion by motion.

    Args:
        tolerance: greatest distance of a joint from where it is commanded, rad.
    """

    def __init__(self, tolerance: float) -> None:
        self._tolerance = tolerance
        self.place: Joints | None = None
        """Positions, rad; None if they are not known."""

    def stand(self, q: Joints) -> None:
        """Note joint states while nothing moves.

        Args:
            q: measured positions, rad.
        """
        if self.place is None or self._distance(q, self.place) > self._tolerance:
            self.place = q

    def at(self, otherwise: Joints) -> Joints:
        """Return the positions.

        Args:
            otherwise: positions to return if they are not known, rad.

        Returns:
            The positions, rad.
        """
        return otherwise if self.place is None else self.place

    def stale_refusal(self, start: Joints) -> str | None:
        """Say why a motion cannot begin here.

        Args:
            start: positions at its start, rad or m.

        Returns:
            The reason; None if it can.
        """
        away = self._distance(self.at(start), start)
        if away <= self._tolerance:
            return None
        return f"stale: the motion begins {away:.6f} rad or m from where the arm is commanded"

    @staticmethod
    def _distance(one: Joints, other: Joints) -> float:
        return max(abs(a - b) for a, b in zip(one, other, strict=True))
