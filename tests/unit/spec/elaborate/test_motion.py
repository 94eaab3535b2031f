"""The motion section of a site: what it becomes, and every way in which it may be at fault."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.render import render_text
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.motion import HeldObject, MotionKind, TouchedSurface, Tracking
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path


def _loaded(tmp_path: Path, *edits: tuple[str, str]) -> tuple[Site | None, list[str]]:
    text = reference_site_path().read_text()
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path = tmp_path / "site.yaml"
    path.write_text(text)
    sink = Diagnostics()
    return load_site(path, sink), [render_text(one).splitlines()[0] for one in sink]


def test_names_and_units_are_settled(tmp_path: Path) -> None:
    site, message = _loaded(tmp_path)
    assert message == []
    assert site is not None
    motion = site.motion
    assert motion is not None
    below = frozenset({"bench", "bench_core", "ground", "ground_core"})
    surface = TouchedSurface(below, Fraction(15, 100), Fraction(12, 100))
    assert motion.kinds["move_tool"] == MotionKind("target", None, "speed", surface=surface)
    assert motion.kinds["move_base"] == MotionKind(None, ("x", "y"), "speed")
    joints = ("q1", "q2", "q3", "q4", "q5", "q6", "q7")
    assert motion.kinds["move_joints"] == MotionKind(None, None, "speed", joints)
    assert motion.joint_limits[2][1] == 3750
    assert motion.tool_limits.translation == (Fraction(17, 10), Fraction(13), Fraction(6500))
    assert motion.tool_limits.rotation == (Fraction(5, 2), Fraction(25), Fraction(12500))
    assert motion.clearance == Fraction(15, 1000)
    assert motion.base_limits == (Fraction(6, 10), Fraction(1))
    assert motion.base_variable == "base_position"
    assert motion.link_clearance == Fraction(10, 1000)
    assert motion.held == HeldObject("holding", site.volumes["largest_object"], frozenset({"grip"}))
    assert motion.kinds["slide"].surface == TouchedSurface(below, Fraction(21, 100))
    assert motion.tracking is not None
    levers = tuple(Fraction(lever, 1000) for lever in (990, 990, 745, 665, 300, 300, 150))
    assert motion.tracking == Tracking("tracking_error", Fraction(10, 1000), levers)
    assert sum(motion.tracking.levers) * motion.start_tolerance <= Fraction(10, 1000)
    assert motion.back_off == "back_off"
    fence, column = motion.barriers[4:6]
    assert fence.keep_inside
    assert fence.links is None
    assert column.is_in_base_frame
    assert column.box == site.volumes["column"]


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (
            ("within: 10 mm, levers", "within: 16 mm, levers"),
            "error[AE611] tracking-beyond-clearance: links may be 16 mm from their commands; the clearance is"
            " 15 mm, of links 10 mm",
        ),
        (
            ("starts_within: 0.0024 rad", "starts_within: 0.05 rad"),
            "error[AE611] tracking-beyond-clearance: joints that start 0.05 rad off put a link 207 mm off;"
            " the clearance is 15 mm, of links 10 mm",
        ),
        (
            ("link_clearance: 10 mm", "link_clearance: 9.95 mm"),
            "error[AE611] tracking-beyond-clearance: links may be 10 mm from their commands; the clearance is"
            " 15 mm, of links 9.95 mm",
        ),
        (
            ("tracking_max:\n    value: 10 mm", "tracking_max:\n    value: 10.1 mm"),
            "error[AE611] tracking-beyond-clearance: the rules on `move_tool`, `move_joints`, `slide`,"
            " `move_base` allow a `tracking_error` of 10.1 mm; motions are decided for 10 mm",
        ),
        (
            ("require: tracking_error <= tracking_max", "require: tracking_error <= 2 * tracking_max"),
            "error[AE611] tracking-beyond-clearance: the rules on `move_tool`, `move_joints`, `slide`,"
            " `move_base` allow a `tracking_error` of 20 mm; motions are decided for 10 mm",
        ),
        (
            (
                "require: tracking_error <= tracking_max",
                "require: holding implies tracking_error <= tracking_max",
            ),
            "error[AE611] tracking-beyond-clearance: no rule on `move_tool`, `move_joints`, `slide`,"
            " `move_base` requires `tracking_error <= 10 mm`",
        ),
        (
            ("  link_clearance: 10 mm", "  # link_clearance: 10 mm"),
            "error[AE102] missing-field: the field `link_clearance` is missing in `motion`",
        ),
        (
            ("  held: {unless_false", "  # held: {unless_false"),
            "error[AE102] missing-field: the field `held` is missing in `motion`",
        ),
        (
            ("  tracking: {measured_by", "  # tracking: {measured_by"),
            "error[AE102] missing-field: the field `tracking` is missing in `motion`",
        ),
        (
            ("held: {unless_false: holding, ", "held: {"),
            "error[AE112] wrong-length: `held` takes `unless_false` and `volume`, or `nothing` alone",
        ),
        (
            ("held: {unless_false: holding, ", "held: {nothing: it welds, unless_false: holding, "),
            "error[AE112] wrong-length: `held` takes `unless_false` and `volume`, or `nothing` alone",
        ),
        (
            ("gripped_by: [grip]", "gripped_by: [grasp]"),
            "error[AE122] unknown-reference: `grasp` is not an action kind",
        ),
        (
            ("measured_by: base_position", "measured_by: base_speed"),
            "error[AE203] type-mismatch: `base_speed` is real [m/s], not a position",
        ),
        (
            ("speed: placing_speed, within", "speed: tracking_max, within"),
            "error[AE204] unit-mismatch: `tracking_max` is in real [m], not m/s",
        ),
        (
            (
                "on: [move_tool, slide, move_joints, move_base]\n    require: tracking_error",
                "on: [move_tool, move_joints, move_base]\n    require: tracking_error",
            ),
            "error[AE611] tracking-beyond-clearance: no rule on `slide` requires `tracking_error <= 10 mm`",
        ),
        (
            ("measured_by: tracking_error", "measured_by: tool_speed"),
            "error[AE203] type-mismatch: `tool_speed` is real [m/s], not a length",
        ),
        (
            ("back_off: back_off", "back_off: wait"),
            "error[AE112] wrong-length: `wait` backs off, so it has no parameters and is not protective",
        ),
        (
            ("slide:\n      {peak", "glide:\n      {peak"),
            "error[AE122] unknown-reference: `glide` is not an action kind",
        ),
        (
            ("tool_ends_at: target", "tool_ends_at: goal"),
            "error[AE122] unknown-reference: `goal` is not a parameter of `move_tool`",
        ),
        (
            ("tool_ends_at: target", "tool_ends_at: yaw"),
            "error[AE203] type-mismatch: `yaw` is real [rad], not vec3 [m]",
        ),
        (
            ("base_ends_at: [x, y]", "base_ends_at: [x]"),
            "error[AE112]",
        ),
        (
            ("base: {speed: driving_speed_max,", "base: {speed: drive_deceleration,"),
            "error[AE204] unit-mismatch: `drive_deceleration`",
        ),
        (
            ("joints_end_at: [q1, q2,", "joints_end_at: [q2,"),
            "error[AE112] wrong-length: `joints_end_at` takes 7 parameters, one for each joint, not 6",
        ),
        (
            ("joints_end_at: [q1,", "joints_end_at: [speed,"),
            "error[AE203] type-mismatch: `speed` is real [m/s], not real [rad]",
        ),
        (
            ("starts_at: joint_position", "starts_at: joint_velocity"),
            "error[AE203] type-mismatch: `joint_velocity` does not have one position, in rad or jpos, for "
            "each joint",
        ),
        (
            ("starts_at: joint_position", "starts_at: encoders"),
            "error[AE122] unknown-reference: `encoders` is not a state variable",
        ),
        (("lowest: q_min", "lowest: q_least"), "error[AE122] unknown-reference: `q_least` is not a constant"),
        (
            ("lowest: q_min", "lowest: reduced_speed"),
            "error[AE203] type-mismatch: `reduced_speed` does not have one value for each joint",
        ),
        (("jerk: qddd_max}", "jerk: qdd_max}"), "error[AE204] unit-mismatch: `qdd_max`"),
        (
            ("turning_jerk: turning_jerk_max", "turning_jerk: qddd_max"),
            "error[AE203] type-mismatch: `qddd_max` is not a single value",
        ),
        (
            ("turning_jerk: turning_jerk_max", "turning_jerk: cartesian_jerk_max"),
            "error[AE204] unit-mismatch: `cartesian_jerk_max`",
        ),
        (("clearance: 15 mm", "clearance: 15 s"), "error[AE204]"),
        (("volume: bench_core", "volume: bench_kern"), "error[AE122] unknown-reference: `bench_kern`"),
        (("links: [link5, link6, link7, hand, fingers, held]", "links: []"), "error[AE112]"),
        (("link_clearance: 10 mm", "link_clearance: 10 s"), "error[AE204]"),
        (("unless_false: holding", "unless_false: held"), "error[AE122] unknown-reference: `held`"),
        (("unless_false: holding", "unless_false: finger_gap"), "error[AE203]"),
        (("volume: largest_object", "volume: largest"), "error[AE122] unknown-reference: `largest`"),
        (
            ("[bench, bench_core, ground, ground_core], speed: sliding", "[bench, bank], speed: sliding"),
            "error[AE122] unknown-reference: `bank`",
        ),
        (("keep: in", "keep: near"), "error[AE"),
    ],
)
def test_each_fault_is_reported_where_it_is(tmp_path: Path, edit: tuple[str, str], message: str) -> None:
    site, found = _loaded(tmp_path, edit)
    assert site is None
    assert len(found) == 1
    assert found[0].startswith(message), found[0]


def test_reduced_speed_keeps_every_contact_below_its_transient_force() -> None:
    """ISO/TS 15066, A.3.5: v <= F_T / sqrt(mu*k); a region that is held fast has mu = m_R."""
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    numbers: dict[str, Any] = {name: getattr(one, "value", None) for name, one in site.constants.items()}
    tables: dict[str, Any] = {name: getattr(one, "values", None) for name, one in site.constants.items()}
    quasi_static, transient = tables["quasi_static_force"], tables["transient_force"]
    assert [2 * force for force in quasi_static] == list(transient)
    least = min(
        force**2 / (numbers["robot_mass"] * stiffness)
        for force, stiffness in zip(transient, tables["region_stiffness"], strict=True)
    )
    assert numbers["reduced_tool_speed"] < numbers["reduced_speed"] < numbers["contact_speed"]
    assert numbers["contact_speed"] ** 2 <= least < (numbers["contact_speed"] + Fraction(1, 1000)) ** 2
    assert numbers["collision_force"] < min(quasi_static) / 2 + 1
