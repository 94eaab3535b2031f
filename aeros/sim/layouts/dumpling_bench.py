"""Meaning of pictures of a bench for one dumpling: wrapper, filling, folding press and pot."""

from __future__ import annotations

from math import dist, pi
from typing import Any, Final, NamedTuple

from aeros.sim.geometry import Pose, Vector3, subtract, to_frame, to_world, yaw_orientation

PRESS: Final = (0.50, 0.0, 0.094)
"""Middle of the press's hinge in W, m: its bed is 80 mm high, so that fingers reach past its sides."""

POT: Final = (0.55, 0.33, 0.005)
"""Middle of the pot's floor, m."""

POT_INNER: Final = (0.16, 0.17, 0.05)
"""Length, width and depth of the pot, m: open fingers (132 mm over all) fit in."""

FILLING: Final = (0.022, 0.017)
"""Side and height of the filling, m: 1 mm higher than the closed wrapper's gap, so that it is pressed."""

HINGE_TO_PLATE: Final = 0.022
"""Distance of the middle of plate A from the wrapper's hinge, m (models/wrapper.urdf)."""

PLATE_HALF: Final = (0.021, 0.028, 0.003)
"""Half edges of a plate, m (models/wrapper.urdf)."""

CLOSED_FOLD_ANGLE: Final = 160.0 * pi / 180.0
"""Least fold of a closed wrapper, rad."""

SEALING_FORCE: Final = 1.0
"""Force of the folded plate on the filling above which the wrapper seals, N."""

COOKING_TIME: Final = 5.0
"""Time in the pot after which a dumpling is cooked, s."""

ALIGNED_POSITION: Final[Vector3] = (PRESS[0], PRESS[1], PRESS[2] - 0.011)
"""Target of `wrapper_position`: the hinges meet (8 mm half gap + 3 mm half plate)."""


CLOSED_HEIGHT: Final = 0.025
"""Height of the outside of plate B above the middle of plate A when closed, m (models/wrapper.urdf)."""


class WrapperDetection(NamedTuple):
    """A wrapper detected in a picture, in W.

    Attributes:
        hinge: the middle of its hinge line at the mid thickness of plate A, m.
        yaw: heading of plate A from the hinge, rad.
        fold: angle between its plates, 0 open, rad; None if it is not visible, as of a wrapper on its edge.
    """

    hinge: Vector3
    yaw: float
    fold: float | None

    @property
    def is_closed(self) -> bool:
        """True unless it is seen to be open."""
        return self.fold is None or self.fold > CLOSED_FOLD_ANGLE

    @property
    def middle(self) -> Vector3:
        """The middle of plate A in W, m."""
        return to_world(Pose(self.hinge, yaw_orientation(self.yaw)), (HINGE_TO_PLATE, 0.0, 0.0))

    def carries(self, filling: Vector3) -> bool:
        """Compare the place of a filling with plate A.

        Args:
            filling: the filling's middle in W, m.

        Returns:
            True if its middle is over the plate, within 6 mm of its height at rest.
        """
        return _is_filling_on_plate(Pose(self.middle, yaw_orientation(self.yaw)), filling)


def _is_filling_on_plate(plate: Pose, filling: Vector3) -> bool:
    x, y, z = to_frame(plate, filling)
    above = z - PLATE_HALF[2] - FILLING[1] / 2
    return abs(x) < PLATE_HALF[0] and abs(y) < PLATE_HALF[1] and abs(above) < 0.006


class DumplingTracker:
    """State of the dumpling so far, from camera pictures and the press's load cell.

    Attributes:
        wrapper: as the last picture from above showed it; None if it did not.
    """

    def __init__(self) -> None:
        self.wrapper: WrapperDetection | None = None
        self._pressed = False
        self._wrapped = False
        self._in_pot_since: float | None = None
        self._cooked = False

    def add_press_force(self, force: float) -> None:
        """Note the force on the filling; a pressed wrapper counts as pressed until it is seen open.

        Args:
            force: of the lid's plate on the filling, N.
        """
        self._pressed = self._pressed or force > SEALING_FORCE

    def add_overhead_view(
        self, wrapper: WrapperDetection | None, filling: Vector3 | None, time: float
    ) -> dict[str, Any]:
        """Update from a picture from above.

        Supplied dough and filling stay "on the workspace" as parts of the dumpling, and so does a filling
        that a closed wrapper hides.

        Args:
            wrapper: the detected wrapper, if any.
            filling: middle of the detected filling in W, m, if any.
            time: of the picture, s.

        Returns:
            Values by vocabulary name, SI, positions in W; None for what the picture does not show.
        """
        self.wrapper = wrapper
        seen: dict[str, Any] = {"filling_position": filling}
        if wrapper is None:
            names = "wrapper_position", "wrapper_yaw", "wrapper_fold", "dough_on_workspace", "wrapper_aligned"
            return {**seen, **dict.fromkeys(names), "filling_on_workspace": None}
        if not wrapper.is_closed:
            self._pressed = self._wrapped = False
        self._update_cooking(wrapper, filling, time)
        dx, dy, dz = subtract(wrapper.hinge, ALIGNED_POSITION)
        # A wrapper on its edge may be open: it counts as filled only if it was seen wrapped before.
        is_filling_hidden = (
            filling is None and wrapper.is_closed and (wrapper.fold is not None or self._wrapped)
        )
        on_press = dist((dx, dy), (0.0, 0.0)) < 0.04 and abs(dz) < 0.015
        return {
            **seen,
            "wrapper_position": wrapper.hinge,
            "wrapper_yaw": wrapper.yaw,
            "wrapper_fold": wrapper.fold,
            "dough_on_workspace": self._wrapped or on_press,
            "filling_on_workspace": is_filling_hidden or (filling is not None and wrapper.carries(filling)),
            "wrapper_aligned": abs(dx) < 0.008
            and abs(dy) < 0.010
            and abs(dz) < 0.006
            and abs(wrapper.yaw) < 8.0 * pi / 180.0,
            "dumpling_wrapped": self._wrapped,
            "dumpling_cooked": self._cooked,
        }

    def add_side_view(self, filled: bool) -> dict[str, Any]:
        """Update from a picture from the side: it decides if the wrapper seen from above is a dumpling.

        Args:
            filled: True if the picture shows filling between the plates and none outside.

        Returns:
            `dumpling_wrapped`, by vocabulary name.
        """
        closed = self.wrapper is not None and self.wrapper.is_closed
        self._wrapped = closed and filled and self._pressed
        return {"dumpling_wrapped": self._wrapped}

    def _update_cooking(self, wrapper: WrapperDetection, filling: Vector3 | None, time: float) -> None:
        if not _is_in_pot(wrapper.middle) or not (filling is None or _is_in_pot(filling)):
            self._in_pot_since = None
            return
        if self._in_pot_since is None:
            self._in_pot_since = time
        self._cooked = self._cooked or (self._wrapped and time - self._in_pot_since >= COOKING_TIME)


def _is_in_pot(place: Vector3) -> bool:
    dx, dy, dz = subtract(place, POT)
    within = abs(dx) < POT_INNER[0] / 2 and abs(dy) < POT_INNER[1] / 2
    return within and 0.0 < dz < POT_INNER[2]
