"""Fields that no comparison understands are reported with their text; the others are left to their comparison."""

# ruff: noqa: E501  a change stands in one line with the field that it is of

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.spec.declared.ecm import Ecm
from aeros.spec.declared.site import Site
from aeros.spec.difference.compare import PolicyDifference, compare
from aeros.spec.difference.other_changes import MODULE_FIELDS, SITE_FIELDS
from tests.unit.spec.difference.schema_instances import schema_paths
from tests.unit.spec.difference.versions import change, changed, named, sites

OTHER = "changed"

SITE_CASES: dict[str, tuple[str, ...]] = {
    "state.*.sensor": ("range: [-4, 4], sensor: encoders", "range: [-4, 4], sensor: panel"),
    "state.*.max_age": ("sensor: scanner, max_age: 100 ms", "sensor: scanner, max_age: 200 ms"),
    "actions.*.risk": ("asks a program\n    risk: low", "asks a program\n    risk: medium"),
    "actions.*.actuators": ("actuators: [gripper]", "actuators: [gripper, arm]"),
    "actions.*.protective": ("risk: low, protective: true}", "risk: low, protective: true}\n  halt: {description: a second stop, risk: low}"),
    "actions.*.tool.timeout": ("8080/ask\", timeout: 2 s", "8080/ask\", timeout: 3 s"),
    "actions.*.tool.answers": ("answers: [answered, answered_too]", "answers: [answered]", "  answered_too: {type: bool, sensor: ask, max_age: 1 s}\n", ""),
    "actions.*.tool.http": ("127.0.0.1:8080/ask", "127.0.0.1:9999/ask"),
    "actions.*.tool.program": ("[/usr/bin/true, now]", "[/usr/bin/true, then]"),
    "actions.*.tool.mcp.tool": ("tool: times, url", "tool: dates, url"),
    "actions.*.tool.mcp.command": ("command: [/usr/bin/server]", "command: [/usr/bin/another]"),
    "actions.*.tool.channel": ("channel: radio", "channel: log"),
    "actions.*.tool.confinement.reads": ("reads: [/opt/a]", "reads: [/opt/a, /opt/c]"),
    "actions.*.tool.confinement.writes": ("writes: [/opt/b]", "writes: []"),
    "actions.*.tool.confinement.network": ("network: true", "network: false"),
    "actions.*.tool.confinement.memory": ("memory: 256 MiB, p", "memory: 257 MiB, p"),
    "actions.*.tool.confinement.processor": ("processor: 50 %", "processor: 51 %"),
    "actions.*.tool.confinement.processes": ("processes: 4", "processes: 5"),
    "actions.*.tool.mcp.url": ("127.0.0.1:8081/mcp", "127.0.0.1:8082/mcp"),
    "invariants.*.require": ("require: force <= 30 N", "require: force <= 31 N"),
    "invariants.*.on": ("on: [move, turn, grip]", "on: [move, turn]"),
    "invariants.*.attenuate.*": ("min(speed, reduced_speed)", "min(speed, reduced_speed / 2)"),
    "joint.*.require": ("a.speed <= 1 m/s", "a.speed <= 2 m/s"),
    "cameras.*.sensor": ("{top: {sensor: camera", "{top: {sensor: scanner"),
    "cameras.*.width": ("width: 640", "width: 641"),
    "cameras.*.height": ("height: 480", "height: 479"),
    "resources.*": ("resources: {arm: 1}", "resources: {arm: 2}"),
    "policy.access.actuators": ("actuators: [arm, gripper]\n    sensors", "actuators: [gripper]\n    sensors"),
    "policy.access.sensors": ("sensors: [scanner, panel,", "sensors: [scanner,"),
    "policy.access.channels": ("    channels: [radio]", "    channels: [radio, log]"),
    "policy.access.compute": ("    compute: [gpu]", "    compute: []"),
    "policy.grants.*.actuators": ("{actuators: [arm], sensors: [camera]", "{sensors: [camera]"),
    "policy.grants.*.sensors": ("sensors: [camera], channels", "sensors: [scanner], channels"),
    "policy.grants.*.channels": ("channels: [radio], compute", "compute"),
    "policy.grants.*.compute": (", compute: [gpu]}}", "}}"),
    "policy.risk_ceiling": ("risk_ceiling: medium", "risk_ceiling: high"),
    "policy.limits.skill_timeout": ("skill_timeout: 60 s", "skill_timeout: 61 s"),
    "policy.limits.retries": ("retries: 3", "retries: 4"),
    "policy.limits.replans": ("replans: 10,", "replans: 11,"),
    "policy.limits.planning": ("planning: 20 s", "planning: 21 s"),
    "policy.blocks.*.module": ("module: polish, skill: rub, ", ""),
    "policy.blocks.*.skill": ("skill: rub, ", ""),
    "policy.blocks.*.action": ("skill: rub, action: grip, ", "skill: rub, "),
    "policy.quotas.*.on": ("on: [grip], at_most", "on: [grip, turn], at_most"),
    "policy.quotas.*.at_most": ("at_most: 60", "at_most: 61"),
    "policy.quotas.*.within": ("within: 60 s", "within: 61 s"),
    "policy.isolation.require": ("[seccomp, rlimits]", "[seccomp]"),
    "policy.isolation.missing": ("missing: warn", "missing: refuse"),
    "policy.isolation.trusted": ("trusted: [polish]", "trusted: []"),
    "policy.isolation.answer_within": ("answer_within: 2 s", "answer_within: 3 s"),
    "policy.isolation.processor": ("processor: 80 %", "processor: 79 %"),
    "policy.isolation.memory": ("memory: 128 MiB", "memory: 64 MiB"),
    "policy.mcp.execute": ("execute: denied", "execute: allowed"),
    "policy.mcp.most_steps": ("most_steps: 10", "most_steps: 11"),
    "policy.mcp.skills": (", skills: [tidy.wipe]", ""),
    "policy.undeclared_outcome": ("undeclared_outcome: replan", "undeclared_outcome: stop"),
    "policy.perception.public": ("    public: true\n", ""),
    "policy.perception.timeout": ("timeout: 500 ms", "timeout: 400 ms"),
    "policy.perception.rate": ("rate: 60 Hz", "rate: 61 Hz"),
    "policy.perception.processor": ("processor: 70 %", "processor: 71 %"),
    "policy.perception.memory": ("memory: 512 MiB", "memory: 511 MiB"),
    "policy.perception.shared.*.max_age": ("range: [0, 1], max_age: 1 s", "range: [0, 1], max_age: 2 s"),
    "policy.perception.shared.*.uncertainty": ("uncertainty: 1 mm", "uncertainty: 2 mm"),
    "policy.perception.shared.*.in_invariants": (", in_invariants: true", ""),
}  # fmt: skip
"""A change of each field of a site that is compared by what it allows."""

MODULE_CASES: dict[str, tuple[str, ...]] = {
    "permissions.actuators": ("actuators: [arm, gripper]\n  sensors", "actuators: [gripper]\n  sensors"),
    "permissions.sensors": ("camera, panel, load_cell]", "camera, load_cell]"),
    "permissions.channels": ("  channels: [radio]\n", ""),
    "permissions.compute": ("  compute: [gpu]\n", ""),
    "permissions.actions.*": ("grip: force <= 15 N", "grip: force <= 16 N"),
    "permissions.worker.memory": ("memory: 64 MiB", "memory: 65 MiB"),
    "permissions.worker.processor": ("processor: 40 %", "processor: 41 %"),
    "permissions.worker.answer_within": ("answer_within: 1 s", "answer_within: 2 s"),
    "skills.*.envelope.*": ("grip: force <= 10 N", "grip: force <= 11 N"),
    "skills.*.precondition": ("precondition: cloth_held", "precondition: cloth_held or bench_clean"),
    "skills.*.hold": ("    hold: human_distance >= 500 mm\n", ""),
    "skills.*.risk": ("risk: low", "risk: medium"),
    "skills.*.timeout": ("timeout: 20 s", "timeout: 21 s"),
    "skills.*.idempotent": ("    idempotent: true\n", ""),
    "skills.*.actuators": ("    actuators: [gripper]\n", "    actuators: [gripper, arm]\n"),
    "skills.*.resources": ("    resources: [arm]\n", ""),
    "skills.*.gated": ("gated: [separation]", "gated: [separation, tracking]"),
    "state.*.max_age": ("range: [0, 9], max_age: 1 s", "range: [0, 9], max_age: 2 s"),
    "state.*.uncertainty": ("uncertainty: 1 mm", "uncertainty: 2 mm"),
    "state.*.sensor": (", sensor: load_cell}", ", sensor: panel}"),
    "state.*.definition": ("dirt <= 1 mm", "dirt <= 2 mm"),
    "state.*.public": (", public: true", ""),
    "perceivers.*.pictures.*.width": ("width: 320", "width: 321"),
    "perceivers.*.pictures.*.height": ("height: 240", "height: 241"),
    "perceivers.*.pictures.*.depth": (", depth: true", ""),
    "perceivers.*.readings": ("[cloth_held, stop_pressed]", "[cloth_held]"),
    "perceivers.*.rate": ("rate: 20 Hz", "rate: 30 Hz"),
    "perceivers.*.timeout": ("timeout: 200 ms", "timeout: 300 ms"),
    "perceivers.*.memory": ("memory: 256 MiB", "memory: 255 MiB"),
    "perceivers.*.processor": ("memory: 256 MiB", "memory: 256 MiB\n    processor: 30 %"),
}  # fmt: skip
"""A change of each field of a module that is compared by what it allows."""


def edited(path: Path, edit: tuple[str, ...]) -> None:
    """Replace each text by the one after it."""
    for before, after in zip(edit[::2], edit[1::2], strict=True):
        change(path, before, after)


def module_difference(old: Path, new: Path) -> PolicyDifference:
    return compare(old / "tidy", new / "tidy", old / "site.yaml")


@pytest.mark.parametrize(
    ("fields", "schema", "cases"), [(MODULE_FIELDS, Ecm, MODULE_CASES), (SITE_FIELDS, Site, SITE_CASES)]
)
def test_each_field_that_is_left_to_a_comparison_has_a_case_below(
    fields: tuple[str, ...], schema: type, cases: dict[str, tuple[str, ...]]
) -> None:
    assert sorted(fields) == sorted(cases)
    assert set(fields) <= set(schema_paths(schema))


@pytest.mark.parametrize(("field", "edit"), MODULE_CASES.items(), ids=MODULE_CASES)
def test_a_change_of_a_compared_field_of_a_module_is_reported(
    field: str, edit: tuple[str, ...], rich: tuple[Path, Path]
) -> None:
    old, new = rich
    assert changed(module_difference(old, new)) == {}
    edited(new / "tidy" / "ecm.yaml", edit)
    found = changed(module_difference(old, new))
    assert found
    assert all(not one.startswith(f"tidy/{field.partition('.*')[0]}.") for one in found)
    assert changed(module_difference(new, old))


@pytest.mark.parametrize(("field", "edit"), SITE_CASES.items(), ids=SITE_CASES)
def test_a_change_of_a_compared_field_of_a_site_is_reported(
    field: str, edit: tuple[str, ...], rich: tuple[Path, Path]
) -> None:
    old, new = rich
    assert changed(sites(old, new)) == {}
    edited(new / "site.yaml", edit)
    assert changed(sites(old, new)), field
    assert changed(sites(new, old)), field


@pytest.mark.parametrize(
    ("before", "after", "subject", "headline"),
    [
        ("version: 1.0.0\n", "version: 1.1.0\n", "version", "`version` was `1.0.0` and is `1.1.0`"),
        ("timeout: 20 s\n", "timeout: 20 s\n    outputs: {mass: {type: real, unit: kg, range: [0, 1]}}\n",
         "skills/pick_cloth/outputs/mass", "`skills.pick_cloth.outputs.mass` is new: `{type: real, unit: kg, range: [0, 1]}`"),
        ("retry: 1}\n    initial", "retry: 2}\n    initial", "tasks/clean_up/rules/2/retry", "`tasks.clean_up.rules.2.retry` was `1` and is `2`"),
        ("capabilities:\n", "needs:\n  surface: {is: volume, offers: work_area}\n\ncapabilities:\n", "", ""),
        ("wipes the bench, provided_by", "wipes the bench, version: 1.2.0, provided_by", "capabilities/tidying/version", "`capabilities.tidying.version` is new: `1.2.0`"),
        ("probability: 0.9}\n      missed", "probability: 0.90}\n      missed", "", ""),
    ],
)  # fmt: skip
def test_a_field_that_no_comparison_understands_is_reported_with_its_text(
    before: str, after: str, subject: str, headline: str, old: Path, new: Path
) -> None:
    if "needs" in after:
        for folder in (old, new):
            change(folder / "site.yaml", "  bench_top: {", "  bench_top: {offers: [work_area], ")
        subject, headline = "needs/surface", "`needs.surface` is new: `{is: volume, offers: work_area}`"
    change(new / "tidy" / "ecm.yaml", before, after)
    found = module_difference(old, new)
    assert changed(found) == ({f"tidy/{subject}": OTHER} if subject else {})
    if subject:
        (diagnostic,) = named(found, f"tidy/{subject}").diagnostics
        assert (diagnostic.code, diagnostic.headline) == ("AE954", headline)
        assert diagnostic.primary is not None
        assert diagnostic.primary.span.source.path == str(new / "tidy" / "ecm.yaml")


def test_a_part_that_is_new_as_a_whole_is_reported_once(rich: tuple[Path, Path]) -> None:
    old, new = rich
    text = (new / "site.yaml").read_text()
    quota = "    - {id: slow, on: [turn], at_most: 6, within: 60 s, rationale: the wrist is worn}\n"
    (new / "site.yaml").write_text(text.replace("  quotas:\n", f"  quotas:\n{quota}"))
    assert changed(sites(old, new)) == {"policy/quotas/slow": "newly denied"}
    assert changed(sites(new, old)) == {"policy/quotas/slow": "newly allowed"}


def test_an_override_under_another_name_is_reported(rich: tuple[Path, Path]) -> None:
    old, new = rich
    change(new / "site.yaml", "{id: worn, ", "{id: broken, ")
    assert changed(sites(old, new)) == {"policy/blocks/worn": OTHER, "policy/blocks/broken": OTHER}


def test_a_perceiver_that_gets_another_camera_gets_more(rich: tuple[Path, Path]) -> None:
    old, new = rich
    for folder in rich:
        change(folder / "site.yaml", "cameras: [top]", "cameras: [top, side]")
        change(
            folder / "site.yaml",
            "cameras: {top:",
            "cameras: {side: {sensor: camera, width: 640, height: 480}, top:",
        )
    change(new / "tidy" / "ecm.yaml", "pictures: {", "pictures: {side: {width: 64, height: 48}, ")
    found = module_difference(old, new)
    assert changed(found) == {"tidy/perceivers/watch/pictures/side": "newly allowed"}
    (diagnostic,) = named(found, "tidy/perceivers/watch/pictures/side").diagnostics
    assert diagnostic.headline == "`watch` gets pictures of `side`"
