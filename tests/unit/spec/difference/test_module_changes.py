"""A change of a module is found, in its direction, by the actions that it lets a skill ask for."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from tests.unit.spec.difference.versions import change, changed, modules, named

MODULE_CHANGES = [
    # 1: newly allowed, and newly denied the other way round; -1: the reverse; 0: changed.
    ("force <= 10 N", "force <= 11 N", {"tidy/pick_cloth/grip": 1}),
    (
        "precondition: cloth_held\n",
        "precondition: cloth_held or bench_clean\n",
        {"tidy/wipe/precondition": 1},
    ),
    (
        "entry: skills:pick_cloth\n",
        "entry: skills:pick_cloth\n    hold: human_distance > 1 m\n",
        {"tidy/pick_cloth/hold": -1},
    ),
    (
        "range: [0, 20], default",
        "range: [0, 21], default",
        {"tidy/rest/wait": 1, "tidy/rest/precondition": 1, "tidy/skills/rest/inputs/pause/range": 0},
    ),
    ("timeout: 20 s", "timeout: 21 s", {"tidy/pick_cloth/timeout": 1}),
    ("timeout: 20 s", "timeout: 20 s\n    idempotent: true", {"tidy/pick_cloth/idempotent": 1}),
    ("timeout: 20 s", "timeout: 20 s\n    idempotent: false", {}),
    (
        "      wait: duration <= 5 s\n",
        "      wait: duration <= 5 s\n      turn: true\n",
        {"tidy/skills/wipe/envelope/turn": 0},
    ),
    (
        "sensors: [scanner, gripper, camera]",
        "sensors: [scanner, gripper, camera, panel]",
        {"tidy/sensors": 1},
    ),
    (
        "    wait: duration <= 20 s",
        "    wait: duration <= 4 s",
        {"tidy/wipe/wait": -1, "tidy/rest/wait": -1, "tidy/permissions/wait": -1},
    ),
    ("    wait: duration <= 20 s", "    wait: duration <= 21 s", {"tidy/permissions/wait": 1}),
    (
        "    wait: duration <= 20 s",
        "    wait: duration <= 20 s\n    turn: true",
        {"tidy/permissions/turn": 1},
    ),
    ("    grip: force <= 15 N\n", "", {"tidy/pick_cloth/grip": -1, "tidy/permissions/grip": -1}),
    (
        "  sensors: [scanner",
        "  worker: {memory: 64 MiB}\n  sensors: [scanner",
        {"tidy/worker/memory": -1},
    ),
    (
        "  sensors: [scanner",
        "  worker: {answer_within: 1 s}\n  sensors: [scanner",
        {"tidy/worker/answer_within": -1},
    ),
    ("    resources: [arm]\n", "", {"tidy/wipe/resources": -1}),
]


@pytest.mark.parametrize(("before", "after", "expected"), MODULE_CHANGES)
def test_a_change_of_a_module_is_found_in_its_direction(
    before: str, after: str, expected: dict[str, int], old: Path, new: Path
) -> None:
    change(new / "tidy" / "ecm.yaml", before, after)
    words = {1: "newly allowed", 0: "changed", -1: "newly denied"}
    assert changed(modules(old, new)) == {name: words[way] for name, way in expected.items()}
    assert changed(modules(new, old)) == {name: words[-way] for name, way in expected.items()}


def test_an_action_that_no_rule_allows_is_not_newly_allowed(old: Path, new: Path) -> None:
    for path, before in ((old, "40 N"), (new, "50 N")):
        change(path / "tidy" / "ecm.yaml", "grip: force <= 15 N", "grip: force <= 60 N")
        change(path / "tidy" / "ecm.yaml", "grip: force <= 10 N", f"grip: force <= {before}")
    assert changed(modules(old, new)) == {}


def test_a_new_skill_is_newly_allowed_for_all_its_inputs(old: Path, new: Path) -> None:
    manifest = old / "tidy" / "ecm.yaml"
    text = manifest.read_text()
    start, end = text.index("  rest:\n"), text.index("tasks:\n")
    text = text[:start] + text[end:]
    manifest.write_text(text.replace("        - {skill: rest}\n", ""))
    step = {"tidy/compositions/clean_once/do/seq/3": "changed"}
    assert changed(modules(old, new)) == {"tidy/rest/wait": "newly allowed", **step}
    assert changed(modules(new, old)) == {"tidy/rest/wait": "newly denied", **step}


def test_an_input_of_another_type_cannot_be_compared(old: Path, new: Path) -> None:
    change(new / "tidy" / "ecm.yaml", "pause: {type: real, unit: s, range: [0, 20], default: 2 s}",
           "pause: {type: real, unit: m, range: [0, 20], default: 2 m}")  # fmt: skip
    change(new / "tidy" / "ecm.yaml", "duration <= inputs.pause", "duration <= 5 s")
    assert changed(modules(old, new)) == {
        "tidy/rest/wait": "not comparable",
        "tidy/rest/precondition": "not comparable",
        "tidy/skills/rest/inputs/pause/unit": "changed",
        "tidy/skills/rest/inputs/pause/default": "changed",
    }
    assert modules(old, new).undecided


def test_both_lines_are_shown_and_the_witness_is_in_one_set_alone(old: Path, new: Path) -> None:
    change(new / "tidy" / "ecm.yaml", "force <= 10 N", "force <= 11 N")
    one = named(modules(old, new), "tidy/pick_cloth/grip")
    (diagnostic,) = one.diagnostics
    assert diagnostic.primary is not None
    assert (diagnostic.primary.span.text, diagnostic.secondary[0].span.text) == (
        "force <= 11 N",
        "force <= 10 N",
    )
    assert Fraction(10) < one.witnesses["newly allowed"].values["force"] <= Fraction(11)  # type: ignore[operator]
