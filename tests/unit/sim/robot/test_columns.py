"""Columns of a robot file: units of both kinds of joints, and faults with their places."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.sim.robot.columns import EFFORT, POSITION, STIFFNESS, per_time, read_column
from aeros.spec.declared.decode import decode
from aeros.spec.declared.robots.robot import Column
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.expr.units import ANGLE, FORCE, LENGTH, TIME
from aeros.spec.text.files import read_source
from aeros.spec.text.yaml_reader import read_yaml


def column(folder: Path, text: str) -> Column:
    path = folder / "column.yaml"
    path.write_text(text, encoding="utf-8")
    diagnostics = Diagnostics()
    node = read_yaml(read_source(path), diagnostics)
    assert node is not None
    found = decode(node, Column, diagnostics)
    assert found is not None, list(diagnostics)
    return found


def test_dimensions_are_divided_and_multiplied_by_time() -> None:
    assert per_time(POSITION, 2) == (ANGLE * TIME**-2, LENGTH * TIME**-2)
    assert per_time(STIFFNESS, -1) == (FORCE * LENGTH * ANGLE**-1 * TIME, FORCE * LENGTH**-1 * TIME)


def test_each_kind_of_joint_has_its_unit(tmp_path: Path) -> None:
    text = "unit: deg\nprismatic_unit: mm\nvalues: [180, -5]\n"
    diagnostics = Diagnostics()
    values = read_column(column(tmp_path, text), POSITION, [False, True], diagnostics, signed=True)
    assert list(diagnostics) == []
    assert values.tolist() == pytest.approx([3.14159265, -0.005])


@pytest.mark.parametrize(
    ("text", "slides", "headline", "line"),
    [
        ("unit: Nm\nvalues: [1]\n", [False, False], "this column has 1 values; the chain has 2 joints", 1),
        ("unit: m\nvalues: [1]\n", [False], "expected a unit of N*m, found `m`", 1),
        ("unit: Nm\nvalues:\n  - 1\n  - 0\n", [False] * 2, "`0` is not above 0", 4),
        ("unit: Nm\nvalues: [1, 1]\n", [False, True], "`prismatic_unit` is missing: joint 2 is prismatic", 1),
        ("unit: Nm\nprismatic_unit: N\nvalues: [1]\n", [False], "no joint of the chain is prismatic", 2),
    ],
)
def test_faults_have_place_cause_and_cure(
    tmp_path: Path, text: str, slides: list[bool], headline: str, line: int
) -> None:
    diagnostics = Diagnostics()
    read_column(column(tmp_path, text), EFFORT, slides, diagnostics)
    (found,) = diagnostics
    assert found.headline == headline
    assert found.primary is not None
    assert found.primary.span.line == line
    assert found.help
