"""Sites as a whole: diagnostics that are not reported in addition to a fault."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.spec.faults import messages_of_site


def test_a_site_without_faults_gives_no_diagnostics(tmp_path: Path) -> None:
    assert messages_of_site(tmp_path) == []


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("table_tidy: {type: bool,", "table_tidy: {type: boolean,", "AE122"),
        ("slow: {value: 100 mm/s,", "slow: {value: 100 furlong,", "AE201"),
        ("tabletop: {lower: [0 mm, -400 mm, 0 mm]", "tabletop: {lower: [0 mm, -400 mm, 0 s]", "AE204"),
        ("load: {type: real, unit: kg,", "load: {type: real, unit: kilo,", "AE207"),
        ("pressure: {type: real, unit: N, range: [0, 200]}", "pressure: {type: real, unit: N}", "AE208"),
        ("tools: [sponge, brush, knife]", "tools: [sponge, brush, brush]", "AE121"),
        ("sensor: panel, max_age: 100 ms", "sensor: panel, max_age: 0 ms", "AE208"),
    ],
)
def test_a_name_whose_declaration_is_at_fault_is_not_called_undeclared(
    tmp_path: Path, old: str, new: str, code: str
) -> None:
    message = messages_of_site(tmp_path, (old, new))
    assert [line.partition("]")[0] for line in message] == [f"error[{code}"]


def test_faults_of_policy_and_vocabulary_are_reported_together(tmp_path: Path) -> None:
    message = messages_of_site(
        tmp_path,
        ("unit: kg, range: [0, 5]", "unit: kilo, range: [0, 5]"),
        ("skill_timeout: 60 s", "skill_timeout: 0 s"),
    )
    assert [line.partition("]")[0] for line in message] == ["error[AE207", "error[AE129"]
