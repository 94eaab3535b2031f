"""Descriptions of violated rules: the quantities, their values, and the bounds they broke."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest

from aeros.runtime.gate.violation import MotionDeviation, RuleViolation
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.expr import terms as t
from aeros.spec.text.discovery import reference_site_path
from tests.unit.runtime.conftest import METRES

SITE = load_site(reference_site_path(), Diagnostics())
SAFE: dict[str, Any] = {
    **{f"joint_velocity[j{joint}]": 0.0 for joint in range(1, 8)},
    **{f"joint_position[j{joint}]": -0.5 if joint == 4 else 0.5 for joint in range(1, 8)},
    "target.x": 0.5, "target.y": 0.0, "target.z": 0.3,
    "tool_position.x": 0.0, "tool_position.y": 0.0, "tool_position.z": 0.3,
    "base_position.x": 0.0, "base_position.y": 0.0, "base_position.z": 0.0,
    "human_distance": 20.0, "link_speed": 0.0, "contact_force": 0.0, "speed": 0.2,
    "estop_pressed": False, "holding": False,
}  # fmt: skip


@pytest.mark.parametrize(
    ("rule", "measured", "message"),
    [
        ("emergency-stop", {"estop_pressed": True}, "estop_pressed is true"),
        ("collision-force", {"contact_force": 80.0}, "contact_force is 80 N (at most 65 N)"),
        (
            "joint-speeds",
            {"joint_velocity[j3]": -2.5},
            "abs(joint_velocity[j3]) is 2.5 rad/s (at most 2.175 rad/s)",
        ),
        (
            "joint-positions",
            {"joint_position[j6]": -0.5},
            "joint_position[j6] is -0.5 rad (at least -0.0175 rad)",
        ),
        (
            "link-speeds-near-person",
            {"human_distance": 1.0, "link_speed": 0.3},
            "human_distance is 1 m (at least 2.3 m), link_speed is 0.3 m/s (at most 0.25 m/s)",
        ),
        (
            "reduced-speed-towards-person",
            {"human_distance": 2.6, "speed": 0.25},
            "human_distance is 2.6 m (below 2.3 m), human_distance is 2.6 m (at least 2.8 m), "
            "speed is 0.25 m/s (at most 0.2 m/s)",
        ),
        ("arm-separation", {"human_distance": 0.9}, "human_distance is 0.9 m (at least 0.927 m)"),
        (
            "carrying-speed",
            {"holding": True, "speed": 0.4},
            "holding is true, speed is 0.4 m/s (at most 0.3 m/s)",
        ),
        (
            "own-base",
            {"target.x": 0.1, "target.z": 0.3},
            None,
        ),
    ],
)  # fmt: skip
def test_each_part_that_does_not_hold_is_named(
    rule: str, measured: dict[str, Any], message: str | None
) -> None:
    assert SITE is not None
    term = next(one for one in SITE.rules if one.id == rule).terms["move_tool"]
    text = str(RuleViolation(rule, term, {**SAFE, **measured}))
    assert text == message if message else "target.x" in text


def test_each_bound_that_a_motion_broke_is_named() -> None:
    term = t.Compare("<=", t.Variable("gap", METRES, t.VariableRole.STATE), t.Literal(Fraction(1), METRES))
    parts = RuleViolation("far", term, {"gap": 1.5}).unmet_bounds
    assert str(MotionDeviation("off-the-path", parts)) == "gap is 1.5 m (at most 1 m)"
    assert str(MotionDeviation("off-the-path", parts * 2)) == ", ".join(["gap is 1.5 m (at most 1 m)"] * 2)
