"""Faults that no case of the corpus shows as well: extremes, and what is *not* said beside a fault."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.render import render_text
from aeros.spec.elaborate.load import load_ecm, load_site

CORPUS = Path(__file__).parents[3] / "corpus"
TABLE = CORPUS / "site" / "table.yaml"


def said_of_site(tmp_path: Path, *edits: tuple[str, str]) -> list[str]:
    """The first line of each diagnostic of the table's site after `edits`."""
    path = tmp_path / "site.yaml"
    path.write_text(_edited(TABLE.read_text(), edits))
    sink = Diagnostics()
    found = load_site(path, sink)
    assert (found is None) == sink.has_errors
    return [render_text(one).splitlines()[0] for one in sink]


def said_of_module(
    tmp_path: Path, *edits: tuple[str, str], case: str = "waits_less_than_allowed"
) -> list[str]:
    """The first line of each diagnostic of a module that is accepted without `edits`."""
    folder = Path(shutil.copytree(CORPUS / "accepted" / case, tmp_path / "module"))
    manifest = folder / "ecm.yaml"
    manifest.write_text(_edited(manifest.read_text(), edits))
    site = load_site(TABLE, Diagnostics())
    assert site is not None
    sink = Diagnostics()
    found = load_ecm(folder, site, sink)
    assert (found is None) == sink.has_errors
    return [render_text(one).splitlines()[0] for one in sink]


def _edited(text: str, edits: tuple[tuple[str, str], ...]) -> str:
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def test_a_module_without_faults_gives_no_diagnostics(tmp_path: Path) -> None:
    assert said_of_site(tmp_path) == []
    assert said_of_module(tmp_path) == []


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
    said = said_of_site(tmp_path, (old, new))
    assert [line.partition("]")[0] for line in said] == [f"error[{code}"]


def test_a_limit_beyond_every_double_is_refused(tmp_path: Path) -> None:
    (said,) = said_of_site(tmp_path, ("skill_timeout: 60 s", "skill_timeout: 1e400 s"))
    assert said.startswith("error[AE129] beyond-limits: a time-out is longer than 0 s and at most 1 h")


@pytest.mark.parametrize("planning", ["0 s", "3601 s"])
def test_a_planner_has_some_time_and_no_more_than_an_hour(tmp_path: Path, planning: str) -> None:
    (said,) = said_of_site(tmp_path, ("replans: 5}", f"replans: 5, planning: {planning}}}"))
    assert said.startswith(
        "error[AE129] beyond-limits: the time for a plan is longer than 0 s and at most 1 h"
    )


@pytest.mark.parametrize("name", ["a" * 300, "/etc/hostname", "..", "../module/skills.py", ".", ""])
def test_a_file_of_a_tool_is_inside_the_module(tmp_path: Path, name: str) -> None:
    tool = f'\nmodels:\n  finder: {{description: finds dirt, kind: model, file: "{name}"}}\n\npermissions:'
    (said,) = said_of_module(tmp_path, ("\npermissions:", tool))
    assert said.startswith("error[AE131] missing-file: ")


def test_every_fault_of_a_module_is_reported_at_once(tmp_path: Path) -> None:
    said = said_of_module(
        tmp_path,
        ("version: 1.0.0", "version: one"),
        ("license: Apache-2.0", "license: none"),
        ("entry: skills:tidy", "entry: skills:tidy\n    precondition: table_tidied"),
        ("resources: [arm]", "resources: [leg]"),
        ("timeout: 30 s", "timeout: 30 m"),
        ('aeros: ">=0.1"', 'aeros: "0.1 or so"'),
    )
    assert sorted(line.partition("]")[0].partition("[")[2] for line in said) == [
        "AE122",
        "AE125",
        "AE125",
        "AE132",
        "AE202",
        "AE204",
    ]


def test_an_input_hides_no_variable_of_the_state(tmp_path: Path) -> None:
    # `load` is a state variable; the input is `inputs.load` and clashes with nothing.
    said = said_of_module(
        tmp_path,
        (
            "    outcomes:",
            "    inputs:\n      load: {type: real, unit: s, range: [0, 9], default: 1 s}\n    outcomes:",
        ),
        ("      wait: duration <= 10 s", "      wait: duration <= inputs.load"),
    )
    assert said == []


def test_a_rule_that_governs_no_action_kind_is_refused(tmp_path: Path) -> None:
    (said,) = said_of_site(tmp_path, ("on: [throw]", "on: []"))
    assert said == "error[AE112] wrong-length: the rule `soft-throw` governs no action kind"


def test_a_hold_condition_over_too_many_combinations_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("aeros.spec.elaborate.ecm.MAX_COMBINATIONS", 5)
    edit = ("dirt <= 50 % and not person_near", "fetched == sponge and not person_near")
    (said,) = said_of_module(tmp_path, edit, case="hold_at_the_edge")
    assert (
        said == "error[AE111] out-of-bounds: `hold` reads predicates with more than 5 combinations of values"
    )
    monkeypatch.setattr("aeros.spec.elaborate.ecm.MAX_COMBINATIONS", 6)
    assert said_of_module(tmp_path / "again", edit, case="hold_at_the_edge") == []
