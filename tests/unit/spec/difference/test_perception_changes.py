"""A change of perception is found, in its direction."""

# ruff: noqa: E501  a change stands in one line with what it leads to

from __future__ import annotations

import shutil
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

from aeros.spec.diagnostics.source import Source
from aeros.spec.difference.compare import compare
from aeros.spec.difference.perception_changes import vocabulary_changes
from aeros.spec.difference.policy_change import Relation
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.variables import Declared
from tests.unit.spec.difference.versions import changed
from tests.unit.spec.faults import CORPUS, TABLE

KETTLE = CORPUS / "accepted" / "measures_its_own_predicate"
MORE, LESS = Relation.NEWLY_ALLOWED.value, Relation.NEWLY_DENIED.value
BOTH, OTHER = Relation.INCOMPARABLE.value, Relation.CHANGED_OTHERWISE.value
OWN = "measures_its_own_predicate"


def quantity(name: str) -> Declared:
    return Declared(t.Variable(name, RealType(NUMBER), t.VariableRole.STATE), Source("a", "b").span(0, 1))


def differences(tmp_path: Path, old: Path, before: str, after: str) -> dict[str, str]:
    """Changes from a file or module to its edited copy."""
    new = tmp_path / old.name
    if old.is_dir():
        shutil.copytree(old, new, dirs_exist_ok=True)
    edited = new / "ecm.yaml" if old.is_dir() else new
    text = (old / "ecm.yaml" if old.is_dir() else old).read_text("utf-8")
    assert text.count(before) == 1
    edited.write_text(text.replace(before, after), "utf-8")
    return changed(compare(old, new, TABLE))


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        ("clean: {type: bool, max_age: 1 s}", "clean: {type: bool, max_age: 2 s}", {f"state/{OWN}.clean/max_age": MORE}),
        ("uncertainty: 1 mm", "uncertainty: 2 mm", {f"state/{OWN}.level/uncertainty": MORE}),
        ("clean: {type: bool, max_age: 1 s}", "clean: {type: bool, max_age: 1 s, public: true}", {f"state/{OWN}.clean/public": MORE}),
        ("width: 320", "width: 321", {f"{OWN}/perceivers/watch/pictures/overhead/size": MORE}),
        ("    readings: [hand]\n    rate: 20 Hz\n", "", {f"{OWN}/perceivers/watch/{one}": LESS for one in ("readings", "rate")}),
        ("rate: 20 Hz", "rate: 30 Hz", {f"{OWN}/perceivers/watch/rate": MORE}),
        ("timeout: 200 ms", "timeout: 300 ms", {f"{OWN}/perceivers/watch/timeout": MORE}),
        ("memory: 256 MiB", "memory: 128 MiB", {f"{OWN}/perceivers/watch/memory": LESS}),
    ],
)  # fmt: skip
def test_a_change_of_a_perceiver_is_found(
    tmp_path: Path, before: str, after: str, expected: dict[str, str]
) -> None:
    assert differences(tmp_path, KETTLE, before, after) == expected


@pytest.mark.parametrize(
    ("old", "new", "expected"), [(None, 1, LESS), (1, None, MORE), (1, 2, MORE), (2, 2, "equal")]
)
def test_a_variable_without_a_bound_may_be_uncertain_by_anything(
    old: int | None, new: int | None, expected: str
) -> None:
    sides = [
        replace(quantity("level"), uncertainty=None if one is None else Fraction(one)) for one in (old, new)
    ]
    found = vocabulary_changes({"level": sides[0]}, {"level": sides[1]})
    (change,) = [one for one in found if one.subject.endswith("uncertainty")]
    assert change.relation.value == expected


def test_a_change_of_a_variables_type_makes_conditions_over_it_incomparable(tmp_path: Path) -> None:
    found = differences(tmp_path, KETTLE, "range: [0, 100]", "range: [0, 200]")
    assert found == {f"{OWN}/tidy/approach": MORE, f"{OWN}/state/level/range": OTHER}


@pytest.mark.parametrize(
    ("after", "expected"),
    [
        ("dirt > 5 %", {"state/predicate_by_definition.table_dull/definition": OTHER}),
        ("dirt >= 0.05", {}),
    ],
)
def test_a_change_of_what_a_definition_means_is_found(
    tmp_path: Path, after: str, expected: dict[str, str]
) -> None:
    module = CORPUS / "accepted" / "predicate_by_definition"
    assert differences(tmp_path, module, "dirt >= 5 %", after) == expected


def test_new_variables_and_perceivers_are_reported(tmp_path: Path) -> None:
    text = (KETTLE / "ecm.yaml").read_text("utf-8")
    declared = text[text.index("\nperceivers:") : text.index("\ncapabilities:")]
    perceiver = declared.partition("perceivers:\n")[2]
    second = perceiver.replace("  watch:", "  again:").replace("[clean, level]", "[dry]")
    more = f"  dry: {{type: bool, max_age: 1 s}}\n{declared}{second}"
    found = differences(tmp_path, KETTLE, declared, more)
    assert found == {f"state/{OWN}.dry": OTHER, f"{OWN}/perceivers/again": OTHER}


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        ("overhead: {sensor: camera, width: 640", "overhead: {sensor: camera, width: 641", {"cameras/overhead/size": MORE}),
        ("  underneath: {sensor: floor_camera, width: 640, height: 480}\n", "", {"cameras/underneath": LESS}),
        ("sensor: floor_camera", "sensor: camera", {"cameras/underneath/sensor": OTHER}),
        ("      gauge.dial_green: {type: bool, max_age: 1 s}\n", "", {"state/gauge.dial_green": OTHER, "policy/perception/shared": LESS}),
        ("gauge.dial_green: {type: bool, ", "gauge.dial_green: {type: bool, in_invariants: true, ", {"policy/perception/in_invariants": MORE}),
        ("    timeout: 500 ms", "    timeout: 400 ms", {"policy/perception/timeout": LESS}),
        ("memory: 512 MiB", "memory: 1 GiB", {"policy/perception/memory": MORE}),
        ("memory: 512 MiB", "memory: 512 MiB\n    processor: 50 %", {"policy/perception/processor": LESS}),
    ],
)  # fmt: skip
def test_a_change_of_a_sites_perception_is_found(
    tmp_path: Path, before: str, after: str, expected: dict[str, str]
) -> None:
    assert differences(tmp_path, TABLE, before, after) == expected
