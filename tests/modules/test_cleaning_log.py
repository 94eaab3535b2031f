"""`cleaning_log` cleans a table and enters what was measured into a log, by a program of the site."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit

SERVICES = Path(__file__).parents[2] / "services"
ENTRY = {"wiped": True, "organized": True}


def robot(folder: Path) -> list[str]:
    """Set up a robot whose site has the log, with both modules active; return its options."""
    (folder / "log").mkdir()
    text = (SERVICES / "cleaning_log.yaml").read_text()
    overlay = folder / "site.yaml"
    overlay.write_text(text.replace("/var/lib/aeros-cleaning-log", str(folder / "log")))
    state = ["--state", str(folder / "robot")]
    modules = (SERVICES.parent / "ecms" / "clean_table", SERVICES / "cleaning_log")
    for command in (
        ["policy", str(overlay)],
        *(["install", str(module)] for module in modules),
        *(["configure", module.name] for module in modules),
        *(["activate", module.name] for module in modules),
    ):
        assert main([*command, *state]) == Exit.SUCCESS
    return state


def entries(folder: Path) -> list[dict[str, bool]]:
    return [json.loads(line) for line in (folder / "log" / "log.jsonl").read_text().splitlines()]


def run(state: list[str], out: Path, plant: str = "symbolic") -> int:
    return main(["run", "make a log entry for the table", "--plant", plant, "--out", str(out), *state])


def test_each_cleaned_table_is_entered_as_it_was_measured(tmp_path: Path) -> None:
    state = robot(tmp_path)
    assert run(state, tmp_path / "first") == Exit.SUCCESS
    assert entries(tmp_path) == [ENTRY]
    assert run(state, tmp_path / "second") == Exit.SUCCESS
    assert entries(tmp_path) == [ENTRY, ENTRY]


@pytest.mark.deep  # the symbolic plant believes outcomes, so a plant that measures is needed
def test_without_an_answer_of_the_log_the_goal_is_not_reached(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    state = robot(tmp_path)
    shutil.rmtree(tmp_path / "log")
    assert run(state, tmp_path / "run", plant="kinematic") == Exit.REJECTED
    assert "`cleaning_log_entries` is not measured" in capsys.readouterr().out


def test_an_operator_switches_the_log_off_while_the_table_is_cleaned(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    state = robot(tmp_path)
    block = ["block", "--id", "no-log", "--action", "enter_cleaning", "--reason", "the log is being moved"]
    assert main([*block, *state]) == Exit.SUCCESS
    assert run(state, tmp_path / "run") == Exit.REJECTED
    out = capsys.readouterr().out
    assert "AE710 no-log: the operator blocks it: the log is being moved" in out
    assert "step clean_table.wipe: outcome `wiped`" in out
    assert not (tmp_path / "log" / "log.jsonl").exists()


def test_a_site_without_a_log_refuses_the_module_and_names_the_lacking_tool(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    state = ["--state", str(tmp_path / "robot")]
    assert main(["install", str(SERVICES.parent / "ecms" / "clean_table"), *state]) == Exit.SUCCESS
    assert main(["install", str(SERVICES / "cleaning_log"), *state]) == Exit.REJECTED
    lacking = "needs `enter`, a tool with `wiped`, `organized`, and this site has none"
    assert lacking in capsys.readouterr().err
