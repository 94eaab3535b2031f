"""A fault of two bodies that overlap is at the places that a scene declares, with depth and cure."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from aeros.sim.layouts.overlap_faults import overlap_fault
from aeros.spec.diagnostics.source import Source

TEXT = Source("table.yaml", "cube: {}\ncan: {}\n")


def body(name: str, start: int) -> Any:
    return SimpleNamespace(name=name, span=TEXT.span(start, start + 3))


def test_declared_bodies_are_shown_where_they_are_placed() -> None:
    found = overlap_fault("`cube`", "`can`", [body("cube", 0), body("can", 9)], 0.0125)
    assert (found.code, found.headline) == ("AE140", "`cube` and `can` overlap by 12.5 mm")
    assert found.primary is not None
    assert (found.primary.span.start, found.primary.text) == (0, "`cube` is placed here")
    assert [one.span.start for one in found.secondary] == [9]
    assert found.help == ("move one of them, or make it smaller, by at least 12.5 mm",)


def test_bodies_that_no_scene_declares_have_no_place_and_no_cure() -> None:
    found = overlap_fault("`table`", "the robot", [], 0.003)
    assert (found.primary, found.secondary, found.help) == (None, (), ())
