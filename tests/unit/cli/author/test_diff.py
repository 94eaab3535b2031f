from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit

BASE = Path(__file__).parents[4] / "docs" / "codes" / "base"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a site, a module `tidy` and a copy of each."""
    shutil.copytree(BASE, tmp_path / "base")
    shutil.copytree(BASE / "tidy", tmp_path / "base" / "new")
    shutil.copy(BASE / "site.yaml", tmp_path / "base" / "new.yaml")
    monkeypatch.chdir(tmp_path / "base")
    return tmp_path / "base"


def change(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1
    path.write_text(text.replace(old, new), encoding="utf-8")


def diff(*arguments: str) -> int:
    return main(["diff", *arguments])


MODULES = ("tidy", "new", "--site", "site.yaml")


def test_modules_without_differences_are_reported_as_equal(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert diff(*MODULES, "--fail-on", "newly-allowed") == Exit.SUCCESS
    shown = capsys.readouterr().out.splitlines()
    assert len(shown) == 1
    assert shown[0].endswith("subjects are equal")


def test_a_change_in_both_directions_is_reported_with_both_lines_and_witnesses(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change(here / "new" / "ecm.yaml", "grip: force <= 10 N", "grip: 1 N <= force <= 12 N")
    assert diff(*MODULES) == Exit.SUCCESS
    shown = capsys.readouterr().out
    assert (
        "warning[AE951] newly-allowed: a `grip` of `pick_cloth` is newly allowed\n"
        "  --> new/ecm.yaml:19:13\n"
        "19 |       grip: 1 N <= force <= 12 N\n"
        "   |             ^^^^^^^^^^^^^^^^^^^^ new\n"
        "  ::: tidy/ecm.yaml:19:13\n"
        "19 |       grip: force <= 10 N\n"
        "   |             ------------- old\n"
        "note: for example, with\n"
    ) in shown
    assert "note[AE952] newly-denied: a `grip` of `pick_cloth` is newly denied\n" in shown
    assert "tidy/pick_cloth/grip  incomparable\n" in shown


def test_something_newly_allowed_fails_only_on_request(here: Path) -> None:
    change(here / "new" / "ecm.yaml", "grip: force <= 10 N", "grip: force <= 12 N")
    assert diff(*MODULES) == Exit.SUCCESS
    assert diff(*MODULES, "--fail-on", "newly-allowed") == Exit.REJECTED
    assert diff("new", "tidy", "--site", "site.yaml", "--fail-on", "newly-allowed") == Exit.SUCCESS


def test_json_holds_the_whole_witness(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change(here / "new" / "ecm.yaml", "grip: force <= 10 N", "grip: force <= 12 N")
    diff(*MODULES, "--format", "json")
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert found["schema"] == "aeros/difference/1"
    assert (found["newly_allowed"], found["undecided"], found["problems"]) == (True, False, [])
    (changed,) = [one for one in found["changes"] if one["relation"] != "equal"]
    assert changed["subject"] == "tidy/pick_cloth/grip"
    assert changed["diagnostics"][0]["code"] == "AE951"
    (lines,) = changed["witnesses"].values()
    assert {line.partition(" = ")[0] for line in lines} == {"human_distance", "stop_pressed", "force"}


def test_sites_are_compared(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change(here / "new.yaml", "require: force <= 30 N", "require: force <= 40 N")
    assert diff("site.yaml", "new.yaml", "--fail-on", "newly-allowed") == Exit.REJECTED
    shown = capsys.readouterr().out
    assert "newly-allowed: a `grip` is newly allowed" in shown
    assert "actions/grip  newly allowed\n" in shown


def test_folders_are_paired_by_module(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("before", "after"):
        (here / name).mkdir()
        shutil.copytree(here / "tidy", here / name / "tidy")
    shutil.copytree(here / "tidy", here / "after" / "sorting")
    change(here / "after" / "sorting" / "ecm.yaml", "id: tidy\n", "id: sorting\n")
    assert diff("before", "after", "--site", "site.yaml") == Exit.SUCCESS
    changed = [line for line in capsys.readouterr().out.splitlines() if line.endswith("  newly allowed")]
    assert [line.split()[0] for line in changed] == [
        "sorting/pick_cloth/grip",
        "sorting/wipe/move",
        "sorting/wipe/wait",
        "sorting/rest/wait",
    ]


def test_a_side_that_cannot_be_read_is_reported_and_nothing_compared(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change(here / "new" / "ecm.yaml", "grip: force <= 10 N", "grip: forse <= 10 N")
    assert diff(*MODULES, "--format", "json") == Exit.REJECTED
    found = json.loads(capsys.readouterr().out)
    assert [problem["code"] for problem in found["problems"]] == ["AE202"]
    assert found["changes"] == []
    assert diff(*MODULES) == Exit.REJECTED
    assert "did you mean `force`?" in capsys.readouterr().out


def test_sets_that_cannot_be_compared_are_undecided(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change(here / "new" / "ecm.yaml", "      pause: {", "      nap: {")
    change(here / "new" / "ecm.yaml", "inputs.pause", "inputs.nap")
    assert diff(*MODULES) == Exit.UNDECIDED
    assert (
        "cannot compare a `wait` of `rest`: only the old side has `inputs.pause`" in capsys.readouterr().out
    )


def test_a_budget_that_runs_out_is_undecided(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change(here / "new" / "ecm.yaml", "grip: force <= 10 N", "grip: force * force <= 101 N*N")
    assert diff(*MODULES, "--rlimit", "1") == Exit.UNDECIDED
    assert "undecided: the solver could not compare a `grip` of `pick_cloth`" in capsys.readouterr().out


@pytest.mark.parametrize(
    "arguments",
    [
        ("tidy", "site.yaml"),
        ("site.yaml", "new.yaml", "--site", "site.yaml"),
        ("site.yaml", "new.yaml", "--bind", "tidy.surface=bench"),
    ],
)
def test_a_site_is_compared_with_a_site_only(here: Path, arguments: tuple[str, ...]) -> None:
    assert diff(*arguments) == Exit.USAGE


def test_modules_with_open_needs_are_compared_as_they_are_bound(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (here / "tidy" / "ecm.yaml").read_text("utf-8")
    for folder, limit in (("tidy", "12 N"), ("new", "most")):
        parameters = "parameters:\n  most: {type: real, unit: N, range: [0, 20]}\n"
        changed = text.replace("capabilities:", f"{parameters}capabilities:", 1)
        changed = changed.replace("force <= 10 N", "force <= most").replace(
            "force <= 15 N", f"force <= {limit}"
        )
        (here / folder / "ecm.yaml").write_text(changed, "utf-8")
    assert diff(*MODULES) == Exit.REJECTED
    assert "the parameter `most` of `tidy` has no value" in capsys.readouterr().out
    assert diff(*MODULES, "--set", "tidi.most=15 N") == Exit.REJECTED
    assert "settings are given for `tidi`" in capsys.readouterr().out
    assert diff(*MODULES, "--set", "tidy.most=12 N", "--fail-on", "newly-allowed") == Exit.SUCCESS
    assert diff(*MODULES, "--set", "tidy.most=16 N", "--fail-on", "newly-allowed") == Exit.REJECTED
