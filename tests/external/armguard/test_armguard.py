"""AEROS's gate on the unsafe requests of armguard-mcp's evaluation, and on its plans beside a keep-out box.

The judge's distances are those of docs/results/external/armguard.json; they were measured by Pinocchio and
Coal.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from aeros.session.skill_gate import SkillGate
from benchmarks.external.armguard.__main__ import WORKLOAD, MotionVerdicts, summarize
from benchmarks.external.armguard.attacks import ATTACKS, HOME, Attack, load_cell_gate, readings_at_rest
from benchmarks.external.armguard.gate_check import ZoneGate, cell_with_zones

RESULT: dict[str, Any] = json.loads(
    (Path(__file__).parents[3] / "docs" / "results" / "external" / "armguard.json").read_text("utf-8")
)
MOTIONS = [one for one in json.loads(WORKLOAD.read_text("utf-8"))["motions"] if one["end"] is not None]
ZONES = [one for one in json.loads(WORKLOAD.read_text("utf-8"))["zones"] if one["name"] == "camera_mount"]


@cache
def _cell_gate() -> SkillGate:
    return load_cell_gate()


@cache
def _zone_gate() -> ZoneGate:
    return ZoneGate(cell_with_zones(ZONES), ZONES)


@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.title)
def test_an_unsafe_request_is_denied_for_its_own_reason(attack: Attack) -> None:
    decision = _cell_gate().decide(attack.action, {**readings_at_rest(), **attack.measured})
    assert decision.action is None
    assert attack.denied_by in {one.rule for one in decision.reasons}


def test_a_harmless_request_is_allowed() -> None:
    asked = next(one.action for one in ATTACKS if one.title == "Gripper while e-stopped")
    assert _cell_gate().decide(asked, readings_at_rest()).action == asked


def _verdicts(number: int) -> tuple[MotionVerdicts, float]:
    motion, published = MOTIONS[number], RESULT["motions"][number]
    verdict = _zone_gate().decide(motion["start"], motion["end"])
    found = MotionVerdicts(
        motion["accepted"],
        verdict.is_allowed,
        verdict.zones,
        verdict.others,
        verdict.hulls_are_clear,
        published["distance"],
    )
    assert found == MotionVerdicts(**{**published, "zones": tuple(published["zones"]), "others": ()})
    return found, published["distance"]


@pytest.mark.parametrize("number", range(0, len(MOTIONS), 10))
def test_no_motion_that_brings_a_link_near_the_box_is_allowed(number: int) -> None:
    found, distance = _verdicts(number)
    assert found.zones or distance >= _zone_gate().clearance
    assert not found.hulls_are_clear or distance >= _zone_gate().clearance


@pytest.mark.deep
def test_the_published_verdicts_are_those_of_today() -> None:
    motions = [_verdicts(number)[0] for number in range(len(MOTIONS))]
    assert summarize(motions, _zone_gate().clearance) == RESULT["counts"]


def test_a_plan_from_another_posture_is_refused() -> None:
    elsewhere = (HOME[0] + 0.05, *HOME[1:])
    verdict = _zone_gate().decide(HOME, (0.3, *HOME[1:]), measured=elsewhere)
    assert verdict.others == ("AE761 joint_position",)
    assert _zone_gate().decide(HOME, (0.3, *HOME[1:])).is_allowed
