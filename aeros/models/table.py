"""Lookup tables: multilinear interpolation between points of a full grid, and bounds of it over boxes.

    f(x) = sum over the corners c of x's cell: f(c) * product over the axes i: (1 - |x_i - c_i| / width_i)

A table with one input is piecewise linear. Between the points of its grid a table never leaves the range of
the values at them, and outside of the grid it has none.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final

from aeros.models.columns import read_columns, split_header
from aeros.models.interface import ModelFileError, ValueInterface

MAX_INPUTS: Final = 4
"""Limit on the inputs of a table: one lookup reads 2 to the power of their number."""

ROUNDING: Final = 2.0**-44
"""Error of one interpolation in doubles, relative to the greatest value: at most 4 * 4 roundings of
2**-53."""


@dataclass(frozen=True)
class Table:
    """Values at the points of a grid, in the units of the file.

    Attributes:
        axes: the increasing coordinates of the grid along each input, by the input's name.
        values: the values of each output by its name, at all points; the last input varies fastest.
    """

    axes: Mapping[str, tuple[float, ...]]
    values: Mapping[str, tuple[float, ...]]

    def lookup(self, point: Mapping[str, float]) -> dict[str, float]:
        """Interpolate every output at a point.

        Args:
            point: a coordinate for each input, between the ends of its axis.

        Returns:
            The value of each output, within the values at the corners of the point's cell.
        """
        cells = []
        for name, axis in self.axes.items():
            index = min(max(bisect_right(axis, point[name]) - 1, 0), len(axis) - 2)
            cells.append((index, (point[name] - axis[index]) / (axis[index + 1] - axis[index])))
        found = {}
        for name, values in self.values.items():
            corners = [values[at] for at in self._corners([index for index, _ in cells])]
            low, high = min(corners), max(corners)
            for _, share in reversed(cells):  # the last input varies fastest
                corners = [a + (b - a) * share for a, b in zip(corners[::2], corners[1::2], strict=True)]
            found[name] = min(max(corners[0], low), high)
        return found

    def bounds(self, box: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
        """Bound every output over a box of inputs; the bounds hold for `lookup`, rounding included.

        An interpolation along one input is linear between two points, so it is extreme at a corner of the
        part of a cell that is in the box.

        Args:
            box: least and greatest value of each input, between the ends of its axis.

        Returns:
            Least and greatest value of each output.
        """
        bounds: dict[str, tuple[float, float]] = {}
        for corner in self.corners(box):
            for name, value in self.lookup(corner).items():
                low, high = bounds.get(name, (value, value))
                bounds[name] = min(low, value), max(high, value)
        # Rounded or not, a lookup stays within the values at the corners of its cell.
        cells = list(self._positions_around(box))
        ends = {}
        for name, (low, high) in bounds.items():
            slack = ROUNDING * max(map(abs, self.values[name]))
            near = [self.values[name][at] for at in cells]
            ends[name] = max(low - slack, min(near)), min(high + slack, max(near))
        return ends

    def corners(self, box: Mapping[str, tuple[float, float]]) -> Iterator[dict[str, float]]:
        """List the corners of all parts of cells in a box.

        Args:
            box: least and greatest value of each input, between the ends of its axis.

        Yields:
            The corners.
        """
        points = [
            (low, *axis[bisect_right(axis, low) : bisect_left(axis, high)], high)
            for (low, high), axis in ((box[name], axis) for name, axis in self.axes.items())
        ]
        for corner in product(*points):
            yield dict(zip(self.axes, corner, strict=True))

    def _positions_around(self, box: Mapping[str, tuple[float, float]]) -> Iterator[int]:
        """Yield the positions in `values` of all corners of cells that a box touches."""
        spans = []
        for name, axis in self.axes.items():
            low, high = box[name]
            first = min(max(bisect_right(axis, low) - 1, 0), len(axis) - 2)
            spans.append(range(first, max(bisect_left(axis, high), first + 1) + 1))
        for indices in product(*spans):
            position = 0
            for index, axis in zip(indices, self.axes.values(), strict=True):
                position = position * len(axis) + index
            yield position

    def _corners(self, indices: Sequence[int]) -> list[int]:
        """Return the positions of a cell's corners in `values`; the last input varies fastest."""
        positions = [0]
        for index, axis in zip(indices, self.axes.values(), strict=True):
            positions = [at * len(axis) + index + step for at in positions for step in (0, 1)]
        return positions


def read_table(
    file: str,
    content: bytes,
    inputs: Mapping[str, ValueInterface],
    outputs: Mapping[str, ValueInterface],
) -> Table:
    """Read the table of a model from its file.

    Args:
        file: name of the file.
        content: bytes of the file.
        inputs: inputs of the model by name.
        outputs: outputs of the model by name.

    Returns:
        The table.

    Raises:
        ModelFileError: the file is malformed, lacks a column or has it in another unit, its rows are not the
            points of one full grid, or the grid does not reach to the ends of an input's range.
    """
    if not 1 <= len(inputs) <= MAX_INPUTS:
        raise ModelFileError(f"a table has 1 to {MAX_INPUTS} inputs, not {len(inputs)}")
    columns = _named_columns(file, read_columns(file, content), {**inputs, **outputs})
    axes = {name: tuple(sorted(set(columns[name]))) for name in inputs}
    for name, axis in axes.items():
        if len(axis) < 2:
            headline = f"the column `{name}` of `{file}` needs two different numbers at least"
            raise ModelFileError(headline, "add rows with other values, or remove this input")
        lower, upper = (end / inputs[name].factor for end in (inputs[name].lower, inputs[name].upper))
        if not (axis[0] <= lower and upper <= axis[-1]):
            raise ModelFileError(
                f"the range of `{name}` is {lower:g} to {upper:g} {inputs[name].unit}, and the rows of "
                f"`{file}` cover {axis[0]:g} to {axis[-1]:g} only",
                f"add rows for the rest, or declare `range: [{_exact(axis[0])}, {_exact(axis[-1])}]`",
            )
    points = list(zip(*(columns[name] for name in inputs), strict=True))
    position = {point: row for row, point in enumerate(points)}
    grid = list(product(*axes.values())) if _grid_size(axes) == len(points) else []
    if len(position) != len(points) or not all(point in position for point in grid) or not grid:
        raise ModelFileError(
            f"the {len(points)} rows of `{file}` are not one row for each combination of "
            f"{' times '.join(f'{len(axis)} values of `{name}`' for name, axis in axes.items())}",
            _grid_cure(axes, points),
        )
    order = [position[point] for point in grid]
    return Table(axes, {name: tuple(columns[name][row] for row in order) for name in outputs})


def _named_columns(
    file: str, columns: Mapping[str, tuple[float, ...]], declared: Mapping[str, ValueInterface]
) -> dict[str, tuple[float, ...]]:
    """Return the declared columns by name, each in the declared unit.

    Raises:
        ModelFileError: a column is missing, or has another unit.
    """
    headers = {split_header(header)[0]: header for header in columns}
    for name, value in declared.items():
        if value.shape:
            headline = f"`{name}` has a shape, and a table holds single numbers"
            raise ModelFileError(headline, "remove its `shape`, and declare one output for each number")
        if name not in headers:
            headline = f"`{file}` has no column `{name}`; it has {', '.join(headers)}"
            raise ModelFileError(headline, f"name a column `{name}`, or correct the name in the manifest")
        unit = split_header(headers[name])[1]
        if unit is not None and unit != value.unit:
            raise ModelFileError(
                f"the column `{name}` of `{file}` is in `{unit}`, and the manifest declares `{value.unit}`",
                f"declare `unit: {unit}` and the range in it, or convert the column",
            )
    return {name: columns[headers[name]] for name in declared}


def _exact(number: float) -> str:
    """Format a number so that it is read back as the same double."""
    short = f"{number:g}"
    return short if float(short) == number else repr(number)


def _grid_cure(axes: Mapping[str, tuple[float, ...]], points: Sequence[tuple[float, ...]]) -> str:
    """Name the first row that is there twice, or else the first point without a row."""
    seen: set[tuple[float, ...]] = set()
    for point in points:
        if point in seen:
            return f"keep one of the rows for {_point_text(axes, point)}"
        seen.add(point)
    missing = next((point for point in product(*axes.values()) if point not in seen), None)
    return "" if missing is None else f"add a row for {_point_text(axes, missing)}"


def _point_text(axes: Mapping[str, tuple[float, ...]], point: tuple[float, ...]) -> str:
    return ", ".join(f"{name} = {number:g}" for name, number in zip(axes, point, strict=True))


def _grid_size(axes: Mapping[str, tuple[float, ...]]) -> int:
    size = 1
    for axis in axes.values():
        size *= len(axis)
    return size
