"""Monitor of motions that were decided: the measured robot follows them, as fast as the plant declared.

The gate decides whole motions, and the site's clearance covers the robot's distance from them. Here that
distance is computed from the measured joints and base at every tick. What the plant itself says of its
tracking does not count.

Distance. A link moves by at most Σ |e_i|·lever_i if each joint i is off by e_i, as no point of it is
farther than lever_i from the axis, and as the lever of a prismatic joint is at least 1 m/m; two links of the
arm approach each other by no more. A base that is off moves all links by its own distance. Mostly this bound
suffices. Where it does not, the places of the links' corners are compared (`greatest_displacement`).

A motion follows its path in time: q(s(t/duration)). A motion under feedback stays near one of several
paths, so its joints are compared with the boxes of their pieces, and its speeds with the bounds that the
plant stated (`ServoBounds`), over windows long enough that noise of one tick does not count.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import dist, inf, isfinite
from typing import Any, Final

from aeros.kinematic_chain import frames_of, is_prismatic, mounting_of
from aeros.runtime.gate.violation import MotionDeviation
from aeros.runtime.motion.bezier import Piece, joint_box, split_in_half
from aeros.runtime.motion.merged import moves_base
from aeros.runtime.motion.swept_volume import moves_joints
from aeros.runtime.ports import JointPath, JointVector, Reading, RobotBody, Trajectory, Vec3
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.model.motion import MotionPolicy

DECIDED_PATH: Final = "decided-path"
"""Name under which a robot is stopped that is not where its decided motions have it."""

DECLARED_RATES: Final = "declared-rates"
"""Name under which a motion is stopped that is faster than the plant declared it."""

_WINDOW_S: Final = 0.05
"""Length of a window, s."""

_JOINT_TOLERANCE: Final = 0.005
_TOOL_TOLERANCE: Final = 0.003
"""Allowance for tracking in a window: rad of each revolute joint, and m of the tool and of each prismatic
joint (measured: 0.5 mrad and 2 mm)."""

_Reference = Callable[[float, Any], Sequence[float]]
"""Position of joints or base by decision, at a time since the motion began (s), nearest to a measured one."""


class MotionTracker:
    """Check of all motions under way under one site.

    Motions that end leave the robot where they ended, until no motion is under way any more. A motion that
    is halted brakes off its path: the part that it moves is not compared until it rests, and then with where
    it rests.

    Args:
        policy: the site's motion policy; without a bound on tracking, no path is compared.

    Attributes:
        is_idle: no motion is under way.
        deviation: the last motion that was not followed, with the measured values; None if there is none.
    """

    def __init__(self, policy: MotionPolicy | None) -> None:
        self.is_idle = True
        self.deviation: MotionDeviation | None = None
        tracking = None if policy is None else policy.tracking
        self._tracking = tracking
        self._joint_variable = "" if policy is None else policy.start_variable
        self._base_variable = None if policy is None else policy.base_variable
        self._bound = inf if tracking is None else float(tracking.bound)
        self._levers = () if tracking is None else tuple([float(lever) for lever in tracking.levers])
        self._numbers: set[int] = set()
        self._rates: dict[int, FeedbackRates] = {}
        self._arm: _Follower | None = None
        self._base: _Follower | None = None
        self._body: RobotBody | None = None

    def add(self, number: int, plan: object) -> None:
        """Begin to compare with a motion.

        Args:
            number: number of the record of its decision.
            plan: the plan as it was decided; a plan that is no trajectory moves nothing.
        """
        if type(plan) is not Trajectory:
            return
        self.is_idle = False
        self._numbers.add(number)
        if plan.servo is not None and self._joint_variable:
            self._rates[number] = FeedbackRates(plan, self._joint_variable)
        if self._tracking is None:
            return
        if self._arm is None or moves_joints(plan):
            self._body = plan.body
            self._arm = _Follower(number, _joint_reference(plan))
        if self._base is None or moves_base(plan):
            self._base = _Follower(number, _base_reference(plan))

    def remove(self, number: int) -> None:
        """Note that a motion is over.

        Args:
            number: number of the record of its decision.
        """
        self._rates.pop(number, None)
        self._numbers.discard(number)
        if not self._numbers:
            self.is_idle, self._arm, self._base = True, None, None
            return
        for follower in (self._arm, self._base):
            if follower is not None and follower.number == number:
                follower.rest()

    def halt(self, number: int) -> None:
        """Note that a motion comes to rest before its end.

        Args:
            number: number of the record of its decision.
        """
        for follower in (self._arm, self._base):
            if follower is not None and follower.number == number:
                follower.halt()

    def violation(self, now: float, measured: Mapping[str, Any]) -> str | None:
        """Compare a tick with the motions under way.

        Args:
            now: plant time, s.
            measured: values (SI) or readings, by vocabulary name.

        Returns:
            `decided-path`, `declared-rates`, or `input:NAME` of a position that is not measured; None if the
            robot follows. Malformed values count as if they were not measured.
        """
        fault = None if self._tracking is None else self._distance_fault(now, measured)
        if fault is None:
            for rates in self._rates.values():
                unmet = rates.unmet_bounds(now, measured)
                if unmet:
                    self.deviation = MotionDeviation(DECLARED_RATES, unmet)
                    return DECLARED_RATES
        return fault

    def _distance_fault(self, now: float, measured: Mapping[str, Any]) -> str | None:
        name, off = self._base_variable, 0.0
        try:
            if name is not None and self._base is not None:
                off = dist(*self._base.compare(now, measured.get(name)))
            name = self._joint_variable
            if self._arm is None:
                return None
            decided, joints = self._arm.compare(now, measured.get(name))
            bound = off + sum(
                [lever * abs(a - b) for lever, a, b in zip(self._levers, decided, joints, strict=True)]
            )
            if bound <= self._bound:
                return None
            if self._body is None or not isfinite(bound):
                return f"input:{name}"
            off += greatest_displacement(self._body, decided, joints, self._levers)
        except (TypeError, ValueError):
            return f"input:{name}"
        if off <= self._bound:
            return None
        distance = UnmetBound("distance from the decided path", off, "at most", self._bound, "m")
        self.deviation = MotionDeviation(DECIDED_PATH, (distance,))
        return DECIDED_PATH


def greatest_displacement(
    body: RobotBody, decided: Sequence[float], measured: Sequence[float], levers: Sequence[float]
) -> float:
    """Compute how far links are from their decided places, in the base's frame and seen from each other.

    Seen from link j only the joints beyond j count. A link is enclosed by its hull; as all points of a
    displaced hull are convex combinations of displaced corners, none is displaced farther than a corner.

    Args:
        body: the robot; links without a hull are enclosed by their balls.
        decided: joint positions as decided, rad or m.
        measured: joint positions as measured, rad or m.
        levers: greatest distance of any link from the axis of each joint, m; of a prismatic joint at least 1.

    Returns:
        An upper bound of the distance of corners from their decided places, m. Seen from a link it is exact
        where the sum over joints is larger than what has been found before.
    """
    mountings = [mounting_of(row) for row in body.dh_rows]
    corners: list[tuple[int, Vec3]] = [(hull.joint, corner) for hull in body.hulls for corner in hull.corners]
    corners += [(ball.joint, ball.centre) for ball in body.balls if not body.hulls]
    corners.append((len(mountings), body.tool_offset))
    frames = frames_of(mountings, decided)
    places = [(joint, corner, frames[joint].to_base(corner)) for joint, corner in corners]
    greatest = 0.0
    for inner in range(len(mountings)):
        beyond = zip(levers[inner:], decided[inner:], measured[inner:], strict=True)
        if sum([lever * abs(a - b) for lever, a, b in beyond]) <= greatest:
            break  # the sums only fall
        moved = frames_of(mountings, [*decided[:inner], *measured[inner:]])
        for joint, corner, place in places:
            if joint > inner:
                greatest = max(greatest, dist(moved[joint].to_base(corner), place))
    return greatest


class _Follower:
    """Arm or base, with the motion that it follows. Mutable, because it goes on to exist when that has ended.

    number: number of the motion's record.
    """

    __slots__ = ("_began", "_is_over", "_reference", "number")

    def __init__(self, number: int, reference: _Reference) -> None:
        self.number = number
        self._reference: _Reference | None = reference
        self._began: float | None = None
        self._is_over = False

    def halt(self) -> None:
        """Note that the motion is halted: nothing is compared until it is over."""
        self._reference = None

    def rest(self) -> None:
        """Note that the motion is over: it stays where it ended, or where a halt left it."""
        self._is_over = True

    def compare(self, now: float, measured: Any) -> tuple[Sequence[float], Sequence[float]]:
        """Return the decided and the measured position; raise TypeError or ValueError if it is malformed."""
        time, value = (measured.time, measured.value) if type(measured) is Reading else (now, measured)
        if self._began is None:
            self._began = now
        if self._reference is None:
            rest = tuple(value)
            if self._is_over:
                self._reference = lambda _, __: rest
            return rest, value
        return self._reference(max(0.0, time - self._began), value), value


def _joint_reference(plan: Trajectory) -> _Reference:
    """Return the function from a time to the joints; under feedback, from joints to the nearest decided."""
    if plan.servo is not None:
        return _nearest_in_boxes(plan.joint_paths, plan.servo.joint_tolerance)
    path, duration, count = plan.joint_paths[0], plan.duration, len(plan.joint_paths[0])
    powers: dict[int, list[tuple[float, float, float, float]]] = {}

    def reference(elapsed: float, _: object) -> list[float]:
        u = min(elapsed / duration, 1.0)
        place = count * u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
        number = min(int(place), count - 1)
        rows = powers.get(number)
        if rows is None:
            rows = powers[number] = _powers(path[number])
        x = place - number
        return [((d * x + c) * x + b) * x + a for a, b, c, d in rows]

    return reference


def _powers(piece: Piece) -> list[tuple[float, float, float, float]]:
    """Return the coefficients of a piece's powers of its parameter, for each joint."""
    return [
        (a, 3.0 * (b - a), 3.0 * (a - 2.0 * b + c), d - a + 3.0 * (b - c))
        for a, b, c, d in zip(*piece, strict=True)
    ]


def _nearest_in_boxes(paths: Iterable[JointPath], tolerance: JointVector) -> _Reference:
    """Return the function from joints to the nearest of boxes around all paths, enlarged by the tolerance."""
    halves = [half for path in paths for piece in path for half in split_in_half(piece)]
    quarters = [quarter for half in halves for quarter in split_in_half(half)]
    boxes = [
        [
            (middle - width - slack, middle + width + slack)
            for middle, width, slack in zip(*joint_box([quarter]), tolerance, strict=True)
        ]
        for quarter in quarters
    ]
    last = boxes[0]

    def nearest(box: list[tuple[float, float]], joints: JointVector) -> list[float]:
        return [min(max(q, low), high) for (low, high), q in zip(box, joints, strict=True)]

    def reference(_: float, joints: JointVector) -> list[float]:
        nonlocal last
        place = nearest(last, joints)
        if place != [*joints]:
            last = min(boxes, key=lambda box: dist(nearest(box, joints), joints))
            place = nearest(last, joints)
        return place

    return reference


def _base_reference(plan: Trajectory) -> _Reference:
    """Return the function from a time to the base's place on its straight path, m."""
    (x, y, z), (wx, wy, wz), duration = plan.base, plan.base_path, plan.duration

    def reference(elapsed: float, _: object) -> Vec3:
        u = min(elapsed / duration, 1.0)
        s = u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
        return (x + s * wx, y + s * wy, z + s * wz)

    return reference


class FeedbackRates:
    """Check of one motion under feedback.

    Args:
        plan: the motion as it was decided, with `servo`.
        variable: state variable that measures the joints.
    """

    def __init__(self, plan: Trajectory, variable: str) -> None:
        self._servo = plan.servo
        self._variable = variable
        self._mountings = [mounting_of(row) for row in plan.body.dh_rows]
        self._units = [
            (_TOOL_TOLERANCE, "m") if is_prismatic(row) else (_JOINT_TOLERANCE, "rad")
            for row in plan.body.dh_rows
        ]
        self._tool_offset = plan.body.tool_offset
        self._window: deque[tuple[float, tuple[float, ...], tuple[float, ...]]] = deque()

    def unmet_bounds(self, now: float, measured: Mapping[str, Any]) -> tuple[UnmetBound, ...]:
        """Add a tick, and compare the way in the last window with the declared speeds.

        Args:
            now: plant time, s.
            measured: values (SI) or readings, by vocabulary name.

        Returns:
            The ways of joints (rad or m) and tool (m) that are longer than the declared speed allows. None
            for ticks without well-formed joints, which other checks refuse.
        """
        value, servo = measured.get(self._variable), self._servo
        time = value.time if type(value) is Reading else now
        joints = value.value if type(value) is Reading else value
        if servo is None or not isinstance(joints, tuple | list) or len(joints) != len(self._mountings):
            return ()
        if not all(type(one) is float and isfinite(one) for one in joints):
            return ()
        if self._window and time <= self._window[-1][0]:
            return ()
        tool = frames_of(self._mountings, joints)[-1].to_base(self._tool_offset)
        while self._window and self._window[0][0] < time - _WINDOW_S:
            self._window.popleft()
        self._window.append((time, tuple(joints), tool))
        start, were, tool_was = self._window[0]
        lasted = time - start
        ways = [
            ("way of the tool", dist(tool, tool_was), servo.tool_speed * lasted + _TOOL_TOLERANCE, "m"),
            *(
                (f"way of joint {number}", abs(one - was), speed * lasted + tolerance, unit)
                for number, (one, was, speed, (tolerance, unit)) in enumerate(
                    zip(joints, were, servo.speed, self._units, strict=True), 1
                )
            ),
        ]
        return tuple(
            UnmetBound(f"{name} in {lasted:.3g} s", way, "at most", bound, unit)
            for name, way, bound, unit in ways
            if way > bound
        )
