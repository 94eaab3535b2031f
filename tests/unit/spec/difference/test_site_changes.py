"""A change of a site is found, in its direction, and shown where it is written."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.spec.difference.versions import change, changed, sites

SITE_CHANGES = [
    ("require: force <= 30 N", "require: force <= 31 N", {"actions/grip": 1}),
    ("risk_ceiling: medium", "risk_ceiling: high", {"policy/risk_ceiling": 1}),
    ("stand still\n    risk: low", "stand still\n    risk: medium", {"actions/wait/risk": -1}),
    ("    actuators: [gripper]\n", "    actuators: [gripper, arm]\n", {"actions/grip/actuators": -1}),
    ("  grip:\n", "  bow: {description: bow, risk: low}\n  grip:\n", {"actions/bow": 1}),
    ("actuators: [arm, gripper]\n", "actuators: [arm]\n", {"policy/access/actuators": -1}),
    ("retries: 3", "retries: 4", {"policy/limits/retries": 1}),
    ("replans: 10}", "replans: 10, planning: 20 s}", {"policy/limits/planning": -1}),
    ("at_most: 60", "at_most: 50", {"policy/quotas/grip-rate": -1}),
    ("within: 60 s", "within: 50 s", {"policy/quotas/grip-rate": 1}),
    ("resources: {arm: 1}", "resources: {arm: 2}", {"resources/arm": 1}),
    ("sensor: camera, max_age: 1 s", "sensor: camera, max_age: 2 s", {"state/bench_clean/max_age": 1}),
    ("angle: {type: real, unit: rad, range: [-4, 4]}", "angle: {type: real, unit: rad, range: [-1, 4]}",
     {"actions/turn": -1, "actions/turn/parameters/angle/range": 0}),
    ("unit: m, range: [0, 20]", "unit: m, range: [0, 9]",
     {"actions/move": -1, "actions/turn": -1, "actions/grip": -1, "state/human_distance/range": 0}),
    ("  quotas:\n", "  blocks:\n    - {id: no-turns, action: turn, reason: an example}\n  quotas:\n",
     {"actions/turn": -1, "policy/blocks/no-turns": -1}),
    ("  quotas:\n", "  isolation: {trusted: [tidy]}\n  quotas:\n", {"policy/isolation/trusted": 1}),
    ("  quotas:\n", "  isolation: {require: [seccomp, rlimits]}\n  quotas:\n",
     {"policy/isolation/require": 1}),
    ("  quotas:\n", "  undeclared_outcome: replan\n  quotas:\n", {"policy/undeclared_outcome": 1}),
    ("  quotas:\n", "  isolation: {missing: warn}\n  quotas:\n", {"policy/isolation/missing": 1}),
    ("  quotas:\n", "  isolation: {answer_within: 2 s}\n  quotas:\n", {"policy/isolation/answer_within": -1}),
    ("  quotas:\n", "  isolation: {memory: 64 MiB}\n  quotas:\n", {"policy/isolation/memory": -1}),
    ("  quotas:\n", "  isolation: {processor: 50 %}\n  quotas:\n", {"policy/isolation/processor": -1}),
    ("  quotas:\n", "  mcp: {execute: allowed}\n  quotas:\n", {"policy/mcp/execute": 1}),
    ("  quotas:\n", "  mcp: {execute: denied}\n  quotas:\n", {"policy/mcp/execute": -1}),
    ("  quotas:\n", "  mcp: {execute: elicitation}\n  quotas:\n", {"policy/mcp/execute": 1}),
    ("  quotas:\n", "  mcp: {most_steps: 21}\n  quotas:\n", {"policy/mcp/most_steps": 1}),
    ("  quotas:\n", "  mcp: {skills: [tidy.put]}\n  quotas:\n", {"policy/mcp/skills": -1}),
]  # fmt: skip


@pytest.mark.parametrize(("before", "after", "expected"), SITE_CHANGES)
def test_a_change_of_a_site_is_found_in_its_direction(
    before: str, after: str, expected: dict[str, int], old: Path, new: Path
) -> None:
    change(new / "site.yaml", before, after)
    words = {1: "newly allowed", 0: "changed", -1: "newly denied"}
    assert changed(sites(old, new)) == {name: words[way] for name, way in expected.items()}
    assert changed(sites(new, old)) == {name: words[-way] for name, way in expected.items()}


@pytest.mark.parametrize(("before", "after", "expected"), SITE_CHANGES)
def test_a_change_of_a_site_is_shown_where_it_is_written(
    before: str, after: str, expected: dict[str, int], old: Path, new: Path
) -> None:
    change(new / "site.yaml", before, after)
    for one in sites(old, new).changes:
        for diagnostic in one.diagnostics:
            assert diagnostic.primary is not None, (one.subject, expected)
            assert diagnostic.primary.span.source.path.endswith("site.yaml")


def test_a_limit_is_shown_as_it_was_and_as_it_is(old: Path, new: Path) -> None:
    change(new / "site.yaml", "skill_timeout: 60 s", "skill_timeout: 61 s")
    (diagnostic,) = (one for change_ in sites(old, new).changes for one in change_.diagnostics)
    assert diagnostic.primary is not None
    assert [diagnostic.primary.span.text, *(label.span.text for label in diagnostic.secondary)] == [
        "61 s",
        "60 s",
    ]


def test_new_vocabulary_is_reported_and_may_have_any_value(old: Path, new: Path) -> None:
    line = "  bench_clean: {type: bool, sensor: camera, max_age: 1 s}"
    change(new / "site.yaml", line, f"{line}\n  lid_open: {{type: bool, sensor: camera, max_age: 1 s}}")
    change(new / "site.yaml", "require: force <= 30 N", "require: force <= 30 N and not lid_open")
    assert changed(sites(old, new)) == {"actions/grip": "newly denied", "state/lid_open": "changed"}


JOINT = """joint:
  - id: slow-beside-whoever-waits
    on: {moving: move, waiting: wait}
    require: moving.speed <= 100 mm/s or waiting.duration <= 1 s
    rationale: an example
    source: tests

policy:
"""


def test_a_joint_rule_is_compared_by_the_pairs_it_allows(old: Path, new: Path) -> None:
    change(new / "site.yaml", "policy:\n", JOINT)
    assert changed(sites(old, new)) == {"joint/slow-beside-whoever-waits": "newly denied"}
    assert changed(sites(new, old)) == {"joint/slow-beside-whoever-waits": "newly allowed"}
    change(old / "site.yaml", "policy:\n", JOINT.replace("100 mm/s", "200 mm/s"))
    assert changed(sites(old, new)) == {"joint/slow-beside-whoever-waits": "newly denied"}


def test_a_change_of_what_motions_are_decided_by_is_reported_as_allowing_more_and_less(
    old: Path, new: Path
) -> None:
    change(new / "site.yaml", "clearance: 10 mm", "clearance: 9 mm")
    assert changed(sites(old, new)) == {"motion": "incomparable", "motion/clearance": "changed"}
    assert [one.subject for one in sites(old, new).changes if one.relation.allows_more] == ["motion"]


def test_a_change_of_an_attenuation_is_reported_and_not_compared(old: Path, new: Path) -> None:
    change(new / "site.yaml", '"min(speed, reduced_speed)"', '"min(speed, reduced_speed / 2)"')
    assert changed(sites(old, new)) == {"actions/move/attenuation": "changed"}


def test_a_change_of_a_sensor_is_reported(old: Path, new: Path) -> None:
    change(new / "site.yaml", "range: [-4, 4], sensor: encoders", "range: [-4, 4], sensor: panel")
    assert changed(sites(old, new)) == {"state/joint_angle/sensor": "changed"}
