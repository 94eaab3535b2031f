"""Layout of a bench for making one dumpling: wrapper on a tray, filling on a stand, folding press, pot.

Not modelled anywhere: soft dough, water, heat; cooking is dwell time in the pot.
"""

from __future__ import annotations

from math import dist, pi
from typing import Any, Final, NamedTuple

from aeros.sim.geometry import Camera, Pose, Vector3, subtract, to_frame, to_world, yaw_orientation
from aeros.sim.randomness import RandomSource

PRESS: Final = (0.50, 0.0, 0.094)
"""Middle of the press's hinge in W, m: its bed is 80 mm high, so that fingers reach past its sides."""

TRAY: Final = (0.43, -0.28, 0.06)
"""Nominal middle of the wrapper tray's top, m."""

TRAY_EDGES: Final = (0.06, 0.03)
"""Length and width of the tray, m."""

STAND: Final = (0.36, 0.24, 0.05)
"""Nominal middle of the filling stand's top, m."""

STAND_RADIUS: Final = 0.009
"""Radius of the filling stand, m."""

POT: Final = (0.55, 0.33, 0.005)
"""Middle of the pot's floor, m."""

POT_INNER: Final = (0.16, 0.17, 0.05)
"""Length, width and depth of the pot, m: open fingers (132 mm over all) fit in."""

FILLING: Final = (0.022, 0.017)
"""Side and height of the filling, m: 1 mm higher than the closed wrapper's gap, so that it is pressed."""

POSITION_SPREAD: Final = 0.03
"""Greatest random offset of tray and stand, in x and in y, m."""

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


CAMERAS: Final[tuple[str, ...]] = ("overhead", "side")

OVERHEAD_CAMERA: Final = Camera(
    eye=(0.45, 0.01, 1.2), target=(0.45, 0.01, 0.0), up=(1.0, 0.0, 0.0), field_of_view=33.0
)
"""The camera over the bench: its picture is 0.95 m wide and 0.71 m high, 3 mm a pixel."""

SIDE_CAMERA: Final = Camera(
    eye=(0.80, -0.22, 0.16), target=(0.52, 0.0, 0.095), field_of_view=18.0, width=160, height=120
)
"""The camera at the press: it sees between the plates of a dumpling in it, 1 mm a pixel."""

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


class BenchLayout(NamedTuple):
    """Initial poses in W.

    Attributes:
        tray: pose of the tray's middle.
        stand: middle of the stand, m.
        wrapper: pose of the wrapper's plate A.
        filling: pose of the filling.
    """

    tray: Pose
    stand: Vector3
    wrapper: Pose
    filling: Pose


def sample_bench_layout(random: RandomSource) -> BenchLayout:
    """Draw the initial layout of the bench; wrapper and filling begin 1 mm above their support.

    Args:
        random: random source; channels `tray`, `wrapper` and `stand`.

    Returns:
        The layout, positions in the world frame W, m.
    """
    draw = [float(part) for part in random.generator("tray").uniform(-1.0, 1.0, 3)]
    x, y = TRAY[0] + POSITION_SPREAD * draw[0], TRAY[1] + POSITION_SPREAD * draw[1]
    yaw = 0.4 * draw[2]
    off = [float(part) for part in random.generator("wrapper").uniform(-1.0, 1.0, 3)]
    tilt = yaw_orientation(yaw + 0.05 * off[2])
    hinge = Pose((x + 0.003 * off[0], y + 0.003 * off[1], TRAY[2] + PLATE_HALF[2] + 0.001), tilt)
    aside = [float(part) for part in random.generator("stand").uniform(-1.0, 1.0, 3)]
    u, v = STAND[0] + POSITION_SPREAD * aside[0], STAND[1] + POSITION_SPREAD * aside[1]
    return BenchLayout(
        Pose((x, y, TRAY[2] / 2), yaw_orientation(yaw)),
        (u, v, STAND[2] / 2),
        Pose(to_world(hinge, (HINGE_TO_PLATE, 0.0, 0.0)), tilt),
        Pose((u, v, STAND[2] + FILLING[1] / 2 + 0.001), yaw_orientation(0.05 * aside[2])),
    )


class Dumpling(NamedTuple):
    """True state of a dumpling.

    Attributes:
        plate: pose of plate A in W.
        fold: angle of the fold, rad.
        filling: middle of the filling in W, m.
    """

    plate: Pose
    fold: float
    filling: Vector3

    @property
    def hinge(self) -> Vector3:
        """The middle of the wrapper's hinge line at mid thickness, in W, m."""
        return to_world(self.plate, (-HINGE_TO_PLATE, 0.0, 0.0))

    @property
    def is_filled(self) -> bool:
        """True if the filling's middle is over plate A, within 6 mm of rest height."""
        return _is_filling_on_plate(self.plate, self.filling)

    @property
    def is_closed(self) -> bool:
        """True if it is folded over its filling."""
        return self.fold > CLOSED_FOLD_ANGLE and self.is_filled


def _is_filling_on_plate(plate: Pose, filling: Vector3) -> bool:
    x, y, z = to_frame(plate, filling)
    above = z - PLATE_HALF[2] - FILLING[1] / 2
    return abs(x) < PLATE_HALF[0] and abs(y) < PLATE_HALF[1] and abs(above) < 0.006


def bench_measurements(handle: Vector3, pressed: float) -> dict[str, Any]:
    """Return the measurements of the bench: surveyed positions, the press's encoder and its load cell.

    Args:
        handle: position of the press's handle in W, m.
        pressed: force of the lid's plate on the filling, N.

    Returns:
        Values by vocabulary name, SI, positions in W. `press_position` is where `wrapper_position` belongs.
    """
    return {
        "press_position": ALIGNED_POSITION,
        "press_handle_position": handle,
        "press_force": pressed,
        "pot_position": (POT[0], POT[1], POT[2] + POT_INNER[2]),
    }


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
