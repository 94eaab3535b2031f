"""Checks of motions under way: they follow the plan, several run at once, and none goes on after `until`."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import dist, isfinite
from typing import Any

from aeros.runtime.ports import JointPath, MotionCompletion, Trajectory
from aeros.sim.conformance.plant_under_test import (
    MOTION_TIMEOUT_S,
    PlantUnderTest,
    RecordingMonitor,
    begin_motion,
    require,
    require_unchanged,
    values_of,
    wait_for_end,
)


def the_executed_motion_is_the_decided_one(subject: PlantUnderTest) -> None:
    """Check that joints and base are on the planned profile at each tick, and that its numbers are floats.

    If the plan moves nothing, no joint moves. A plan with other numbers is denied by the gate.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    plan, seen, start = _run_motion(subject)
    if not isinstance(plan, Trajectory):
        joints = [values[subject.joint_variable] for _, values in seen]
        away = max(dist(position, joints[0]) for position in joints)
        require(away <= subject.noise, f"it must move no joint, but moved one by {away} rad or m")
        return
    require(plan.servo is None, "`motion_action` must be an action with a planned path")
    _require_floats(plan)
    for time, values in seen:
        since = time - start
        profile, base = expected_position(plan, min(1.0, since / plan.duration))
        away = max(abs(a - b) for a, b in zip(values[subject.joint_variable], profile, strict=True))
        require(
            away <= subject.tracking_tolerance,
            f"{since:.3f} s on, a joint is {away:.4f} rad or m off its path",
        )
        off = dist(values.get(subject.base_variable, base), base)
        require(off <= subject.tracking_tolerance, f"{since:.3f} s on, the base is {off:.4f} m off its way")


def _require_floats(plan: Trajectory) -> None:
    """Raise `ConformanceError` if chain, tool, base or duration of a plan have other numbers than floats."""
    body = plan.body
    wrong = [len(row) for row in body.dh_rows if len(row) not in (3, 4, 5)]
    require(not wrong, f"a row of `dh_rows` of the plan has {wrong[:1]} numbers; it needs three to five")
    rows: list[tuple[str, Sequence[float]]] = [("dh_rows", row) for row in body.dh_rows]
    rows += [("balls", (*ball.centre, ball.radius)) for ball in body.balls]
    rows += [("joint_paths", q) for path in plan.joint_paths for piece in path for q in piece]
    rows += [("tool_offset", body.tool_offset), ("base", plan.base), ("base_path", plan.base_path)]
    for name, row in (*rows, ("duration", (plan.duration,))):
        for number in row:
            is_float = type(number) is float and isfinite(number)
            require(
                is_float, f"`{name}` of the plan has {number!r}; it needs finite numbers of the type `float`"
            )


def no_speed_is_higher_than_decided(subject: PlantUnderTest) -> None:
    """Check that no joint and no base exceeds the peak speed of its planned profile in any tick.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    plan, seen, _ = _run_motion(subject)
    if not isinstance(plan, Trajectory) or subject.period is None:
        return
    ticks = max(1, round(plan.duration / subject.period))
    profile = [expected_position(plan, tick / ticks) for tick in range(ticks + 1)]
    for what, name, place in (("a joint", subject.joint_variable, 0), ("the base", subject.base_variable, 1)):
        decided = _speeds([sample[place] for sample in profile], subject.period)
        measured = _speeds([values[name] for _, values in seen if name in values], subject.period)
        for peak, limit in zip(measured, decided, strict=False):
            require(
                peak <= limit + subject.max_overshoot,
                f"{what} reaches {peak:.4f}; {limit:.4f} was decided",
            )


def _run_motion(subject: PlantUnderTest) -> tuple[object, list[tuple[float, Any]], float]:
    """Run `motion_action`; return its plan, what the monitor saw, and when it began."""
    with subject.plant() as plant:
        plan = plant.plan(subject.motion_action)
        motion = plant.begin(subject.motion_action, plan)
        require(
            not isinstance(motion, MotionCompletion),
            f"it cannot begin the motion that it has just planned: {motion}",
        )
        assert not isinstance(motion, MotionCompletion)  # noqa: S101  for the type checker
        start, watch = plant.now(), RecordingMonitor()
        over = wait_for_end(plant, motion, watch)
        require(over.completed, f"`motion_action` was not completed: {over.reason}")
        measured = values_of(plant.observe())
    return plan, [*watch.seen, (watch.seen[-1][0], measured)], start


def expected_position(plan: Trajectory, u: float) -> tuple[Sequence[float], Sequence[float]]:
    """Compute where a plan has joints and base: q(s(u)), with s(u) = 10u³ − 15u⁴ + 6u⁵.

    Args:
        plan: the plan; of its paths the first counts.
        u: share of its duration, in [0, 1].

    Returns:
        Joint positions, rad, and base position in W, m.
    """
    s = u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
    return path_point(plan.joint_paths[0], s), [
        a + s * way for a, way in zip(plan.base, plan.base_path, strict=True)
    ]


def path_point(path: JointPath, s: float) -> list[float]:
    """Compute a point of a joint path.

    Args:
        path: Bézier pieces of equal length in s.
        s: share of the path, in [0, 1].

    Returns:
        Joint positions, rad.
    """
    number = min(int(s * len(path)), len(path) - 1)
    u = s * len(path) - number
    v = 1.0 - u
    weights = (v**3, 3.0 * v * v * u, 3.0 * v * u * u, u**3)
    return [
        sum(w * corner for w, corner in zip(weights, joint, strict=True))
        for joint in zip(*path[number], strict=True)
    ]


def _speeds(places: Sequence[Sequence[float]], period: float) -> list[float]:
    """Return the greatest speed of each coordinate between consecutive samples."""
    steps = [[abs(b - a) / period for a, b in zip(p, q, strict=True)] for p, q in pairwise(places)]
    return [max(of) for of in zip(*steps, strict=True)]


def advance_stops_at_until(subject: PlantUnderTest) -> None:
    """Check that `advance` returns nothing at `until`, not long before it, and continues at the next call.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    with subject.plant() as plant:
        motion, watch = begin_motion(plant, subject.motion_action), RecordingMonitor()
        for _ in range(3):
            until = plant.now() + 0.1
            over = plant.advance(watch, until)
            require(over == {}, f"`motion_action` must take at least 0.5 s, but ended earlier: {over}")
            require(plant.now() <= until + 1e-9, f"it went on until {plant.now()} s, beyond {until} s")
            early = until - plant.now()
            require(early <= subject.tick + 1e-9, f"it came back {early} s before `until`")
        now = plant.now()
        require(plant.advance(watch, now - 1.0) == {}, "a motion ends while the clock stands still")
        require(plant.now() - now <= subject.tick + 1e-9, "the clock advanced although `until` had passed")
        require(
            wait_for_end(plant, motion, watch).completed, "the motion observed in between was not completed"
        )


def each_motion_has_its_own_number_and_ends_once(subject: PlantUnderTest) -> None:
    """Check that motions under way have different numbers and each ends once, incomplete ones with a reason.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    ended = []
    with subject.plant() as plant:
        for _ in range(2):
            motions = [
                begin_motion(plant, subject.motion_action),
                begin_motion(plant, subject.parallel_action),
            ]
            for motion in motions:
                require(motion not in ended and motions.count(motion) == 1, f"two motions are {motion}")
            while motions:
                over = plant.advance(RecordingMonitor(), plant.now() + MOTION_TIMEOUT_S)
                require(bool(over), f"motions {motions} have not ended after {MOTION_TIMEOUT_S:g} s")
                for motion, how in over.items():
                    require(motion in motions, f"motion {motion} ends, which was not under way")
                    require(how.completed is (how.reason is None), f"it ended ambiguously, with {how}")
                    motions.remove(motion)
                    ended.append(motion)
            before = values_of(plant.observe())
            require_unchanged(subject, before, values_of(plant.observe()), "after everything has ended")


def skill_notifications_move_nothing(subject: PlantUnderTest) -> None:
    """Check that the beginning and the halt of a skill move nothing by themselves.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    with subject.plant() as plant:
        before = values_of(plant.observe())
        plant.skill_began(subject.skill)
        plant.skill_ended(subject.skill, finished=False)
        require_unchanged(subject, before, values_of(plant.observe()), "after a skill that asked for nothing")
