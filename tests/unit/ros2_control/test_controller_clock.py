"""The controller's clock, from stamps that arrive late, and sometimes very late."""

from __future__ import annotations

from math import inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.ros2_control.controller_clock import ControllerClock
from tests.hypothesis_profiles import examples


def test_before_the_first_states_everything_is_too_old() -> None:
    assert ControllerClock(0.5).age(5.0) == inf


@examples(30)
@given(st.lists(st.floats(0.001, 0.5), min_size=1, max_size=50), st.floats(-1e6, 1e6))
def test_it_is_behind_by_the_shortest_delay(delays: list[float], offset: float) -> None:
    clock = ControllerClock(0.5)
    for number, delay in enumerate(delays):
        clock.note(offset + number, number + delay)
    now = float(len(delays))
    assert clock.read(now) == pytest.approx(offset + now - min(delays), abs=1e-6)


def test_states_that_come_late_are_old() -> None:
    clock = ControllerClock(0.5)
    assert clock.note(100.0, 1.0)
    assert clock.note(100.1, 1.1)
    assert clock.note(100.2, 1.5)
    assert clock.age(1.5) == pytest.approx(0.3)


def test_states_that_are_not_newer_do_not_count() -> None:
    clock = ControllerClock(0.5)
    assert clock.note(100.0, 1.0)
    assert not clock.note(100.0, 1.1)
    assert not clock.note(99.0, 1.2)
    assert clock.newest == 100.0


def test_clocks_that_drift_apart_are_followed() -> None:
    clock = ControllerClock(0.5)
    for second in range(600):
        clock.note(100.0 + second * (1.0 - 1e-3), float(second))
    # 30 s to 60 s of a drift of 1 ms a second.
    assert 0.0 <= clock.age(599.0) < 0.061


def test_one_stamp_far_ahead_makes_no_other_late() -> None:
    clock = ControllerClock(0.1)
    assert clock.note(100.0, 1.0)
    assert not clock.note(10_000.0, 1.01)
    assert clock.age(1.01) == pytest.approx(0.01)
    assert clock.note(100.02, 1.02)
    assert not clock.note(10_000.5, 2.5)  # the first one is long ago, and others came between
    assert clock.note(101.5, 2.5)


def test_a_clock_that_was_set_ahead_is_followed_once_joint_states_have_been_late() -> None:
    clock = ControllerClock(0.1)
    assert clock.note(100.0, 1.0)
    heard = [clock.note(500.0 + number / 100, 1.01 + number / 100) for number in range(110)]
    assert heard.index(True) in (100, 101)
    assert all(heard[101:])
    assert clock.age(2.11) < 0.02
    assert clock.read(2.1) == pytest.approx(501.09)


def test_a_stamp_that_stands_ahead_is_no_clock() -> None:
    clock = ControllerClock(0.1)
    assert clock.note(100.0, 1.0)
    assert not any(clock.note(500.0, 1.01 + number / 100) for number in range(500))
    assert clock.age(6.0) == pytest.approx(5.0)


@pytest.mark.parametrize("first", [10_000.0, 200.0])
def test_after_a_first_stamp_far_ahead_all_states_are_late_and_not_taken_for_fresh(first: float) -> None:
    clock = ControllerClock(0.1)
    assert clock.note(first, 1.0)
    assert not any(clock.note(100.0 + number / 100, 1.0 + number / 100) for number in range(1, 1000))
    assert clock.age(11.0) == pytest.approx(10.0)
