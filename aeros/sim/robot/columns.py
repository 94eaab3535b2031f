"""Read columns of a robot file: one number for each joint, in units of revolute and of prismatic joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from aeros.sim.robot.limits import Vector
from aeros.spec.declared.robots.robot import Column
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.elaborate.expressions import elaborate_unit
from aeros.spec.expr.units import ANGLE, FORCE, LENGTH, TIME, Dimension, Unit
from aeros.spec.text.fields import TextField

ABOVE_0: Final = "write a number above 0"

Dimensions = tuple[Dimension, Dimension]
"""Dimension of a column's values, of revolute joints and of prismatic joints."""

POSITION: Final[Dimensions] = (ANGLE, LENGTH)
EFFORT: Final[Dimensions] = (FORCE * LENGTH, FORCE)
STIFFNESS: Final[Dimensions] = (FORCE * LENGTH * ANGLE**-1, FORCE * LENGTH**-1)


def per_time(dimensions: Dimensions, power: int) -> Dimensions:
    """Divide the dimensions of a column by a power of time.

    Args:
        dimensions: those of the column.
        power: the power; a negative one multiplies.

    Returns:
        The dimensions, of revolute joints and of prismatic joints.
    """
    turning, sliding = dimensions
    return turning * TIME**-power, sliding * TIME**-power


def read_column(
    column: Column,
    dimensions: Dimensions,
    slides: Sequence[bool],
    diagnostics: Diagnostics,
    *,
    signed: bool = False,
) -> Vector:
    """Convert one number for each joint to SI; report a wrong count, unit or sign.

    Args:
        column: the numbers.
        dimensions: those of the numbers.
        slides: True for each prismatic joint of the chain.
        diagnostics: for problems; the result is then of no use.
        signed: True if a number may be 0 or below.

    Returns:
        The numbers (n,), SI.
    """
    units = [
        None if text is None else _read_unit(text, dimension, diagnostics)
        for text, dimension in zip((column.unit, column.prismatic_unit), dimensions, strict=True)
    ]
    if any(slides) and column.prismatic_unit is None:
        headline = f"`prismatic_unit` is missing: joint {[*slides].index(True) + 1} is prismatic"
        cure = f"add the unit of its value, one of {dimensions[1]}"
        diagnostics.error("AE208", headline, column.span, help=(cure,))
    elif column.prismatic_unit is not None and not any(slides):
        cure = "remove `prismatic_unit`, or write `joint: prismatic` in a row of the chain"
        diagnostics.error(
            "AE208", "no joint of the chain is prismatic", column.prismatic_unit.span, help=(cure,)
        )
    if len(column.values) != len(slides):
        report_count("this column", len(column.values), len(slides), column.span, diagnostics)
    for one in column.values:
        if not signed and one.value <= 0:
            diagnostics.error("AE208", f"`{one.node.text}` is not above 0", one.span, help=(ABOVE_0,))
    pairs = zip(column.values, slides, strict=False)
    return np.array(
        [float(one.value if (unit := units[s]) is None else unit.to_si(one.value)) for one, s in pairs],
        dtype=np.float64,
    )


def report_count(name: str, count: int, joints: int, span: SourceSpan, diagnostics: Diagnostics) -> None:
    """Report a wrong number of values.

    Args:
        name: the values, as the subject of a sentence.
        count: number of them.
        joints: number of the chain's joints.
        span: their place in the file.
        diagnostics: for the report.
    """
    headline = f"{name} has {count} values; the chain has {joints} joints"
    cure = "give one value for each joint, from the base outwards"
    diagnostics.error("AE208", headline, span, help=(cure,))


def _read_unit(text: TextField, dimension: Dimension, diagnostics: Diagnostics) -> Unit | None:
    unit = elaborate_unit(text, diagnostics)
    if unit is not None and unit.dimension != dimension:
        headline = f"expected a unit of {dimension}, found `{text.value}`"
        cure = f"write `{dimension}` or another unit of this dimension"
        diagnostics.error("AE208", headline, text.span, help=(cure,))
    return unit
