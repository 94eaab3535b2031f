"""Conclusions from pictures of the bench and from touch."""

from __future__ import annotations

from math import pi

import pytest

from aeros.sim.geometry import Vector3
from aeros.sim.layouts.dumpling_bench import (
    ALIGNED_POSITION,
    DumplingTracker,
    WrapperDetection,
)

CLOSED = WrapperDetection(ALIGNED_POSITION, 0.0, pi)
ON_ITS_EDGE = CLOSED._replace(fold=None)


def test_a_closed_wrapper_may_hide_its_filling() -> None:
    assert DumplingTracker().add_overhead_view(CLOSED, None, 0.0)["filling_on_workspace"] is True


def test_a_wrapper_on_its_edge_hides_no_filling_unless_it_was_wrapped() -> None:
    inspector = DumplingTracker()
    assert inspector.add_overhead_view(ON_ITS_EDGE, None, 0.0)["filling_on_workspace"] is False
    inspector.add_press_force(1000.0)
    inspector.add_overhead_view(CLOSED, None, 1.0)
    assert inspector.add_side_view(filled=True) == {"dumpling_wrapped": True}
    assert inspector.add_overhead_view(ON_ITS_EDGE, None, 2.0)["filling_on_workspace"] is True


@pytest.mark.parametrize(
    ("fold", "is_closed"), [(None, True), (0.0, False), (2.79, False), (2.80, True), (pi, True)]
)
def test_a_wrapper_is_closed_from_160_degrees_on_or_on_its_edge(fold: float | None, is_closed: bool) -> None:
    assert CLOSED._replace(fold=fold).is_closed is is_closed


def test_the_middle_of_a_plate_is_22_mm_from_its_hinge() -> None:
    assert WrapperDetection((1.0, 2.0, 3.0), 0.0, 0.0).middle == pytest.approx((1.022, 2.0, 3.0))
    assert WrapperDetection((1.0, 2.0, 3.0), pi / 2, 0.0).middle == pytest.approx((1.0, 2.022, 3.0))


# Over the middle of a plate at (1.022, 2, 3), a filling of 17 mm rests at 3 + 3 mm + 8.5 mm.
@pytest.mark.parametrize(
    ("filling", "is_carried"),
    [
        ((1.022, 2.0, 3.0115), True),
        ((1.042, 2.0, 3.0115), True),
        ((1.044, 2.0, 3.0115), False),
        ((1.000, 2.0, 3.0115), False),
        ((1.022, 2.027, 3.0115), True),
        ((1.022, 2.029, 3.0115), False),
        ((1.022, 2.0, 3.017), True),
        ((1.022, 2.0, 3.018), False),
        ((1.022, 2.0, 3.005), False),
    ],
)
def test_a_plate_carries_a_filling_that_lies_over_it(filling: Vector3, is_carried: bool) -> None:
    seen = WrapperDetection((1.0, 2.0, 3.0), 0.0, 0.0)
    assert seen.carries(filling) is is_carried


@pytest.mark.parametrize(
    ("off", "yaw", "is_aligned", "is_dough_there"),
    [
        ((0.0, 0.0, 0.0), 0.0, True, True),
        ((0.0079, 0.0099, 0.0059), 0.139, True, True),
        ((-0.0081, 0.0, 0.0), 0.0, False, True),
        ((0.0, -0.0101, 0.0), 0.0, False, True),
        ((0.0, 0.0, -0.0061), 0.0, False, True),
        ((0.0, 0.0, 0.0), -0.14, False, True),
        ((0.0, 0.039, 0.014), 0.0, False, True),
        ((0.03, 0.03, 0.0), 0.0, False, False),
        ((0.0, 0.041, 0.0), 0.0, False, False),
        ((0.0, 0.0, 0.016), 0.0, False, False),
    ],
)
def test_a_wrapper_is_aligned_with_the_press_or_only_on_it(
    off: Vector3, yaw: float, is_aligned: bool, is_dough_there: bool
) -> None:
    x, y, z = ALIGNED_POSITION
    hinge = (x + off[0], y + off[1], z + off[2])
    seen = DumplingTracker().add_overhead_view(WrapperDetection(hinge, yaw, 0.5), None, 0.0)
    assert (seen["wrapper_aligned"], seen["dough_on_workspace"]) == (is_aligned, is_dough_there)
    assert (seen["wrapper_position"], seen["wrapper_yaw"], seen["wrapper_fold"]) == (hinge, yaw, 0.5)
    assert seen["filling_position"] is None


OPEN = CLOSED._replace(fold=0.0)
ON_PLATE = (ALIGNED_POSITION[0] + 0.022, ALIGNED_POSITION[1], ALIGNED_POSITION[2] + 0.0115)


def test_an_open_wrapper_shows_if_there_is_a_filling_on_it() -> None:
    for filling, is_there in ((ON_PLATE, True), ((0.36, 0.24, 0.0595), False), (None, False)):
        seen = DumplingTracker().add_overhead_view(OPEN, filling, 0.0)
        assert (seen["filling_position"], seen["filling_on_workspace"]) == (filling, is_there)


def test_a_picture_without_a_wrapper_says_nothing_of_it() -> None:
    tracker = DumplingTracker()
    tracker.add_overhead_view(OPEN, None, 0.0)
    seen = tracker.add_overhead_view(None, ON_PLATE, 1.0)
    assert tracker.wrapper is None
    assert seen.pop("filling_position") == ON_PLATE
    assert set(seen.values()) == {None}
    assert set(seen) == {
        "wrapper_position",
        "wrapper_yaw",
        "wrapper_fold",
        "dough_on_workspace",
        "filling_on_workspace",
        "wrapper_aligned",
    }


def _wrapped() -> DumplingTracker:
    tracker = DumplingTracker()
    tracker.add_overhead_view(CLOSED, None, 0.0)
    tracker.add_press_force(1.5)
    tracker.add_press_force(0.0)
    assert tracker.add_side_view(filled=True) == {"dumpling_wrapped": True}
    return tracker


@pytest.mark.parametrize(
    ("wrapper", "force", "filled", "is_wrapped"),
    [
        (CLOSED, 1.5, True, True),
        (CLOSED, 1.0, True, False),
        (CLOSED, 1.5, False, False),
        (OPEN, 1.5, True, False),
        (None, 1.5, True, False),
    ],
)
def test_a_dumpling_is_wrapped_if_it_is_closed_filled_and_was_pressed(
    wrapper: WrapperDetection | None, force: float, filled: bool, is_wrapped: bool
) -> None:
    tracker = DumplingTracker()
    tracker.add_overhead_view(wrapper, None, 0.0)
    tracker.add_press_force(force)
    assert tracker.add_side_view(filled=filled) == {"dumpling_wrapped": is_wrapped}


def test_a_dumpling_that_opens_is_no_longer_wrapped_and_was_not_pressed() -> None:
    tracker = _wrapped()
    assert tracker.add_overhead_view(CLOSED, None, 1.0)["dumpling_wrapped"] is True
    assert tracker.add_overhead_view(OPEN, None, 2.0)["dumpling_wrapped"] is False
    tracker.add_overhead_view(CLOSED, None, 3.0)
    assert tracker.add_side_view(filled=True) == {"dumpling_wrapped": False}


def test_a_wrapped_dumpling_is_supplied_wherever_it_is() -> None:
    away = CLOSED._replace(hinge=(0.1, 0.1, 0.1))
    assert _wrapped().add_overhead_view(away, None, 1.0)["dough_on_workspace"] is True
    assert DumplingTracker().add_overhead_view(away, None, 1.0)["dough_on_workspace"] is False


IN_POT = CLOSED._replace(hinge=(0.528, 0.33, 0.02))
"""With the middle of its plate over the middle of the pot."""


def _is_cooked(tracker: DumplingTracker, *views: tuple[WrapperDetection, Vector3 | None, float]) -> bool:
    seen = [tracker.add_overhead_view(*view)["dumpling_cooked"] for view in views]
    return bool(seen[-1])


def test_a_wrapped_dumpling_is_cooked_after_5_s_in_the_pot() -> None:
    assert not _is_cooked(_wrapped(), (IN_POT, None, 10.0), (IN_POT, None, 14.9))
    assert _is_cooked(_wrapped(), (IN_POT, None, 10.0), (IN_POT, None, 12.0), (IN_POT, None, 15.0))
    assert _is_cooked(_wrapped(), (IN_POT, None, 10.0), (IN_POT, None, 15.0), (CLOSED, None, 16.0))
    assert not _is_cooked(DumplingTracker(), (IN_POT, None, 10.0), (IN_POT, None, 20.0))


def test_cooking_starts_anew_after_a_look_outside_the_pot() -> None:
    views = [(IN_POT, None, 10.0), (CLOSED, None, 12.0), (IN_POT, None, 13.0)]
    assert not _is_cooked(_wrapped(), *views, (IN_POT, None, 17.0))
    assert _is_cooked(_wrapped(), *views, (IN_POT, None, 18.0))


@pytest.mark.parametrize(
    ("hinge", "filling", "is_in_pot"),
    [
        ((0.528, 0.33, 0.02), (0.55, 0.33, 0.03), True),
        ((0.528, 0.33, 0.02), (0.55, 0.33, 0.06), False),
        ((0.607, 0.33, 0.02), None, True),
        ((0.609, 0.33, 0.02), None, False),
        ((0.528, 0.414, 0.02), None, True),
        ((0.528, 0.416, 0.02), None, False),
        ((0.528, 0.33, 0.054), None, True),
        ((0.528, 0.33, 0.056), None, False),
        ((0.528, 0.33, 0.004), None, False),
    ],
)
def test_a_dumpling_cooks_inside_the_pot_alone(
    hinge: Vector3, filling: Vector3 | None, is_in_pot: bool
) -> None:
    placed = CLOSED._replace(hinge=hinge)
    assert _is_cooked(_wrapped(), (placed, filling, 10.0), (placed, filling, 15.0)) is is_in_pot
