"""A bench for making one dumpling: wrapper on a tray, filling on a stand, folding press, pot.

Not modelled anywhere: soft dough, water, heat; cooking is dwell time in the pot.
"""

from __future__ import annotations

from math import dist, pi
from typing import Any, Final, NamedTuple

from aeros.sim.geometry import Pose, Triple, in_frame, minus, of_frame, turned, yaw_of
from aeros.sim.randomness import Chance

PRESS: Final = (0.50, 0.0, 0.094)
"""Middle of the press's hinge in W, m: its bed is 80 mm high, so that fingers reach past its sides."""

TRAY: Final = (0.43, -0.28, 0.06)
"""Nominal middle of the wrapper tray's top, m."""

TRAY_EDGES: Final = (0.06, 0.03)
"""Length and width of the tray, m."""

STAND: Final = (0.36, 0.24, 0.05)
"""Nominal middle of the filling stand's top, m."""

STAND_RADIUS: Final = 0.009
"""m."""

POT: Final = (0.55, 0.33, 0.005)
"""Middle of the pot's floor, m."""

POT_INNER: Final = (0.16, 0.17, 0.05)
"""Length, width and depth of the pot, m: open fingers (132 mm over all) fit in."""

FILLING: Final = (0.022, 0.017)
"""Side and height of the filling, m: 1 mm higher than the closed wrapper's gap, so that it is pressed."""

SPREAD: Final = 0.03
"""Tray and stand are up to this far from their nominal place in x and in y, m."""

HINGE_TO_PLATE: Final = 0.022
"""From the wrapper's hinge to the middle of plate A, m (models/wrapper.urdf)."""

PLATE_HALF: Final = (0.021, 0.028, 0.003)
"""Half edges of a plate, m (models/wrapper.urdf)."""

FOLDED: Final = 160.0 * pi / 180.0
"""Fold from which a wrapper counts as closed, rad."""

SEALING_FORCE: Final = 1.0
"""Force of the folded plate on the filling that seals, N."""

COOKING_TIME: Final = 5.0
"""Dwell in the pot that cooks, s."""

BELONGS: Final[Triple] = (PRESS[0], PRESS[1], PRESS[2] - 0.011)
"""Where wrapper_position belongs: the hinges meet (8 mm half gap + 3 mm half plate)."""


class Layout(NamedTuple):
    """Where things are at the start: tray and stand by their middles, wrapper (its plate A), filling."""

    tray: Pose
    stand: Triple
    wrapper: Pose
    filling: Pose


def lay_bench(chance: Chance) -> Layout:
    """Channels of chance: tray, wrapper, stand.  Wrapper and filling begin 1 mm above what they lie on."""
    draw = [float(part) for part in chance.on("tray").uniform(-1.0, 1.0, 3)]
    x, y = TRAY[0] + SPREAD * draw[0], TRAY[1] + SPREAD * draw[1]
    yaw = 0.4 * draw[2]
    off = [float(part) for part in chance.on("wrapper").uniform(-1.0, 1.0, 3)]
    tilt = turned(yaw + 0.05 * off[2])
    hinge = Pose((x + 0.003 * off[0], y + 0.003 * off[1], TRAY[2] + PLATE_HALF[2] + 0.001), tilt)
    aside = [float(part) for part in chance.on("stand").uniform(-1.0, 1.0, 3)]
    u, v = STAND[0] + SPREAD * aside[0], STAND[1] + SPREAD * aside[1]
    return Layout(
        Pose((x, y, TRAY[2] / 2), turned(yaw)),
        (u, v, STAND[2] / 2),
        Pose(of_frame(hinge, (HINGE_TO_PLATE, 0.0, 0.0)), tilt),
        Pose((u, v, STAND[2] + FILLING[1] / 2 + 0.001), turned(0.05 * aside[2])),
    )


class Dumpling(NamedTuple):
    """A dumpling as it is measured: plate A, its fold in rad, the filling's middle, whether it is sealed."""

    plate: Pose
    fold: float
    filling: Triple
    sealed: bool

    @property
    def hinge(self) -> Triple:
        """The middle of the wrapper's hinge line at mid thickness."""
        return of_frame(self.plate, (-HINGE_TO_PLATE, 0.0, 0.0))

    @property
    def is_filled(self) -> bool:
        """The filling's middle is over plate A and at rest height, within 6 mm."""
        x, y, z = in_frame(self.plate, self.filling)
        above = z - PLATE_HALF[2] - FILLING[1] / 2
        return abs(x) < PLATE_HALF[0] and abs(y) < PLATE_HALF[1] and abs(above) < 0.006

    @property
    def is_closed(self) -> bool:
        """Folded over its filling."""
        return self.fold > FOLDED and self.is_filled

    @property
    def is_wrapped(self) -> bool:
        """Sealed, and still closed."""
        return self.sealed and self.is_closed

    @property
    def is_in_pot(self) -> bool:
        """Wrapper and filling are both in the pot."""
        return _inside_pot(self.plate.position) and _inside_pot(self.filling)


def measured_on_bench(dumpling: Dumpling, handle: Triple, pressed: float, cooked: float) -> dict[str, Any]:
    """Poses of wrapper, filling, press and pot, and the task's predicates.

    wrapper_position: the hinge; it belongs at press_position.  Supplied dough and filling stay "on the
    workspace" as parts of the dumpling.
    handle: of the press.  pressed: force of the lid's plate on the filling, N.  cooked: dwell in the pot, s.
    """
    yaw = yaw_of(dumpling.plate.orientation)
    dx, dy, dz = minus(dumpling.hinge, BELONGS)
    wrapped = dumpling.is_wrapped
    return {
        "wrapper_position": dumpling.hinge,
        "wrapper_yaw": yaw,
        "wrapper_fold": dumpling.fold,
        "filling_position": dumpling.filling,
        "press_position": BELONGS,
        "press_handle_position": handle,
        "press_force": pressed,
        "pot_position": (POT[0], POT[1], POT[2] + POT_INNER[2]),
        "dough_on_workspace": wrapped or (dist((dx, dy), (0.0, 0.0)) < 0.04 and abs(dz) < 0.015),
        "filling_on_workspace": wrapped or dumpling.is_filled,
        "wrapper_aligned": abs(dx) < 0.008
        and abs(dy) < 0.010
        and abs(dz) < 0.006
        and abs(yaw) < 8.0 * pi / 180.0,
        "dumpling_wrapped": wrapped,
        "dumpling_cooked": wrapped and cooked >= COOKING_TIME,
    }


def _inside_pot(place: Triple) -> bool:
    dx, dy, dz = minus(place, POT)
    within = abs(dx) < POT_INNER[0] / 2 and abs(dy) < POT_INNER[1] / 2
    return within and 0.0 < dz < POT_INNER[2]
