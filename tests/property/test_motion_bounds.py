"""The bounds that motions are decided by hold of every densely sampled motion, and hardly more than hold."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import dist, hypot

import pytest

from aeros.runtime.motion import bezier, kinematic_bounds
from aeros.runtime.motion import swept_volume as sweep
from aeros.runtime.motion.kinematic_bounds import ForwardKinematics
from aeros.runtime.motion.swept_volume import MergedMotion, RemainingMotion
from aeros.runtime.ports import Trajectory
from tests.unit.runtime.motions import (
    at,
    body,
    chance_of,
    differences,
    path,
    places,
    share,
    tool,
    with_slides,
)

SEEDS = range(25)
SAMPLES = 1500
NOWHERE = (0.0, 0.0, 0.0)


def _motion(seed: int, way: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Trajectory:
    chance = chance_of(seed)
    pieces = chance.choice([1, 3, 8])
    robot = body(chance)
    if seed % 5 in (1, 2):
        robot = with_slides(robot, chance_of(seed))
    return Trajectory(robot, (path(chance, pieces),), (0.1, 0.2, 0.3), way, chance.uniform(0.3, 4.0))


def alone(motion: Trajectory) -> sweep.SweptMotion:
    return MergedMotion(RemainingMotion(motion), RemainingMotion(motion)).swept_motion()


def _sampled(motion: Trajectory) -> tuple[list[list[float]], list[list[float]], float]:
    """Of each joint and of each of the tool's coordinates, its positions in time; and the time step."""
    steps = [share(i / SAMPLES) for i in range(SAMPLES + 1)]
    joints = [list(column) for column in zip(*(at(motion.joint_paths[0], s) for s in steps), strict=True)]
    places = [list(column) for column in zip(*(tool(motion, s) for s in steps), strict=True)]
    return joints, places, motion.duration / SAMPLES


def exceeded(found: kinematic_bounds.MotionRates, rows: list[list[float]], step: float) -> list[str]:
    """The bounds that the rates of a point with these coordinates exceed, by more than differencing errs."""
    named = []
    for name, bound in zip(("speed", "acceleration", "jerk"), found, strict=True):
        rows = [differences(row, step) for row in rows]
        most = max(sum(x * x for x in point) ** 0.5 for point in zip(*rows, strict=True))
        if most > bound * (1.0 + 1e-6):
            named.append(name)
    return named


def _joints_exceeded(motion: Trajectory) -> list[str]:
    joints, _, step = _sampled(motion)
    bounds = kinematic_bounds.joint_rates(motion.joint_paths[0], motion.duration)
    return [name for found, row in zip(bounds, joints, strict=True) for name in exceeded(found, [row], step)]


@pytest.mark.parametrize("seed", SEEDS)
def test_no_joint_exceeds_its_bounds(seed: int) -> None:
    assert _joints_exceeded(_motion(seed)) == []


@pytest.mark.parametrize("seed", SEEDS)
def test_the_tool_exceeds_none_of_its_bounds(seed: int) -> None:
    motion = _motion(seed, (0.3, -0.2, 0.0) if seed % 2 else (0.0, 0.0, 0.0))
    _, places, step = _sampled(motion)
    relative, _ = kinematic_bounds.tool_rates(motion.body, motion.joint_paths[0], motion.duration, 1e-9)
    moving = kinematic_bounds.add_rates(
        relative, kinematic_bounds.base_rates(motion.base_path, motion.duration)
    )
    assert exceeded(moving, places, step) == []


@pytest.mark.parametrize("seed", SEEDS)
def test_the_tool_turns_no_faster_than_its_bound(seed: int) -> None:
    motion = _motion(seed)
    _, turning = kinematic_bounds.tool_rates(motion.body, motion.joint_paths[0], motion.duration, 1e-9)
    steps = [share(i / SAMPLES) for i in range(SAMPLES + 1)]
    axes = []
    for s in steps:
        frame = ForwardKinematics(motion.body, at(motion.joint_paths[0], s)).frames[-1]
        axes.append((frame.x, frame.y, frame.z))
    # |ω|² is half the sum of the squared rates of the three axes.
    rates = [
        (sum(dist(a, b) ** 2 for a, b in zip(old, new, strict=True)) / 2.0) ** 0.5 * SAMPLES / motion.duration
        for old, new in pairwise(axes)
    ]
    assert max(rates) <= turning.speed


def test_the_bound_of_the_tools_speed_is_hardly_above_it() -> None:
    for seed in SEEDS:
        chance = chance_of(seed)
        # One joint alone: its path's slope is greatest somewhere, and timing in the middle.
        still = body(chance)
        quarter = ((0.0,) * 4, (0.1, 0.0, 0.0, 0.0), (0.2, 0.0, 0.0, 0.0), (0.3, 0.0, 0.0, 0.0))
        motion = Trajectory(still, ((quarter,),), NOWHERE, NOWHERE, 1.0)
        _, places, step = _sampled(motion)
        rows = [differences(row, step) for row in places]
        most = max(sum(x * x for x in point) ** 0.5 for point in zip(*rows, strict=True))
        found, _ = kinematic_bounds.tool_rates(still, (quarter,), 1.0, most * 1.001)
        assert most <= found.speed <= most * 1.002


@pytest.mark.parametrize("number", range(3))
def test_a_peak_factor_that_is_too_small_is_noticed(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    factors = list(kinematic_bounds.TIMING_PEAKS)
    factors[number] *= 0.99
    monkeypatch.setattr(kinematic_bounds, "TIMING_PEAKS", tuple(factors))
    line = tuple((x,) * 4 for x in (0.0, 1 / 3, 2 / 3, 1.0))
    chance = chance_of(0)
    motion = Trajectory(body(chance), (((line[0], line[1], line[2], line[3]),),), NOWHERE, NOWHERE, 2.0)
    assert ("speed", "acceleration", "jerk")[number] in _joints_exceeded(motion)


@pytest.mark.parametrize("seed", SEEDS)
def test_enclosures_hold_every_place_the_balls_take(seed: int) -> None:
    motion = _motion(seed)
    chance = chance_of(seed)
    slack = tuple(chance.choice([0.0, 0.05]) for _ in range(4))
    balls = list(motion.body.balls)
    pieces = list(motion.joint_paths[0])
    found = sweep.ball_enclosures(motion.body, pieces, slack, balls)
    for i in range(400):
        q = [
            x + chance.uniform(-w, w) for x, w in zip(at(motion.joint_paths[0], i / 399), slack, strict=True)
        ]
        posture = ForwardKinematics(motion.body, q)
        for ball, one in zip(balls, found, strict=True):
            assert _is_held(posture.frames[ball.joint].to_base(ball.centre), ball.radius, one)


def depth_of(box: sweep.BarrierBox, centre: tuple[float, float, float], radius: float) -> float:
    """By how much the ball is not clear of the barrier; negative where it is."""
    if box.keep_inside:
        pairs = zip(centre, box.lower, box.upper, strict=True)
        return radius - min(min(x - low, high - x) for x, low, high in pairs)
    pairs = zip(centre, box.lower, box.upper, strict=True)
    return radius - hypot(*(max(low - x, x - high, 0.0) for x, low, high in pairs))


@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize("way", [(0.0, 0.0, 0.0), (0.5, -0.3, 0.0)])
def test_no_motion_that_meets_a_barrier_is_clear_and_few_others_are_not(
    way: tuple[float, float, float], inside: bool
) -> None:
    seen = {"met": 0, "clear": 0}
    for seed in range(150):
        chance = chance_of(seed)
        motion = _motion(seed, way)
        half = chance.uniform(0.6, 2.0) if inside else chance.uniform(0.02, 0.3)
        middle = [chance.uniform(-0.6, 0.6) for _ in range(3)]
        lower, upper = ([x + side * half for x in middle] for side in (-1, 1))
        box = sweep.BarrierBox(
            "box", (lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2]), inside, False, None
        )
        found = sweep.find_breach(alone(motion), [box], 0.0)
        depth = max(
            depth_of(box, centre, ball.radius)
            for i in range(200)
            for ball, centre in zip(motion.body.balls, places(motion, i / 199), strict=True)
        )
        if depth > 0.0:
            assert found is not None, seed
            seen["met"] += 1
        elif depth < -0.02:
            # A hold of 20 mm is more than the last enclosures are wide.
            assert found is None, seed
            seen["clear"] += 1
    assert min(seen.values()) >= 15


Sweep = Callable[..., tuple[tuple[float, float, float], float]]


def _without_edges(sweep: Sweep) -> Sweep:
    return lambda *given: (NOWHERE, sweep(*given)[1])


def _without_what_is_near(sweep: Sweep) -> Sweep:
    return lambda *given: (sweep(*given)[0], 0.0)


def _without_room(sweep: Sweep) -> Sweep:
    return lambda self, joint, p, along: sweep(self, joint, p, [(d, 0.0, w, s) for d, _, w, s in along])


def _without_bends(sweep: Sweep) -> Sweep:
    return lambda self, joint, p, along: sweep(self, joint, p, [(d, r, w, 0.0) for d, r, w, _ in along])


@pytest.mark.parametrize(
    "broken", [_without_edges, _without_what_is_near, _without_room, _without_bends], ids=lambda f: f.__name__
)
def test_an_enclosure_that_leaves_something_out_would_be_noticed(
    broken: Callable[[Sweep], Sweep], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        ForwardKinematics, "chord_deviation_bound", broken(ForwardKinematics.chord_deviation_bound)
    )
    with pytest.raises(AssertionError):
        _assert_all_enclosed()


def _assert_all_enclosed() -> None:
    for seed in SEEDS:
        test_enclosures_hold_every_place_the_balls_take(seed)
        test_enclosures_contain_straight_joint_paths(seed)


@pytest.mark.parametrize("seed", SEEDS)
def test_enclosures_contain_straight_joint_paths(seed: int) -> None:
    chance = chance_of(seed)
    robot = with_slides(body(chance), chance_of(seed)) if seed % 2 else body(chance)
    start, end = (tuple(chance.uniform(-0.4, 0.4) for _ in range(4)) for _ in range(2))
    corners = [tuple(a + k / 3 * (b - a) for a, b in zip(start, end, strict=True)) for k in range(4)]
    line = (corners[0], corners[1], corners[2], corners[3])
    found = sweep.ball_enclosures(robot, [line], (0.0,) * 4, list(robot.balls))
    for i in range(101):
        posture = ForwardKinematics(robot, at((line,), i / 100))
        for ball, one in zip(robot.balls, found, strict=True):
            assert _is_held(posture.frames[ball.joint].to_base(ball.centre), ball.radius, one)


def _is_held(place: tuple[float, float, float], radius: float, within: sweep.Enclosure) -> bool:
    rows = zip(place, within.centre, within.edges, strict=True)
    return hypot(*(max(abs(p - c) - e, 0.0) for p, c, e in rows)) + radius <= within.radius + 1e-12


def test_joints_that_go_straight_are_on_their_chord() -> None:
    line = tuple(
        tuple((3.0 * n + s) * (0.1, -0.2, 0.0, 0.3)[j] for j in range(4)) for n in (0, 1) for s in range(4)
    )
    middle, half, width = bezier.path_chord([line[:4], line[4:]])  # type: ignore[list-item]
    assert middle == pytest.approx((0.3, -0.6, 0.0, 0.9))
    assert half == pytest.approx((0.3, -0.6, 0.0, 0.9))
    assert max(width) < 1e-12
