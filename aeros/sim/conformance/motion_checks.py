"""Checks of motions under way: they are what was decided, several go on at once, and none passes `until`."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import dist
from typing import Any

from aeros.runtime.ports import Completion, Path, Trajectory
from aeros.sim.conformance.plant_under_test import (
    PATIENCE,
    Subject,
    Watch,
    begun,
    ended,
    require,
    unchanged,
    values_of,
)


def the_motion_made_is_the_one_decided(subject: Subject) -> None:
    """At each tick the joints are on the profile, and the base on its way; what moves nothing, moves none."""
    plan, seen, start = _executed(subject)
    if not isinstance(plan, Trajectory):
        joints = [values[subject.joints] for _, values in seen]
        away = max(dist(one, joints[0]) for one in joints)
        require(away <= subject.noise, f"it was said to move no joint, and moved one by {away} rad")
        return
    require(plan.servo is None, "`moving` is to be an action whose path is decided beforehand")
    for time, values in seen:
        since = time - start
        profile, base = decided_at(plan, min(1.0, since / plan.duration))
        away = max(abs(a - b) for a, b in zip(values[subject.joints], profile, strict=True))
        require(away <= subject.follows_within, f"{since:.3f} s on, a joint is {away:.4f} rad off its path")
        off = dist(values.get(subject.base, base), base)
        require(off <= subject.follows_within, f"{since:.3f} s on, the base is {off:.4f} m off its way")


def no_speed_is_higher_than_decided(subject: Subject) -> None:
    """No joint, nor the base, is faster in any tick than the profile's own peak."""
    plan, seen, _ = _executed(subject)
    if not isinstance(plan, Trajectory) or subject.period is None:
        return
    ticks = max(1, round(plan.duration / subject.period))
    profile = [decided_at(plan, tick / ticks) for tick in range(ticks + 1)]
    for what, name, place in (("a joint", subject.joints, 0), ("the base", subject.base, 1)):
        decided = _speeds([one[place] for one in profile], subject.period)
        measured = _speeds([values[name] for _, values in seen if name in values], subject.period)
        for peak, limit in zip(measured, decided, strict=False):
            require(
                peak <= limit + subject.overshoots,
                f"{what} is as fast as {peak:.4f}, decided were {limit:.4f}",
            )


def _executed(subject: Subject) -> tuple[object, list[tuple[float, Any]], float]:
    """The plan of `moving`, what was seen while it was made, and when it began."""
    with subject.plant() as plant:
        plan = plant.plan(subject.moving)
        motion = plant.begin(subject.moving, plan)
        require(not isinstance(motion, Completion), f"it cannot begin what it has just planned: {motion}")
        assert not isinstance(motion, Completion)  # noqa: S101  for the type checker
        start, watch = plant.now(), Watch()
        over = ended(plant, motion, watch)
        require(over.completed, f"`moving` was not completed: {over.reason}")
        measured = values_of(plant.observe())
    return plan, [*watch.seen, (watch.seen[-1][0], measured)], start


def decided_at(plan: Trajectory, u: float) -> tuple[Sequence[float], Sequence[float]]:
    """Joints and base at the share `u` of the duration: q(s(u)), with s(u) = 10u³ − 15u⁴ + 6u⁵."""
    s = u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
    return point(plan.paths[0], s), [a + s * way for a, way in zip(plan.base, plan.way, strict=True)]


def point(path: Path, s: float) -> list[float]:
    """The point of the path at the share `s` of it."""
    number = min(int(s * len(path)), len(path) - 1)
    u = s * len(path) - number
    v = 1.0 - u
    weights = (v**3, 3.0 * v * v * u, 3.0 * v * u * u, u**3)
    return [
        sum(w * corner for w, corner in zip(weights, joint, strict=True))
        for joint in zip(*path[number], strict=True)
    ]


def _speeds(places: Sequence[Sequence[float]], period: float) -> list[float]:
    """The greatest speed of each coordinate from one place to the next."""
    steps = [[abs(b - a) / period for a, b in zip(p, q, strict=True)] for p, q in pairwise(places)]
    return [max(of) for of in zip(*steps, strict=True)]


def nothing_passes_until(subject: Subject) -> None:
    """`advance` comes back with nothing by `until`, not long before, and goes on when called again."""
    with subject.plant() as plant:
        motion, watch = begun(plant, subject.moving), Watch()
        for _ in range(3):
            until = plant.now() + 0.1
            over = plant.advance(watch, until)
            require(over == {}, f"`moving` was to take half a second, and ended before: {over}")
            require(plant.now() <= until + 1e-9, f"it went on until {plant.now()} s, beyond {until} s")
            early = until - plant.now()
            require(early <= subject.tick + 1e-9, f"it came back {early} s before `until`")
        now = plant.now()
        require(plant.advance(watch, now - 1.0) == {}, "something ends while time does not go on")
        require(plant.now() - now <= subject.tick + 1e-9, "time went on beyond an `until` that had passed")
        require(ended(plant, motion, watch).completed, "what was looked at in between is not completed")


def each_motion_has_its_own_number_and_ends_once(subject: Subject) -> None:
    """Motions under way together differ; each is told of once, completed without and else with a reason."""
    told = []
    with subject.plant() as plant:
        for _ in range(2):
            motions = [begun(plant, subject.moving), begun(plant, subject.beside)]
            for motion in motions:
                require(motion not in told and motions.count(motion) == 1, f"two motions are {motion}")
            while motions:
                over = plant.advance(Watch(), plant.now() + PATIENCE)
                require(bool(over), f"motions {motions} have not ended after {PATIENCE:g} s")
                for motion, how in over.items():
                    require(motion in motions, f"motion {motion} ends, which was not under way")
                    require(how.completed is (how.reason is None), f"it ended with {how}: which is it?")
                    motions.remove(motion)
                    told.append(motion)
            before = values_of(plant.observe())
            unchanged(subject, before, values_of(plant.observe()), "after everything has ended")


def skills_that_come_and_go_move_nothing(subject: Subject) -> None:
    """That a skill began, and that it was halted, is for the plant to note."""
    with subject.plant() as plant:
        before = values_of(plant.observe())
        plant.skill_began(subject.skill)
        plant.skill_ended(subject.skill, finished=False)
        unchanged(subject, before, values_of(plant.observe()), "after a skill that asked for nothing")
