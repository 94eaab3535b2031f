from __future__ import annotations

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.models.interface import ModelFileError
from aeros.models.table import Table, read_table
from tests.unit.models.packages import LEVELS, gauge, value

AXES = {"x": (0.0, 1.0, 3.0), "y": (-1.0, 2.0)}
GRID = Table(AXES, {"z": (0.0, 1.0, 2.0, 5.0, -4.0, 7.0)})
SHARES = st.floats(0.0, 1.0)


def test_a_value_between_four_points_is_their_bilinear_mean() -> None:
    assert GRID.lookup({"x": 0.5, "y": 0.5}) == {"z": (0.0 + 1.0 + 2.0 + 5.0) / 4}
    assert GRID.lookup({"x": 3.0, "y": 2.0}) == {"z": 7.0}


@given(st.tuples(*[SHARES] * 6))
def test_bounds_hold_for_every_point_of_a_box(shares: tuple[float, ...]) -> None:
    a, b, c, d, s, t = shares
    box = {"x": (3 * min(a, b), 3 * max(a, b)), "y": (-1 + 3 * min(c, d), -1 + 3 * max(c, d))}
    point = {
        name: min(max(low + (high - low) * q, low), high)
        for (name, (low, high)), q in zip(box.items(), (s, t), strict=True)
    }
    low, high = GRID.bounds(box)["z"]
    assert low <= GRID.lookup(point)["z"] <= high


def test_bounds_are_reached_at_corners() -> None:
    low, high = GRID.bounds({"x": (0.0, 3.0), "y": (-1.0, 2.0)})["z"]
    assert [low, high] == [-4.0, 7.0]
    assert sum(1 for _ in GRID.corners({"x": (0.5, 2.0), "y": (0.0, 1.0)})) == 6


def test_rows_are_in_any_order() -> None:
    rows = [f"{x},{y},{x * 10 + y}" for x, y in product((3.0, 0.0, 1.0), (2.0, -1.0))]
    content = "\n".join(["x,y,z", *rows]).encode()
    table = read_table("a.csv", content, {"x": value(0, 3), "y": value(-1, 2)}, {"z": value(-10, 40)})
    assert table.lookup({"x": 2.0, "y": 0.5}) == {"z": 20.5}


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        (LEVELS.replace(b"mm", b"cm"), "in `cm`, and the manifest declares `mm`"),
        (LEVELS.replace(b"volume", b"area"), "has no column `volume`"),
        (LEVELS.replace(b"20,", b"15,"), "cover 0 to 15 only"),
        (LEVELS.replace(b"20,", b"10,"), "not one row for each|cover"),
        (LEVELS + b"20,0.5\n", "not one row for each combination of 3 values of `level`"),
        (b"level,volume\n0,0\n", "two different numbers"),
    ],
)
def test_a_table_that_is_no_grid_is_refused(content: bytes, cause: str) -> None:
    package = gauge(content)
    with pytest.raises(ModelFileError, match=cause):
        read_table(package.file, package.content, package.inputs, package.outputs)


@pytest.mark.parametrize(
    ("rows", "cure"),
    [
        ("0,0,1\n0,1,2\n1,0,3\n1,0,4\n", "keep one of the rows for x = 1, y = 0"),
        ("0,0,1\n0,1,2\n1,0,3\n", "add a row for x = 1, y = 1"),
    ],
)
def test_the_first_row_too_many_or_too_few_is_named(rows: str, cure: str) -> None:
    content = f"x,y,z\n{rows}".encode()
    with pytest.raises(ModelFileError) as refused:
        read_table("a.csv", content, {"x": value(0, 1), "y": value(0, 1)}, {"z": value(-10, 40)})
    assert refused.value.cure == cure


def test_a_table_holds_numbers_and_has_few_inputs() -> None:
    package = gauge()
    with pytest.raises(ModelFileError, match="holds single numbers"):
        read_table("a.csv", LEVELS, package.inputs, {"volume": value(0, 1, shape=(2,))})
    with pytest.raises(ModelFileError, match="1 to 4 inputs"):
        read_table("a.csv", LEVELS, {}, package.outputs)
