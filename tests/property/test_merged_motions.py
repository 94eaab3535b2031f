"""Decisions about two motions at once hold, sampled densely in time, whenever one is halted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from random import Random
from typing import NamedTuple

import pytest

from aeros.runtime.motion import kinematic_bounds, swept_volume
from aeros.runtime.motion import merged as merging
from aeros.runtime.motion.kinematic_bounds import ForwardKinematics
from aeros.runtime.motion.merged import ConcurrentMotion, merge_motions
from aeros.runtime.motion.swept_volume import MergedMotion
from aeros.runtime.ports import Trajectory, Vec3
from aeros.skill import act
from tests.property.test_motion_bounds import depth_of, exceeded
from tests.unit.runtime.motions import at, body, chance_of, path, share

SEEDS = range(60)
NOWHERE = (0.0, 0.0, 0.0)


class Pair(NamedTuple):
    """A motion of the arm and one of the base, the one of them under way for `since` seconds."""

    arm: Trajectory
    drive: Trajectory
    is_arm_new: bool
    since: float

    def merged(self) -> MergedMotion:
        new, old = (self.arm, self.drive) if self.is_arm_new else (self.drive, self.arm)
        found = merge_motions(new, [ConcurrentMotion(act("first"), old, self.since)])
        assert isinstance(found, MergedMotion)
        return found

    def shares(self, time: float) -> tuple[float, float]:
        """Compute the share of its path that each motion has covered after that time."""
        arm, drive = (time, time + self.since) if self.is_arm_new else (time + self.since, time)
        return tuple(  # type: ignore[return-value]
            share(min(1.0, max(0.0, passed) / one.duration))
            for one, passed in ((self.arm, arm), (self.drive, drive))
        )

    def ends(self) -> float:
        return max(self.arm.duration, self.drive.duration)


def _pair(chance: Random) -> Pair:
    robot = body(chance)
    way = (chance.uniform(-0.8, 0.8), chance.uniform(-0.8, 0.8), 0.0)
    arm = Trajectory(robot, (path(chance, 3),), (0.1, 0.2, 0.3), NOWHERE, chance.uniform(0.5, 4.0))
    still = (arm.joint_paths[0][0][0],) * 4
    drive = Trajectory(robot, ((still,),), (0.1, 0.2, 0.3), way, chance.uniform(0.5, 4.0))
    is_arm_new = chance.random() < 0.5
    first = drive if is_arm_new else arm
    return Pair(arm, drive, is_arm_new, chance.uniform(-0.1, 1.2) * first.duration)


def _base(pair: Pair, s: float) -> list[float]:
    return [b + s * w for b, w in zip(pair.drive.base, pair.drive.base_path, strict=True)]


def _places(pair: Pair, arm: float, drive: float) -> list[Vec3]:
    """Return the centres of the balls, in W."""
    posture, (bx, by, bz) = (
        ForwardKinematics(pair.arm.body, at(pair.arm.joint_paths[0], arm)),
        _base(pair, drive),
    )
    places = [posture.frames[ball.joint].to_base(ball.centre) for ball in pair.arm.body.balls]
    return [(x + bx, y + by, z + bz) for x, y, z in places]


def _depth(pair: Pair, box: swept_volume.BarrierBox, arm: float, drive: float) -> float:
    """By how much the robot meets the barrier where each has made such a share of its way."""
    dx, dy, dz = _base(pair, drive) if box.is_in_base_frame else NOWHERE
    return max(
        depth_of(box, (x - dx, y - dy, z - dz), ball.radius)
        for (x, y, z), ball in zip(_places(pair, arm, drive), pair.arm.body.balls, strict=True)
    )


def _touching(pair: Pair, chance: Random) -> swept_volume.BarrierBox:
    """A small volume that a ball touches where it is now, at the end, or some time between."""
    number = chance.randrange(len(pair.arm.body.balls))
    time = chance.choice([0.0, chance.random(), 1.0]) * pair.ends()
    way = [chance.gauss(0.0, 1.0) for _ in range(3)]
    away = 0.95 * pair.arm.body.balls[number].radius / sum(w * w for w in way) ** 0.5
    x, y, z = (p + away * w for p, w in zip(_places(pair, *pair.shares(time))[number], way, strict=True))
    return swept_volume.BarrierBox("box", (x, y, z), (x + 1e-6, y + 1e-6, z + 1e-6), False, False, None)


def _box(chance: Random) -> swept_volume.BarrierBox:
    inside, in_base = chance.random() < 0.3, chance.random() < 0.2
    half = chance.uniform(0.8, 2.0) if inside else chance.uniform(0.02, 0.3)
    x, y, z = (chance.uniform(-0.8, 0.8) for _ in range(3))
    lower, upper = (x - half, y - half, z - half), (x + half, y + half, z + half)
    return swept_volume.BarrierBox("box", lower, upper, inside, in_base, None)


def _deepest(pair: Pair, box: swept_volume.BarrierBox, chance: Random) -> float:
    """Sampled in time: both to their ends, and either halted on its way."""
    deepest = -1.0
    for halts in ((9.0, 9.0), (chance.uniform(0.0, 2.0), 9.0), (9.0, chance.uniform(0.0, 2.0))):
        for i in range(61):
            time = i / 60 * pair.ends()
            arm, drive = (pair.shares(min(time, halt))[one] for one, halt in enumerate(halts))
            deepest = max(deepest, _depth(pair, box, arm, drive))
    return deepest


def _farthest(pair: Pair, box: swept_volume.BarrierBox) -> float:
    """Return the greatest depth anywhere on the rest of both ways."""
    arm, drive = pair.shares(0.0)
    left = [[s + i / 20 * (1.0 - s) for i in range(21)] for s in (arm, drive)]
    return max(_depth(pair, box, a, d) for a in left[0] for d in left[1])


def _compare(seeds: range = SEEDS) -> dict[str, int]:
    """Count pairs that met a barrier and pairs clear of it; fail where one that met it is allowed."""
    seen = {"met": 0, "clear": 0}
    for seed in seeds:
        chance = chance_of(seed)
        pair = _pair(chance)
        box = _box(chance) if seed % 2 else _touching(pair, chance)
        found = swept_volume.find_breach(pair.merged().swept_motion(), [box], 0.0)
        if _deepest(pair, box, chance) > 0.0:
            assert found is not None, seed
            seen["met"] += 1
        elif _farthest(pair, box) < -0.02:
            assert found is None, seed
            seen["clear"] += 1
    return seen


def test_no_two_motions_that_meet_a_barrier_are_clear_and_few_others_are_not() -> None:
    assert min(_compare().values()) >= 15


def _without_the_base(moving: swept_volume.SweptMotion) -> swept_volume.SweptMotion:
    return moving._replace(base_path=NOWHERE)


def _with_less_of_the_way(moving: swept_volume.SweptMotion) -> swept_volume.SweptMotion:
    return moving._replace(base_path=tuple(0.9 * w for w in moving.base_path))  # type: ignore[arg-type]


def _in_step(moving: swept_volume.SweptMotion) -> swept_volume.SweptMotion:
    return moving._replace(is_synchronous=True)


def _without_the_last_piece(moving: swept_volume.SweptMotion) -> swept_volume.SweptMotion:
    return moving._replace(paths=tuple(path[:-1] or path for path in moving.paths))


@pytest.mark.parametrize(
    "broken", [_without_the_base, _with_less_of_the_way, _in_step, _without_the_last_piece]
)
def test_a_motion_of_which_something_is_left_out_is_noticed(
    broken: Callable[[swept_volume.SweptMotion], swept_volume.SweptMotion], monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = MergedMotion.swept_motion
    monkeypatch.setattr(MergedMotion, "swept_motion", lambda self: broken(whole(self)))
    with pytest.raises(AssertionError):
        _compare(range(400))


def test_an_overestimated_distance_of_a_motion_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    made = merging._progress
    monkeypatch.setattr(
        merging, "_progress", lambda other: made(other._replace(elapsed_s=other.elapsed_s + 0.2))
    )
    with pytest.raises(AssertionError):
        _compare(range(400))


def _tool_exceeds(pair: Pair) -> list[str]:
    """List the bounds of the tool's rates in W, sampled in time, that are exceeded."""
    merged, steps = pair.merged(), 1500
    arm, base = merged.joints.motion, merged.base.motion
    relative, _ = kinematic_bounds.tool_rates(arm.body, arm.joint_paths[0], arm.duration, 1e-9)
    bounds = kinematic_bounds.add_rates(relative, kinematic_bounds.base_rates(base.base_path, base.duration))
    places = []
    for i in range(steps + 1):
        s, drive = pair.shares(i / steps * pair.ends())
        posture = ForwardKinematics(arm.body, at(arm.joint_paths[0], s))
        tool = posture.frames[-1].to_base(arm.body.tool_offset)
        places.append([a + b for a, b in zip(tool, _base(pair, drive), strict=True)])
    rows = [list(row) for row in zip(*places, strict=True)]
    return exceeded(bounds, rows, pair.ends() / steps)


def _moving_on(pair: Pair) -> Pair:
    """From the beginning of both: differences over the end of a motion see a jump of its jerk."""
    duration = min(pair.arm.duration, pair.drive.duration)
    same = [replace(one, duration=duration) for one in (pair.arm, pair.drive)]
    return Pair(same[0], same[1], pair.is_arm_new, 0.0)


@pytest.mark.parametrize("seed", range(25))
def test_the_tool_carried_by_the_base_exceeds_none_of_its_bounds(seed: int) -> None:
    assert _tool_exceeds(_moving_on(_pair(chance_of(seed)))) == []


def test_bounds_of_the_tool_without_what_carries_it_would_be_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kinematic_bounds, "add_rates", lambda relative, carried: relative)
    noticed = {name for seed in range(25) for name in _tool_exceeds(_moving_on(_pair(chance_of(seed))))}
    assert {"speed", "acceleration"} <= noticed


def clear_everywhere(box: swept_volume.BarrierBox, p: Vec3, way: Vec3, room: float) -> bool:
    return all(
        depth_of(box, (p[0] + s * way[0], p[1] + s * way[1], p[2] + s * way[2]), room) <= 0.0
        for s in (i / 2000 for i in range(2001))
    )


def test_a_way_is_clear_iff_each_of_its_points_is_within_a_millimetre() -> None:
    answers = {True: 0, False: 0}
    for seed in range(400):
        chance = chance_of(seed)
        box = _box(chance)
        p, end = ((*(chance.uniform(-1.0, 1.0) for _ in range(3)),) for _ in range(2))
        way = (end[0] - p[0], end[1] - p[1], end[2] - p[2])
        room = chance.uniform(0.0, 0.4)
        found = swept_volume.is_clear(box, (p[0], p[1], p[2]), NOWHERE, way, room)
        answers[found] += 1
        if found:
            assert clear_everywhere(box, (p[0], p[1], p[2]), way, room - 1e-9)
        else:
            assert not clear_everywhere(box, (p[0], p[1], p[2]), way, room + 2e-3)
    assert min(answers.values()) > 50
