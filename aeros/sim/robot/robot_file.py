"""Read a robot file: check it, report every problem with its place, and convert units."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import cache
from importlib.metadata import entry_points
from math import isfinite
from pathlib import Path
from typing import Any, Final

import numpy as np

from aeros.kinematic_chain import PRISMATIC, Row
from aeros.runtime.ports import Hull, RobotBody
from aeros.sim.robot.body import Capsule, enclosing_balls
from aeros.sim.robot.columns import (
    ABOVE_0,
    EFFORT,
    POSITION,
    STIFFNESS,
    Dimensions,
    per_time,
    read_column,
    report_count,
)
from aeros.sim.robot.gripper import finger_outside, point_of, read_gripper, read_mass
from aeros.sim.robot.kinematics import forward_kinematics
from aeros.sim.robot.limits import JointLimits, ToolPointLimits, Vector
from aeros.sim.robot.model import (
    Dynamics,
    HandMount,
    Postures,
    RobotModel,
    ServoSettings,
    StockUrdf,
    links_of,
)
from aeros.sim.robot.standing_arms.standing_arm import find_overlap, joints_outside, with_postures
from aeros.sim.robot.standing_arms.standing_arm_file import StandingArmReader
from aeros.sim.shipped_files import find_file, shipped_files
from aeros.spec.declared.decode import decode
from aeros.spec.declared.robots import robot as declared
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics, SpanLabel
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.expr.units import ANGLE, FORCE, LENGTH, TIME, Dimension
from aeros.spec.model.motion import MotionPolicy
from aeros.spec.model.site import Site
from aeros.spec.text.fields import NumberField, TextField
from aeros.spec.text.files import read_source
from aeros.spec.text.yaml_reader import read_yaml

GROUP: Final = "aeros.robots"
"""Group of entry points under which an installed distribution provides robots, each a path of a file."""

REFERENCE_ROBOT: Final = "panda"
"""Name of the robot of the reference site, and of sites that name none."""

_SPEED: Final = LENGTH * TIME**-1
_TURNING: Final = ANGLE * TIME**-1

_FARTHEST_SLIDE: Final = 100.0
"""Greatest position of a prismatic joint, m: one beyond it is in a wrong unit, or of a joint that turns."""

_ROUNDING: Final = 1e-9
"""Share of a limit by which a site may exceed it, as both are rounded."""

_HELD: Final = "held"
"""Name by which barriers call a held object."""

_FRANKA_GAP: Final = 0.08 * (1.0 + _ROUNDING)
"""Widest gap of the Franka Hand, m (its data sheet), as simulators have it."""

_TILT: Final = 1e-3
"""Greatest tilt and yaw of the tool in the ready posture, rad."""


def known_robots() -> dict[str, Path]:
    """List the robots that come with AEROS and those that installed distributions provide.

    Returns:
        Their files by name; a robot of AEROS goes before another one of the same name.

    Raises:
        UserError: an entry point of a distribution names no path.
    """
    provided = {}
    for entry in entry_points(group=GROUP):
        try:
            provided[entry.name] = Path(entry.load())
        except Exception as failure:
            headline = f"the robot `{entry.name}` of an installed distribution cannot be found: {failure}"
            help_ = (f"let its entry point of `{GROUP}` name the path of a robot file",)
            raise UserError([Diagnostic("AE002", headline, help=help_)]) from failure
    return {**provided, **shipped_files("robots")}


def reference_robot() -> RobotModel:
    """Read the robot of the reference site.

    Returns:
        The robot.
    """
    return read_robot(REFERENCE_ROBOT)


def read_robot(name_or_path: str) -> RobotModel:
    """Read a robot file; the same file is read once.

    Args:
        name_or_path: a path, or the name of a robot that comes with AEROS or an installed distribution.

    Returns:
        The robot.

    Raises:
        UserError: there is no such file, or it has problems.
    """
    shipped = shipped_files("robots")
    if name_or_path in shipped:
        return _read(shipped[name_or_path].resolve())
    return _read(Path(find_file(name_or_path, known_robots(), "robot file")).resolve())


def robot_of(site: Site) -> RobotModel:
    """Read the robot that a site names.

    Args:
        site: the site; if it names a robot, its limits of joints may be narrower than the robot's, not wider.

    Returns:
        The robot.

    Raises:
        UserError: there is no such robot, its file has problems, or the site allows more than its limits or
            has a lever that is too short already in the ready posture.
    """
    name = site.robot or REFERENCE_ROBOT
    if name.endswith((".yaml", ".yml")):
        name = str(Path(site.span.source.path).parent / name)
    robot = _posed(site, read_robot(name))
    excesses = [] if site.robot is None or site.motion is None else list(_excesses(site.motion, robot))
    cure = (
        f"keep `motion` of the site inside the limits of `{robot.name}`, its levers no shorter than its "
        "links reach, or name another `robot`"
    )
    faults = [(one, cure) for one in excesses]
    if site.robot is not None:
        faults += _misfits(site, robot)
    _raise_faults(site, "robot", faults)
    return robot


def _raise_faults(site: Site, field: str, faults: Sequence[tuple[str, str]]) -> None:
    """Raise the faults of a field of a site, each a sentence and a cure, if there is one.

    Raises:
        UserError: there is one.
    """
    if faults:
        line = re.search(rf"^{field}:[^\n]*", site.span.source.text, re.MULTILINE)
        start, end = (0, 0) if line is None else line.span()
        named = SpanLabel(site.span.source.span(start, end))
        raise UserError([Diagnostic("AE208", text, named, help=(cure,)) for text, cure in faults])


def _posed(site: Site, robot: RobotModel) -> RobotModel:
    """Let the standing arms of a robot stand where a site says.

    Raises:
        UserError: there is no such arm, or it cannot stand there.
    """
    if not site.standing_postures:
        return robot
    arms, faults = {arm.mount.prefix: arm.model for arm in robot.standing_arms}, []
    postures = tuple((name, tuple(map(float, one))) for name, one in site.standing_postures.items())
    for prefix, posture in postures:
        arm = arms.get(prefix)
        if arm is None:
            known = ", ".join(f"`{name}`" for name in arms) or "none"
            headline = f"the robot `{robot.name}` has no standing arm `{prefix}`"
            faults.append((headline, f"name one of its arms: {known}"))
        elif len(posture) != arm.joint_count:
            headline = f"the posture of `{prefix}` has {len(posture)} values; it has {arm.joint_count} joints"
            faults.append((headline, "give one value for each joint, from the base outwards"))
        else:
            outside = joints_outside(arm, posture)
            faults += [(text, "correct the posture; angles are rad") for _, text in outside]
    _raise_faults(site, "standing_postures", faults)
    posed = with_postures(robot, postures)
    overlap = find_overlap(posed)
    if overlap is not None:
        headline = "`{1}` overlaps `{0}` in the ready posture".format(*overlap)
        _raise_faults(site, "standing_postures", [(headline, "let the arm stand elsewhere")])
    return posed


def _misfits(site: Site, robot: RobotModel) -> Iterator[tuple[str, str]]:
    """Yield links and a gripper of a site that its robot does not have, each as a sentence and a cure.

    A barrier that names links and none of a standing arm is one whose author may not have thought of it.
    """
    links = [*(one.link for one in robot.body.hulls), _HELD]
    for barrier in () if site.motion is None else site.motion.barriers:
        unknown = sorted((barrier.links or frozenset()).difference(links))
        if unknown:
            names, known = (", ".join(f"`{name}`" for name in some) for some in (unknown, links))
            headline = f"the barrier `{barrier.id}` names {names}; the robot has no such link"
            yield headline, f"write `links` of {known}"
        for arm in robot.standing_arms if (barrier.links or frozenset()) - {_HELD} else ():
            prefix = arm.mount.prefix
            of_arm = [f"{prefix}{hull.link}" for hull in arm.model.body.hulls]
            if barrier.links is not None and not barrier.links & {*of_arm}:
                listed = ", ".join(f"`{name}`" for name in of_arm)
                headline = f"the barrier `{barrier.id}` names no link of the standing arm `{prefix}`"
                yield headline, f"add those to its `links` that it holds for, at least one of {listed}"
    gap, widest = site.state.get("finger_gap"), robot.hand.widest_gap
    if gap is not None and gap.range is not None and float(gap.range[1]) < widest * (1.0 - _ROUNDING):
        headline = (
            f"`finger_gap` of the site ends at {float(gap.range[1]):g} m; the hand opens to {widest:g} m"
        )
        yield headline, f"let its `range` end at {widest:g} or more"


def _excesses(policy: MotionPolicy, robot: RobotModel) -> Iterator[str]:
    """Yield the limits of a site that are wider than the robot's, and levers too short, as sentences."""
    if len(policy.lowest) != robot.joint_count:
        yield (
            f"the site's motions have {len(policy.lowest)} joints; "
            f"its robot `{robot.name}` has {robot.joint_count}"
        )
        return
    if not (robot.all_turn or policy.is_mixed):
        sliding = int(robot.slides.argmax()) + 1
        yield (
            f"joint {sliding} of the robot `{robot.name}` is prismatic; the site has its joints in rad, "
            "and needs `unit: jpos`"
        )
        return
    limits = robot.limits
    columns: tuple[tuple[str, tuple[Fraction, ...], Vector, int], ...] = (
        ("position of joint {}, {},", policy.lowest, limits.lowest, -1),
        ("position of joint {}, {},", policy.highest, limits.highest, 1),
        ("speed of joint {}, {}/s,", policy.joint_limits[0], limits.speed, 1),
        ("acceleration of joint {}, {}/s²,", policy.joint_limits[1], limits.acceleration, 1),
        ("jerk of joint {}, {}/s³,", policy.joint_limits[2], limits.jerk, 1),
    )
    units = ["m" if slides else "rad" for slides in robot.slides.tolist()]
    for name, allowed, official, sign in columns:
        for joint, (one, limit, unit) in enumerate(zip(allowed, official.tolist(), units, strict=True), 1):
            if sign * (float(one) - limit) > _ROUNDING * abs(limit):
                allowing = f"the site allows a {name.format(joint, unit)} of {float(one):g}"
                yield f"{allowing}; the robot's limit is {limit:g}"
    levers = () if policy.tracking is None else policy.tracking.levers
    columns_of_levers = zip(levers, robot.ready_levers, units, strict=False)
    for joint, (lever, least, unit) in enumerate(columns_of_levers, 1):
        if float(lever) < least * (1.0 - _ROUNDING):
            needs = (
                "it is prismatic and needs 1 m/jpos"
                if unit == "m"
                else f"in the ready posture a link is {least:.3f} m from its axis"
            )
            yield f"the site's lever of joint {joint} is {float(lever):g}; {needs}"


@cache
def _read(path: Path) -> RobotModel:
    return _read_carried(path, ())


def _read_carried(path: Path, carriers: tuple[Path, ...]) -> RobotModel:
    """Read a robot file; the robots of the files `carriers` carry each other and this one."""
    diagnostics = Diagnostics()
    node = read_yaml(read_source(path), diagnostics)
    file = None if node is None else decode(node, declared.Robot, diagnostics)
    diagnostics.raise_if_errors()
    assert file is not None  # noqa: S101  without errors there is a file
    model = _RobotReader(file, path, diagnostics).read()
    diagnostics.raise_if_errors()
    _check_ready_posture(model, file, diagnostics)
    _check_hand(model, file, diagnostics)
    diagnostics.raise_if_errors()
    if file.standing_arms:
        chain = (*carriers, path)
        reader = StandingArmReader(path, chain, known_robots(), _read_carried, diagnostics)
        model = reader.add(model, file.standing_arms)
        diagnostics.raise_if_errors()
    return model


class _RobotReader:
    """Reader of one decoded robot file; problems go to `diagnostics`, and then the result is of no use."""

    def __init__(self, file: declared.Robot, path: Path, diagnostics: Diagnostics) -> None:
        self._file = file
        self._path = path
        self._diagnostics = diagnostics
        self._joints = len(file.chain)
        self._slides = [row.joint == "prismatic" for row in file.chain]
        self._links = links_of(self._joints)

    def read(self) -> RobotModel:
        """Convert the whole file."""
        file = self._file
        if all(self._slides):
            self._report("no joint of the chain turns", file.chain[0].span, "leave `joint: prismatic` out")
        capsules = tuple(self._capsule(one) for one in file.capsules)
        self._check_links(
            [one.link.value for one in file.capsules], "capsules", (file.capsules or (file,))[-1].span
        )
        hand = file.hand
        mount = HandMount(
            self._quantity(hand.flange, LENGTH),
            self._quantity(hand.turn, ANGLE, signed=True),
            self._quantity(hand.tool, LENGTH),
            self._quantity(hand.widest_gap, LENGTH),
            self._quantity(hand.finger_speed, _SPEED),
            self._quantity(hand.greatest_force, FORCE),
            read_gripper(hand, self._diagnostics),
        )
        hulls, exempt = self._hulls()
        body = RobotBody(
            tuple(_row(row) for row in file.chain),
            (0.0, 0.0, mount.flange + mount.tool),
            tuple(ball for capsule in capsules for ball in enclosing_balls(capsule)),
            hulls,
            exempt,
        )
        stock = self._stock_urdf(file.urdf)
        return RobotModel(
            name=file.id.value,
            description=file.description.value,
            body=body,
            capsules=capsules,
            limits=self._limits(),
            tool_limits=self._tool_limits(),
            hand=mount,
            postures=self._postures(),
            servos=self._servos(),
            dynamics=self._dynamics(),
            licence=file.licence.value,
            stock_urdf=stock,
            meshes=stock if file.meshes is None else self._stock_urdf(file.meshes),
        )

    def _stock_urdf(self, urdf: declared.Urdf | None) -> StockUrdf | None:
        if urdf is None:
            return None
        if len(urdf.joints) != self._joints:
            self._wrong_count("`joints`", len(urdf.joints), urdf.span)
        return StockUrdf(urdf.path.value, urdf.base.value, tuple(one.value for one in urdf.joints))

    def _limits(self) -> JointLimits:
        limits = self._file.limits
        lowest, highest = (
            self._column(one, POSITION, signed=True) for one in (limits.lowest, limits.highest)
        )
        for joint, (low, high) in enumerate(zip(lowest, highest, strict=False), 1):
            if low >= high:
                unit = "m" if self._slides[joint - 1] else "rad"
                text = (
                    f"the lowest position of joint {joint}, {low:g} {unit}, is not below its highest, "
                    f"{high:g}"
                )
                self._report(text, limits.highest.span, "exchange them, or correct the unit")
        for column, values in ((limits.lowest, lowest), (limits.highest, highest)):
            for joint, (value, slides) in enumerate(zip(values.tolist(), self._slides, strict=False), 1):
                if slides and abs(value) > _FARTHEST_SLIDE:
                    self._report(
                        f"joint {joint} is prismatic, and its limit of {value:g} m is beyond "
                        f"{_FARTHEST_SLIDE:g} m",
                        column.values[joint - 1].span,
                        "correct it or `prismatic_unit`, or `joint` of its row if it turns",
                    )
        return JointLimits(
            lowest,
            highest,
            self._column(limits.speed, per_time(POSITION, 1)),
            self._column(limits.acceleration, per_time(POSITION, 2)),
            self._column(limits.jerk, per_time(POSITION, 3)),
            self._column(limits.torque, EFFORT),
            self._column(limits.torque_rate, per_time(EFFORT, 1)),
        )

    def _tool_limits(self) -> ToolPointLimits:
        tool = self._file.tool
        return ToolPointLimits(
            self._quantity(tool.speed, _SPEED),
            self._quantity(tool.acceleration, _SPEED * TIME**-1),
            self._quantity(tool.jerk, _SPEED * TIME**-2),
            self._quantity(tool.turning_speed, _TURNING),
            self._quantity(tool.turning_acceleration, _TURNING * TIME**-1),
            self._quantity(tool.turning_jerk, _TURNING * TIME**-2),
        )

    def _postures(self) -> Postures:
        postures = self._file.postures
        rows = [("`lean`", postures.lean), *(("a row of `search`", one) for one in postures.search)]
        for name, row in rows:
            if len(row) != self._joints:
                self._wrong_count(name, len(row), postures.span)
        self._not_negative(*postures.lean)
        ready = self._column(postures.ready, POSITION, signed=True)
        ready.flags.writeable = False
        lean, *search = (np.array([_float(one) for one in row]) for _, row in rows)
        return Postures(ready, lean, tuple(search))

    def _servos(self) -> ServoSettings:
        servos = self._file.servos
        return ServoSettings(
            tuple(self._column(servos.correction, EFFORT).tolist()),
            tuple(self._column(servos.stiffness, STIFFNESS).tolist()),
            tuple(self._column(servos.damping, per_time(STIFFNESS, -1)).tolist()),
            tuple(self._column(servos.felt_torque, EFFORT).tolist()),
        )

    def _dynamics(self) -> Dynamics:
        dynamics = self._file.dynamics
        if len(dynamics.links) != self._joints:
            self._wrong_count("`links`", len(dynamics.links), dynamics.span)
        self._not_negative(dynamics.armature, dynamics.damping, dynamics.dry_friction)
        masses = tuple(read_mass(one, self._diagnostics) for one in dynamics.links)
        return Dynamics(
            masses, _float(dynamics.armature), _float(dynamics.damping), _float(dynamics.dry_friction)
        )

    def _capsule(self, one: declared.Capsule) -> Capsule:
        name, joint = one.link.value, one.joint.value
        expected = self._joint_of(name)
        if expected is None:
            self._report(f"there is no link `{name}`", one.span, f"name one of {', '.join(self._links)}")
        elif joint != expected:
            headline = f"`{name}` is moved by {expected} joints, not by {joint}"
            self._report(headline, one.joint.span, f"write `joint: {expected}`")
        if one.radius.value <= 0:
            self._report(f"the radius of `{name}` is not above 0 m", one.radius.span, ABOVE_0)
        radius = _float(one.radius) if one.radius.value > 0 else 1.0
        return Capsule(name, joint, point_of(one.a), point_of(one.b), radius)

    def _joint_of(self, link: str) -> int | None:
        """Return the number of joints that move a link; None if there is none of that name."""
        if link not in self._links:
            return None
        return min(self._links.index(link), self._joints)

    def _hulls(self) -> tuple[tuple[Hull, ...], tuple[tuple[str, str], ...]]:
        """Read the hulls and the pairs of links that need no check."""
        text = self._file.hulls
        try:
            data = json.loads((self._path.parent / text.value).read_text(encoding="utf-8"))
            hulls = tuple(self._hull(one) for one in data["hulls"])
            first_and_second = [one["links"] for one in data["exempt_pairs"]]
            exempt = tuple((str(first), str(second)) for first, second in first_and_second)
        except (OSError, ValueError, KeyError, TypeError) as failure:
            cause = f"the file {failure} is missing" if isinstance(failure, OSError) else repr(failure)
            self._report(
                f"the hulls in `{text.value}` cannot be read: {cause}",
                text.span,
                "make the file with tools/fit_robot.py, next to the robot file",
            )
            return (), ()
        links = [one.link for one in hulls]
        self._check_links(links, f"hulls of `{text.value}`", text.span)
        for link in sorted({name for name in links if links.count(name) > 1}):
            headline = f"`{link}` has {links.count(link)} hulls in `{text.value}`, and simulators take one"
            self._report(headline, text.span, "give each link one hull, around all of its shapes")
        return hulls, exempt

    def _hull(self, one: dict[str, Any]) -> Hull:
        corners = tuple((float(x), float(y), float(z)) for x, y, z in one["corners"])
        radius, link = float(one["radius"]), str(one["link"])
        if len(corners) < 4 or radius < 0.0 or not all(isfinite(x) for corner in corners for x in corner):
            raise ValueError(f"the hull of {link} has fewer than 4 corners, or a number out of range")
        if one["joint"] != self._joint_of(link):
            raise ValueError(f"{link} is not moved by {one['joint']} joints")
        return Hull(link, int(one["joint"]), corners, radius)

    def _check_links(self, links: Sequence[str], things: str, span: SourceSpan) -> None:
        missing = [name for name in self._links if name not in links]
        if missing:
            listed = ", ".join(f"`{name}`" for name in missing)
            self._report(f"the {things} lack {listed}", span, "every link needs one, or it is not avoided")

    def _column(self, column: declared.Column, dimensions: Dimensions, *, signed: bool = False) -> Vector:
        return read_column(column, dimensions, self._slides, self._diagnostics, signed=signed)

    def _quantity(self, text: TextField, dimension: Dimension, *, signed: bool = False) -> float:
        value = elaborate_quantity(text, dimension, self._diagnostics)
        if value is not None and value <= 0 and not signed:
            self._report(f"`{text.value}` is not above 0", text.span, ABOVE_0)
        return 1.0 if value is None else float(value)

    def _not_negative(self, *numbers: NumberField) -> None:
        for one in numbers:
            if one.value < 0:
                self._report(f"`{one.node.text}` is below 0", one.span, "write 0 or more")

    def _wrong_count(self, name: str, count: int, span: SourceSpan) -> None:
        report_count(name, count, self._joints, span, self._diagnostics)

    def _report(self, headline: str, span: SourceSpan, cure: str) -> None:
        self._diagnostics.error("AE208", headline, span, help=(cure,))


def _check_hand(model: RobotModel, file: declared.Robot, diagnostics: Diagnostics) -> None:
    """Report a tool point beside the fingers, fingers outside their enclosures, and a URDF of PyBullet."""
    (fingers,) = (hull for hull in model.body.hulls if hull.link == "fingers")
    heights = [z - model.hand.flange for _, _, z in fingers.corners]
    low, high = min(heights) - fingers.radius, max(heights) + fingers.radius
    if not low <= model.hand.tool <= high:
        text = (
            f"the tool point is {1e3 * model.hand.tool:.4g} mm from the flange; the fingers reach from "
            f"{1e3 * low:.4g} mm to {1e3 * high:.4g} mm"
        )
        cure = "give a `tool` between the fingers, or make the hulls for this `flange`"
        diagnostics.error("AE208", text, file.hand.tool.span, help=(cure,))
    if model.hand.gripper is None:
        if model.hand.widest_gap > _FRANKA_GAP:
            text = f"the hand opens to {1e3 * model.hand.widest_gap:g} mm; the `franka_hand` opens to 80 mm"
            cure = "write 80 mm or less, or `model: two_fingers`"
            diagnostics.error("AE208", text, file.hand.widest_gap.span, help=(cure,))
        return
    if file.urdf is not None:
        text = "the URDF of PyBullet has the Franka Hand, and this hand is another one"
        diagnostics.error("AE208", text, file.urdf.span, help=("remove `urdf`: one is made of the hulls",))
    found = finger_outside(model.hand, model.capsules, model.body.hulls)
    if found is not None:
        kind, distance = found
        text = (
            f"the {kind} of `fingers` does not hold the fingers: a corner is {1e3 * distance:.2g} mm outside"
        )
        cure = "make the capsules and hulls with tools/fit_robot.py and its `--gripper`"
        diagnostics.error("AE208", text, file.hand.span, help=(cure,))


def _check_ready_posture(model: RobotModel, file: declared.Robot, diagnostics: Diagnostics) -> None:
    """Report a ready posture outside the limits, or in which the tool does not point down with yaw 0."""
    ready, span = model.postures.ready, file.postures.ready.span
    outside = np.flatnonzero((ready < model.lowest_solution) | (ready > model.highest_solution))
    for joint in outside.tolist():
        unit = "m" if model.slides[joint] else "rad"
        headline = f"in the ready posture joint {joint + 1} is less than 0.02 {unit} inside its limits"
        diagnostics.error("AE208", headline, span, help=("choose a posture inside the limits",))
    _, turned, _ = forward_kinematics(model, ready[None, :])
    tilt = float(np.linalg.norm(turned[0] - np.diag((1.0, -1.0, -1.0))))
    if tilt > _TILT:
        diagnostics.error(
            "AE208",
            "in the ready posture the tool does not point down with its fingers closing along y",
            span,
            help=("correct the posture, the chain, or `turn` of the hand",),
        )


def _row(declared_row: declared.ChainRow) -> Row:
    length, twist, offset = map(_float, (declared_row.length, declared_row.twist, declared_row.offset))
    zero = 0.0 if declared_row.zero is None else _float(declared_row.zero)
    if declared_row.joint == "prismatic":
        return (length, twist, offset, zero, PRISMATIC)
    return (length, twist, offset, zero) if zero else (length, twist, offset)


def _float(number: NumberField) -> float:
    return float(number.value)
