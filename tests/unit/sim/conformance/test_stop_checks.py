"""Each of these checks accepts a whole twin of a plant and refuses one that breaks its promise."""

from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.sim.conformance import stop_checks
from aeros.sim.conformance.plant_under_test import ConformanceError, PlantUnderTest, RecordingMonitor
from aeros.sim.conformance.suite import Check
from aeros.sim.fake import FakePlant
from aeros.skill import act
from tests.unit.sim.conformance.broken import Twin
from tests.unit.sim.conformance.twins import accept, broken_twins, refuse, whole_twins


@pytest.mark.parametrize(("check", "twin"), whole_twins(stop_checks))
def test_the_twin_that_is_not_broken_passes(check: Check, twin: type[Twin]) -> None:
    accept(check, twin)


@pytest.mark.parametrize(("check", "twin", "why"), broken_twins(stop_checks))
def test_a_broken_twin_is_refused(check: Check, twin: type[Twin], why: str) -> None:
    refuse(check, twin, why)


# The way of braking, by hand: ticks of 0.01 s, and 0.5 s at the longest.

BRAKING = PlantUnderTest(
    make_plant=FakePlant,
    motion_action=act("move"),
    parallel_action=act("wait"),
    period=0.01,
    max_stop_time=0.5,
    deceleration=(2.0, 4.0),
)


def braked(rest: tuple[float, float], *, subject: PlantUnderTest = BRAKING) -> None:
    """Two joints at 1 and -1 rad/s, last seen at 0.01 and -0.01 rad, come to rest there."""
    watch = RecordingMonitor()
    for tick, q in enumerate(((-9.0, 9.0), (0.0, 0.0), (0.01, -0.01))):
        watch(0.01 * tick, {"joint_position": q})
    stop_checks._require_braking_distance(subject, watch, {"joint_position": rest})


@pytest.mark.parametrize(
    ("ways", "why"),
    [
        # At least v²/2a: 0.25 and 0.125 rad. At most v·T/2 and two ticks: 0.27 rad.
        ((0.25, 0.125), None),
        ((0.2699, 0.2699), None),
        ((0.2499, 0.125), "a stop within the limits needs 0.2500 rad or m; it took 0.2499"),
        ((0.25, 0.1249), "a stop within the limits needs 0.1250 rad or m; it took 0.1249"),
        ((0.2701, 0.125), "while stopping, a joint moved by 0.2701 rad or m; 0.2700 would be enough"),
        ((0.25, 0.2701), "while stopping, a joint moved by 0.2701 rad"),
        ((-0.25, 0.125), "it took -0.2500"),
    ],
)
def test_joints_brake_neither_shorter_than_their_limits_allow_nor_longer_than_needed(
    ways: tuple[float, float], why: str | None
) -> None:
    rest = (0.01 + ways[0], -0.01 - ways[1])
    if why is None:
        braked(rest)
        return
    with pytest.raises(ConformanceError, match=why):
        braked(rest)


def test_the_tolerance_of_tracking_counts_both_ways() -> None:
    tolerant = replace(BRAKING, tracking_tolerance=0.01)
    braked((0.01 + 0.241, -0.01 - 0.279), subject=tolerant)
    for ways in ((0.239, 0.125), (0.25, 0.281)):
        with pytest.raises(ConformanceError):
            braked((0.01 + ways[0], -0.01 - ways[1]), subject=tolerant)


def test_something_has_to_move_when_it_is_stopped() -> None:
    watch = RecordingMonitor()
    for tick in range(3):
        watch(0.01 * tick, {"joint_position": (1.0, 2.0), "base_position": (0.0, 0.0, 0.0)})
    after = {"joint_position": (1.0, 2.0), "base_position": (0.0, 0.0, 0.0)}
    with pytest.raises(ConformanceError, match="nothing moved at the time of the stop"):
        stop_checks._require_braking_distance(BRAKING, watch, after)
    with pytest.raises(ConformanceError, match="the base did not move at the time of the stop"):
        stop_checks._require_braking_distance(
            replace(BRAKING, deceleration=(), base_deceleration=1.0), watch, after
        )
    stop_checks._require_braking_distance(replace(BRAKING, deceleration=()), watch, after)
    stop_checks._require_braking_distance(replace(BRAKING, period=None), watch, after)


@pytest.mark.parametrize(
    ("way", "why"),
    [
        # 1 m/s along (3, 4)/5 at 2 m/s²: at least 0.25 m, at most 0.27 m.
        (0.26, None),
        (0.24, "a stop within the limits needs 0.2500 m; it took 0.2400"),
        (0.28, "while stopping, the base moved by 0.2800 m; 0.2700 would be enough"),
    ],
)
def test_a_base_brakes_by_its_own_limit(way: float, why: str | None) -> None:
    subject, watch = replace(BRAKING, deceleration=(), base_deceleration=2.0), RecordingMonitor()
    for tick in (0, 1):
        watch(0.01 * tick, {"base_position": (0.006 * tick, 0.008 * tick, 0.0)})
    after = {"base_position": (0.006 + 0.6 * way, 0.008 + 0.8 * way, 0.0)}
    if why is None:
        stop_checks._require_braking_distance(subject, watch, after)
        return
    with pytest.raises(ConformanceError, match=why):
        stop_checks._require_braking_distance(subject, watch, after)
