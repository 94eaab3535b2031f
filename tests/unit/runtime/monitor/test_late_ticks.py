"""Late ticks are counted on the wall clock and bounded; here the clock is a list of times."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from aeros.runtime.monitor.late_ticks import LATE_TICKS, LateTickCounter
from aeros.spec.model.motion import LateTicks

LIMITS = LateTicks(Fraction(5, 1000), 2, Fraction(20, 1000))


def counted(cls: type[LateTickCounter], *gaps_ms: float) -> tuple[list[bool], int]:
    """Which ticks stop the robot, by the times between them, and the count."""
    now = [0.0]
    counter = cls(LIMITS, lambda: now[0])
    answers = [counter.tick()]
    for gap in gaps_ms:
        now[0] += gap / 1000.0
        answers.append(counter.tick())
    return answers, counter.count


CASES = [
    ((4, 4, 4), [False] * 4, 0),
    ((6, 6, 4, 6, 6), [False] * 6, 4),
    ((6, 6, 6), [False, False, False, True], 3),
    ((4, 21), [False, False, True], 1),
]


@pytest.mark.parametrize(("gaps", "stops", "count"), CASES)
def test_a_long_gap_or_too_many_in_a_row_stop_the_robot(
    gaps: tuple[float, ...], stops: list[bool], count: int
) -> None:
    assert counted(LateTickCounter, *gaps) == (stops, count)


def test_a_stop_for_late_ticks_has_the_reason_that_the_page_names() -> None:
    page = (Path(__file__).parents[4] / "docs" / "contact.md").read_text("utf-8")
    assert f"The reason of the stop is `{LATE_TICKS}`." in page


def test_time_in_which_nothing_moves_does_not_count() -> None:
    now = [0.0]
    counter = LateTickCounter(LIMITS, lambda: now[0])
    assert not counter.tick()
    now[0] = 60.0
    counter.restart()
    assert not counter.tick()
    assert (counter.count, counter.longest) == (0, 0.0)


def test_gaps_at_their_bounds_are_allowed() -> None:
    now = [1.0]
    counter = LateTickCounter(LateTicks(Fraction(1, 4), 1, Fraction(1)), lambda: now[0])
    answers = [counter.tick()]
    for gap in (0.25, 1.0, 0.25, 1.25, 0.5):
        now[0] += gap
        answers.append(counter.tick())
    assert answers == [False, False, False, False, True, True]
    assert (counter.count, counter.longest) == (3, 1.25)


def test_late_ticks_in_a_row_are_counted_anew_after_a_rest() -> None:
    now = [0.0]
    counter = LateTickCounter(LateTicks(Fraction(1, 4), 1, Fraction(1)), lambda: now[0])
    answers = []
    for _ in range(3):
        counter.restart()
        for _ in range(2):
            answers.append(counter.tick())
            now[0] += 0.5
    assert answers == [False] * 6
    assert counter.count == 3


def test_the_clock_is_the_monotonic_one_of_the_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    counter = LateTickCounter(LIMITS)
    for seconds, stops in ((10.0, False), (10.004, False), (10.1, True)):
        monkeypatch.setattr("time.monotonic", lambda seconds=seconds: seconds)
        assert counter.tick() is stops


class Forgetful(LateTickCounter):
    """Broken: begins anew with every tick."""

    def tick(self) -> bool:
        self.restart()
        return super().tick()


class Lenient(LateTickCounter):
    """Broken: counts, and stops nothing."""

    def tick(self) -> bool:
        super().tick()
        return False


@pytest.mark.parametrize("twin", [Forgetful, Lenient])
def test_a_broken_twin_fails_a_case(twin: type[LateTickCounter]) -> None:
    assert any(counted(twin, *gaps) != (stops, count) for gaps, stops, count in CASES)
