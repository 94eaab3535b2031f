"""The sketch of the cell: volumes, and where robot and people went."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from xml.etree import ElementTree

import pytest

from aeros.apps.report_page.cell_sketch import PERSON, SketchPath, cell_sketch, paths_of
from aeros.apps.report_page.run_data import RunData
from aeros.spec.expr.scope import AxisAlignedBox
from aeros.spec.model.site import Site
from tests.unit.runtime.monitor.test_rule_bounds import SITE

NEAR = AxisAlignedBox((Fraction(0),) * 3, (Fraction(1),) * 3)
FAR = AxisAlignedBox((Fraction(500),) * 3, (Fraction(600),) * 3)
PATH = SketchPath("tool_position", [(0.0, 0.0), (0.5, 0.5), (1.0, 0.0)])


def with_volumes(**volumes: AxisAlignedBox) -> Site:
    return replace(SITE, volumes=volumes)


def drawn(site: Site, paths: list[SketchPath]) -> ElementTree.Element:
    sketch = cell_sketch(site, paths)
    assert sketch is not None
    return ElementTree.fromstring(f"<div>{sketch}</div>")  # noqa: S314 - our own


def test_paths_are_those_of_the_robot_and_of_people() -> None:
    state = {"tool_position": [[0.1, 0.2, 0.3], 1.0], "human_distance": [2.0, 1.0]}
    odd = {"tool_position": [["x"], 1.0], "base_position": None}
    people = [(0.0, ((1.0, 2.0),)), (1.0, ((1.5, 2.0), (3.0, 3.0)))]
    run = RunData(samples=[(1.0, state), (2.0, odd)], people=people)
    assert paths_of(run, SITE) == [
        SketchPath("tool_position", [(0.1, 0.2)]),
        SketchPath(PERSON, [(1.0, 2.0), (1.5, 2.0)]),
        SketchPath(PERSON, [(3.0, 3.0)]),
    ]


def test_near_volumes_and_each_path_are_drawn() -> None:
    person = SketchPath(PERSON, [(0.0, 1.0), (1.0, 1.0)])
    found = drawn(with_volumes(near=NEAR, far=FAR), [PATH, person])
    assert [one.text for one in found.iter("title")] == [
        "the cell from above", "near", "tool_position", "tool_position", "person", "person",
    ]  # fmt: skip
    lines = [one.attrib for one in found.iter("polyline")]
    assert "stroke-dasharray" not in lines[0]
    assert "stroke-dasharray" in lines[1]
    (svg, *_) = found.iter("svg")
    width, height = float(svg.attrib["width"]), float(svg.attrib["height"])
    for line in lines:
        for point in line["points"].split():
            x, y = map(float, point.split(","))
            assert 0.0 <= x <= width
            assert 0.0 <= y <= height


def test_up_is_y() -> None:
    (line,) = drawn(with_volumes(), [SketchPath("p", [(0.0, 0.0), (0.0, 1.0)])]).iter("polyline")
    (_, low), (_, high) = (map(float, one.split(",")) for one in line.attrib["points"].split())
    assert high < low


def test_names_are_text() -> None:
    found = drawn(with_volumes(), [SketchPath("<b>", [(0.0, 0.0)])])
    assert "<b>" in [one.text for one in found.iter("title")]


def test_without_paths_the_volumes_are_drawn_and_without_both_nothing() -> None:
    assert [one.text for one in drawn(with_volumes(near=NEAR), []).iter("title")][1:] == ["near"]
    assert cell_sketch(with_volumes(), []) is None


@pytest.mark.parametrize(("size", "label"), [("0.05", "0.01 m"), ("3", "1 m"), ("100000", "10000 m")])
def test_the_bar_of_the_scale_fits(size: str, label: str) -> None:
    cell = AxisAlignedBox((Fraction(0),) * 3, (Fraction(size),) * 3)
    found = drawn(with_volumes(cell=cell), [])
    (bar,) = [one for one in found.iter("path") if one.attrib.get("class") == "axis"]
    assert 10.0 < float(bar.attrib["d"].partition("h")[2]) < float(next(found.iter("svg")).attrib["width"])
    assert label in [one.text for one in found.iter("text")]
