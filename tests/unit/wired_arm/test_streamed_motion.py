from itertools import pairwise

import pytest

from aeros.wired_arm.arm import CYCLE, Joints
from aeros.wired_arm.streamed_motion import BrakeClock, StreamedMotion
from tests.unit.franka.stub.arms import ACCELERATION, JERK, READY, line


def motion(way: float = 0.4, duration: float = 0.8) -> StreamedMotion:
    return StreamedMotion(line(READY, way), duration, ACCELERATION, JERK)


def run(one: StreamedMotion, brake_at: int | None = None, start: Joints = READY) -> list[Joints]:
    """Stream a motion to its end; return its set points, the start among them."""
    points, is_last = [start], False
    while not is_last:
        if len(points) - 1 == brake_at:
            one.brake()
        q, is_last = one.step(CYCLE)
        points.append(q)
    return points


def rates(values: list[float]) -> list[float]:
    return [(b - a) / CYCLE for a, b in pairwise(values)]


@pytest.mark.parametrize("brake_at", [None, 1, 50, 200, 400, 600, 790])
@pytest.mark.parametrize("offset", [0.0, 0.0024])
def test_set_points_keep_the_limits_whenever_the_motion_is_braked(
    brake_at: int | None, offset: float
) -> None:
    one = motion()
    start = tuple(q + offset for q in READY)
    one.begin_at(start)
    points = run(one, brake_at, start)
    # As the robot differences them; at rest before and after.
    column = [start[0], start[0], *(q[0] for q in points[1:]), points[-1][0], points[-1][0]]
    speeds = rates(column)
    accelerations = rates(speeds)
    assert max(map(abs, accelerations)) <= ACCELERATION[0]
    assert max(map(abs, rates(accelerations))) <= JERK[0]


def test_a_motion_that_is_not_braked_ends_where_it_was_decided_to() -> None:
    points = run(motion())
    assert len(points) == 1 + 800
    assert points[-1] == pytest.approx([q + 0.4 for q in READY], abs=1e-12)


@pytest.mark.parametrize("offset", [0.001, -0.0024])
def test_where_the_arm_is_off_the_start_the_distance_fades_out(offset: float) -> None:
    one = motion()
    one.begin_at(tuple(q + offset for q in READY))
    first, _ = one.step(CYCLE)
    assert first[0] == pytest.approx(READY[0] + offset, abs=1e-6)
    assert one.position(0.8) == pytest.approx([q + 0.4 for q in READY], abs=1e-12)


@pytest.mark.parametrize("brake_at", [100, 400, 700])
def test_a_braked_arm_stays_on_the_decided_path_and_goes_on_no_farther_than_braking_needs(
    brake_at: int,
) -> None:
    one = motion()
    points = run(one, brake_at)
    shares = [(q[0] - READY[0]) / 0.4 for q in points]
    for q, share in zip(points, shares, strict=True):
        assert q == pytest.approx([start + 0.4 * share for start in READY], abs=1e-12)
    assert all(b >= a - 1e-12 for a, b in pairwise(shares))
    assert len(points) - brake_at <= one.braking_time / CYCLE + 2
    assert points[-1][0] < READY[0] + 0.4 or brake_at == 700


def test_to_brake_twice_changes_nothing() -> None:
    once, twice = motion(), motion()
    first = run(once, 300)
    for number in range(1, 400):
        if number in (301, 320):
            twice.brake()
        q, _ = twice.step(CYCLE)
        if number < len(first):
            assert q == first[number]


def test_a_slow_motion_brakes_at_once_and_a_fast_one_as_hard_as_it_may() -> None:
    slow, fast = motion(0.01, 2.0), motion(0.4, 0.8)
    assert slow.braking_time < 0.04
    # From its greatest speed, 0.94 rad/s, at 0.9 of 10 rad/s² less what the motion itself needs.
    assert 0.10 < fast.braking_time < 0.30


def test_after_lost_cycles_the_motion_is_where_the_clock_is() -> None:
    one, other = motion(), motion()
    for _ in range(7):
        q, _ = one.step(CYCLE)
    assert other.step(7 * CYCLE)[0] == pytest.approx(q, abs=1e-12)


@pytest.mark.parametrize(("rate", "ramp"), [(5.0, 0.01), (40.0, 0.004), (50.0, 0.1)])
def test_the_clock_of_braking_slows_down_evenly_to_a_standstill(rate: float, ramp: float) -> None:
    clock = BrakeClock(rate, ramp)
    steps = [clock.way(number * 1e-4) for number in range(round(clock.duration / 1e-4) + 1)]
    paces = [(b - a) / 1e-4 for a, b in pairwise(steps)]
    assert paces[0] == pytest.approx(1.0, abs=0.01)
    assert paces[-1] == pytest.approx(0.0, abs=0.01)
    assert all(b <= a + 1e-9 for a, b in pairwise(paces))
    assert max((a - b) / 1e-4 for a, b in pairwise(paces)) <= rate * 1.001
    assert clock.way(clock.duration + 1.0) == pytest.approx(clock.way(clock.duration))
