"""Sizes of wrappers, fillings, pot and press, and what pictures of them are judged by.

All lengths in metres, angles in radians, in the world frame.
"""

from typing import Any

Place = tuple[float, float, float]

Values = dict[str, tuple[Any, ...]]
"""Value and uncertainty of each variable; the value alone if it is certain."""

HINGE_TO_PLATE = 0.022
"""Distance of the middle of plate A from the wrapper's hinge, m."""

PLATE_HALF = (0.021, 0.028, 0.003)
"""Half edges of a plate, m."""

CLOSED_HEIGHT = 0.025
"""Height of the outside of plate B above the middle of plate A when closed, m."""

SAME_SIZE = 0.08
"""Difference of a wrapper's size from the usual one, as a share of it, that the picture makes."""

FILLING_HEIGHT = 0.017
"""Height of the filling, m."""

ON_PRESS_WITHIN = (0.04, 0.015)
"""Greatest distance of the hinge from its place on the press, level and in height, m."""

FILLING_GAP, GAP_WITHIN = 0.022, 0.005
"""Gap of fingers that hold a filling, and the tolerance of gaps, m."""

POT_HALF, POT_DEPTH = (0.08, 0.085), 0.05
"""Half of the pot's inner length and width, m, and from its floor to its surveyed opening."""

MAX_HEIGHT = 0.20
"""Greatest height of an object on the bench, m: above it is the arm."""

MIN_PIXELS = 25
"""Least number of pixels of an object: fewer are noise, or an object that is mostly hidden."""

MIN_PATCH = 4
"""Least number of pixels of a patch of one colour: fewer are noise."""

UNCERTAINTY = 0.004
"""Standard uncertainty of a place, m: a pixel is 3 mm."""

ANGLE_UNCERTAINTY = 0.06
"""Standard uncertainty of a heading and of the fold, rad."""

OUTLINE = 0.005
"""Distance from the outline of a thing within which a point is still of it, m."""

OVER_BENCH = 0.006
"""Height over the bench above which something lies there, m."""

WRAPPER_HALF, FILLING_HALF = (0.043, 0.028), (0.011, 0.011)
"""Half the length and width of an open wrapper around its hinge, and of the filling, m."""

LOOKED_OVER = ((0.32, -0.38), (0.66, 0.42))
"""Lowest and highest corner (x, y) of the bench where wrappers and fillings may be for the hand, m."""

HIDING_CELL, HIDING_CELLS = 0.02, 4
"""Edge of a cell of it that a picture shows or not, m, and the number of cells that can hide a wrapper."""

LOWEST = 0.012
"""Height of the lowest grasp, m."""
