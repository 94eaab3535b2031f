"""Bounds of the time that parts take, by declared durations and timeouts of skills."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.spec.consequences.durations import longest_duration, may_be_late, shortest_success
from aeros.spec.model.composition import Part, Step
from aeros.spec.model.step_graph import FailingPart, Fallback, If, Par, RetriedPart, Seq, TimedPart
from tests.unit.agent.dumplings import SPAN, outcome, skill, term

SECONDS = {"quick": (2, 3), "slow": (5, 1), "silent": (None, 4)}
SKILLS = {
    name: replace(
        skill(
            name,
            replace(outcome("done", {}), duration=None if done is None else Fraction(done)),
            replace(outcome("failed", {}, failure=True), duration=Fraction(failed)),
        ),
        timeout=Fraction(60),
    )
    for name, (done, failed) in SECONDS.items()
}
HANDLERS = {"h": Step("h", "slow", {}, {}, 0, None, None, SPAN)}


def step(name: str, retry: int = 0, between: str | None = None, last: str | None = None) -> Step:
    return Step(name, name, {}, {}, retry, between, last, SPAN)


QUICK, SLOW, SILENT = step("quick"), step("slow"), step("silent")


BOTH: Part = Seq((QUICK, SLOW))


def within(part: Part, seconds: int) -> TimedPart[Step]:
    return TimedPart(part, SPAN, True, Fraction(seconds))


@pytest.mark.parametrize(
    ("part", "longest", "shortest"),
    [
        (QUICK, 3, 2),
        (SLOW, 5, 5),
        (SILENT, 60, 0),
        (step("quick", 2), 9, 2),
        (step("quick", 1, "h", "h"), 3 + 3 + 5 + 5, 2),
        (Seq((QUICK, SLOW)), 8, 7),
        (Par((QUICK, SLOW), SPAN), 5, 5),
        (Fallback((QUICK, SLOW), SPAN), 8, 2),
        (Fallback((QUICK, Seq(())), SPAN), 3, 0),
        (If(term("wrapper_aligned"), "", QUICK, SLOW, SPAN), 5, 2),
        (If(term("wrapper_aligned"), "", SLOW, None, SPAN), 5, 5),
        (RetriedPart(BOTH, 1, SPAN), 16, 7),
        (within(SILENT, 20), 20, 0),
        (FailingPart("", SPAN), 0, None),
        (Seq((QUICK, FailingPart("", SPAN))), 3, None),
    ],
)
def test_times_are_bounded(part: Part, longest: int, shortest: int | None) -> None:
    assert longest_duration(part, HANDLERS, SKILLS) == longest
    assert shortest_success(part, SKILLS) == shortest


def test_a_part_may_be_late_if_its_longest_time_is_longer_than_its_own() -> None:
    assert not may_be_late(within(QUICK, 3), HANDLERS, SKILLS)
    assert may_be_late(within(QUICK, 2), HANDLERS, SKILLS)
