"""A run along the plant's clock: what happened is marked; what was measured is beside its bounds."""

from __future__ import annotations

import math
import re
from itertools import combinations
from xml.etree import ElementTree

import pytest

from aeros.apps.report_page.plots import COLOURS, Mark, category_of, collect_marks, plot, timeline
from aeros.apps.report_page.run_data import RecordedDecision, RunData, SkillExecution, TraceEvent
from aeros.apps.report_page.series import Limit, PlottedQuantity


def titles(svg: str) -> list[str]:
    root = ElementTree.fromstring(svg)  # noqa: S314 - our own
    return [one.text or "" for one in root.iter() if one.tag.endswith("title")]


def ended(status: str, *, failed: bool | None = None, reason: str = "") -> SkillExecution:
    return SkillExecution("m.a", 1.0, None, 2.0, status, reason, "step", None, failed)


def test_faults_stops_denials_and_re_plans_are_marked_in_order() -> None:
    left = RunData(
        events=[
            TraceEvent(4.0, "replan", "re-plan 1: it failed", {}),
            TraceEvent(0.5, "fault-started", "the object slips", {}),
            TraceEvent(0.7, "wait-started", "waits 1 s", {}),
        ],
        decisions=[
            RecordedDecision(
                1, 3.0, "DENY", "m.a", "move_tool", {}, {}, (("AE750", "arm-standing", "near"),), None, {}
            ),
            RecordedDecision(2, 3.5, "ALLOW", "m.a", "move_tool", {}, {}, (), None, {}),
        ],
        runs=[ended("stopped", reason="monitor:separation"), ended("finished"), ended("denied")],
        pause_changes=[(2.5, "paused")],
    )
    assert collect_marks(left) == [
        Mark(0.5, "fault", "the object slips"),
        Mark(2.0, "stopped", "stop: m.a: monitor:separation"),
        Mark(2.5, "stopped", "paused by the operator"),
        Mark(3.0, "denied", "m.a asks for move_tool: arm-standing"),
        Mark(4.0, "re-plan", "re-plan 1: it failed"),
    ]


@pytest.mark.parametrize(
    ("run", "sort"),
    [
        (SkillExecution("m.a", 0.0), "under way"),
        (ended("finished", failed=False), "succeeded"),
        (ended("finished", failed=True), "failed"),
        (ended("denied", failed=True), "denied"),
        (ended("halted", failed=True), "stopped"),
    ],
)
def test_a_step_has_the_colour_of_its_end(run: SkillExecution, sort: str) -> None:
    assert category_of(run) == sort
    assert f'fill="{COLOURS[sort]}"' in timeline(RunData(runs=[run]), [])


def test_each_step_says_when_and_how() -> None:
    shown = titles(timeline(RunData(runs=[ended("halted", reason="the <operator> stops it")]), []))
    assert "step m.a, 1.00 to 2.00 s: halted the <operator> stops it" in shown


def test_bounds_are_drawn_from_decision_to_decision_with_their_rules() -> None:
    limits = [Limit(1.0, 0.9, "arm-separation"), Limit(3.0, None, ""), Limit(5.0, 1.2, "reduced-speed")]
    quantity = PlottedQuantity("human_distance", "m", False, True, [(0.0, 3.0), (10.0, 2.0)], [], limits)
    svg = plot(quantity, [Mark(2.0, "stopped", "stop")], 10.0)
    shown = titles(svg)
    assert "arm-separation: 0.9 m from 1.00 s" in shown
    assert "reduced-speed: 1.2 m from 5.00 s" in shown
    assert "2.00 s stop" in shown
    # 90 px a second: from 1 to 3 s, and from 5 s to the end.
    assert re.findall(r'd="M([\d.]+) [\d.]+h([\d.]+)"', svg) == [("280.0", "180.0"), ("640.0", "450.0")]


def test_a_request_ends_with_its_action() -> None:
    quantity = PlottedQuantity(
        "move.speed", "m/s", True, True, [(1.0, 0.2), (3.0, None)], [Limit(1.0, 0.5, "r")]
    )
    assert re.findall(r"M([\d.]+) [\d.]+H([\d.]+)\"", plot(quantity, [], 10.0)) == [("280.0", "460.0")]


def test_of_a_long_run_the_least_and_the_greatest_of_each_place_are_kept() -> None:
    points: list[tuple[float, float | None]] = [(n / 1000, 1.0) for n in range(200_000)]
    points[77_777] = (77.777, 0.1)
    svg = plot(PlottedQuantity("x", "", False, True, points, [Limit(0.0, 2.0, "r")]), [], 200.0)
    assert len(svg) < 60_000
    (line,) = re.findall(r'<polyline points="([^"]*)"', svg)
    ordinates = {pair.partition(",")[2] for pair in line.split()}
    assert len(ordinates) == 2


def test_a_value_far_beyond_its_bounds_leaves_them_legible() -> None:
    quantity = PlottedQuantity("x", "m", False, True, [(0.0, 20.0), (1.0, 0.5)], [], [Limit(0.0, 1.0, "r")])
    assert ">2.5 m<" in plot(quantity, [], 1.0)


def test_a_run_in_which_nothing_happened_is_drawn_too() -> None:
    assert titles(timeline(RunData(), [])) == ["timeline of steps", "marks"]
    plot(PlottedQuantity("x", "", False, True, [(0.0, 0.0)], [Limit(0.0, 0.0, "r")]), [], 0.0)


def linear(value: int) -> float:
    share = value / 255
    return share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4


def lab(red: float, green: float, blue: float) -> tuple[float, float, float]:
    """CIELAB coordinates of linear sRGB, white point D65."""
    x = (0.4124 * red + 0.3576 * green + 0.1805 * blue) / 0.9505
    y = 0.2126 * red + 0.7152 * green + 0.0722 * blue
    z = (0.0193 * red + 0.1192 * green + 0.9505 * blue) / 1.0888
    f, g, h = (max(one, 0.0) ** (1 / 3) if one > 0.008856 else 7.787 * one + 16 / 116 for one in (x, y, z))
    return (116 * g - 16, 500 * (f - g), 200 * (g - h))


VISION = {
    "normal": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "protanopia": ((0.1523, 1.0526, -0.2049), (0.1145, 0.7863, 0.0992), (-0.0039, -0.0481, 1.0520)),
    "deuteranopia": ((0.3673, 0.8606, -0.2280), (0.2801, 0.6725, 0.0474), (-0.0118, 0.0429, 0.9689)),
    "tritanopia": ((1.2555, -0.0767, -0.1788), (-0.0784, 0.9308, 0.1476), (0.0047, 0.6914, 0.3039)),
}
"""Matrices for linear RGB by Machado, Oliveira and Fernandes (2009), severity 1."""


@pytest.mark.parametrize("vision", VISION)
def test_everybody_tells_the_colours_apart(vision: str) -> None:
    colours = sorted(set(COLOURS.values()) - {COLOURS["under way"]})
    assert len(colours) == 4
    seen = []
    for colour in colours:
        rgb = [linear(int(colour[at : at + 2], 16)) for at in (1, 3, 5)]
        seen.append(lab(*(sum(a * b for a, b in zip(row, rgb, strict=True)) for row in VISION[vision])))
    assert all(math.dist(one, other) > 15.0 for one, other in combinations(seen, 2))
