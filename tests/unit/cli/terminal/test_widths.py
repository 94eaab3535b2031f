"""Real runs of commands in a pseudo terminal: no line is wider than it, and nothing of rich's markup acts."""

from __future__ import annotations

import io
import json
import re
import shlex
from pathlib import Path
from unittest.mock import patch

import pytest
from rich.cells import cell_len

from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.unit.cli.terminal.pseudo_terminal import run_in_terminal

REPOSITORY = Path(__file__).parents[4]
CONTROL = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
COLOUR = re.compile(r"\x1b\[[0-9;]*m")

COMMANDS = {
    "author/diff.py": "diff {old} {ecms}/clean_table",
    "author/explain.py": "explain",
    "author/predict.py": "predict {ecms}/make_dumplings",
    "author/reports/text.py": "verify {ecms}/serve_table --no-lock -v --jobs 1",
    "module_settings.py": "configure clean_table --state {robot}",
    "author/plan.py": "plan clean_table.clean_table --ecms {ecms}",
    "project/doctor.py": "doctor",
    "project/experiment.py": "experiment list",
    "records/audit.py": "audit verify {out}",
    "robot/modules.py": "list --state {robot}",
    "robot/world.py": "world --state {state}",
    "run/tasks.py": "tasks -v --ecms {ecms}/clean_table",
    "run/decision_text.py": "decide --ecm {ecms}/clean_table --skill wipe --explain",
    "top/top.py": "top --run {out} --once",
}
"""A command for each module that draws a table."""

SLOW = {
    "author/look_report.py": "look {ecms}/clean_table",
    "project/prove.py": "prove --solver z3 quota_counts",
    "robot/check_plant.py": "check-plant tests.unit.cli.robot.checked_plants:GOOD",
}
"""The same, for those that take longer than a push has time for."""

OTHERS = (
    "explain AE501",
    "why {out}",
    "site",
    "policy --state {robot}",
    "memory show --state {state}",
    "memory search --state {state}",
    "audit show {out}",
    "verify {rejected} --no-lock",
    'run "bring me a beer from the fridge" --ecms {ecms}/clean_table --state {state}',
    "approve 12345678 --state {state}",
    "help run",
)
"""Commands whose output is wrapped text."""


@pytest.fixture(scope="module")
def paths(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """A finished run, whose output fitted, a robot with a module, and a module that is rejected."""
    folder = tmp_path_factory.mktemp("w")
    ecms = REPOSITORY / "ecms"
    command = "run 'clean the table' --ecms {ecms}/clean_table --plant symbolic --gate compiled"
    command += " --state {folder}/state --out {folder}/out"
    shown, wide = wide_lines(command, {"ecms": str(ecms), "folder": str(folder)}, 80)
    assert "goal reached" in shown
    assert wide == []
    assert main(["install", str(ecms / "clean_table"), "--state", f"{folder}/robot"]) == Exit.SUCCESS
    old = folder / "old" / "clean_table"
    old.mkdir(parents=True)
    for name in ("ecm.yaml", "skills.py"):
        text = (ecms / "clean_table" / name).read_text(encoding="utf-8")
        (old / name).write_text(text.replace("speed <= 205 mm/s", "speed <= 195 mm/s"), encoding="utf-8")
    rejected = REPOSITORY / "tests" / "corpus" / "rejected" / "safety" / "fast_near_a_person"
    return {
        "ecms": str(ecms),
        "old": str(old),
        "rejected": str(rejected),
        **{name: f"{folder}/{name}" for name in ("state", "out", "robot")},
    }


def wide_lines(command: str, paths: dict[str, str], columns: int) -> tuple[str, list[str]]:
    """Run a command in a terminal; return what it wrote, and the lines that do not fit.

    A word that is wider than the terminal, such as a path of a test, fits nowhere and stays whole.
    """
    words = [word.format(**paths) for word in shlex.split(command)]
    request = json.dumps({"kind": "grip", "parameters": {"force": 10.0, "width": 0.08}})
    with patch("sys.stdin", io.TextIOWrapper(io.BytesIO(f"{request}\n".encode()))):
        text = run_in_terminal(words, columns)
    shown = CONTROL.sub("", COLOUR.sub("", text).rpartition("\x1b[2K")[2])
    lines = shown.split("\n")
    return shown, [line for line in lines if cell_len(line) > columns and len(line.split()) > 1]


@pytest.mark.parametrize("command", [*COMMANDS.values(), *OTHERS])
def test_no_line_is_wider_than_the_terminal(command: str, paths: dict[str, str]) -> None:
    for columns in (80, 120):
        shown, wide = wide_lines(command, paths, columns)
        assert wide == []
        assert shown.strip()
        assert "this is a bug in aeros" not in shown
        assert not any(line != line.rstrip() for line in shown.split("\n")), "blanks at the end of a line"


@pytest.mark.deep
@pytest.mark.parametrize("command", SLOW.values())
def test_no_line_of_a_long_command_is_wider_than_the_terminal(command: str, paths: dict[str, str]) -> None:
    test_no_line_is_wider_than_the_terminal(command, paths)


def test_each_module_that_draws_a_table_has_a_command_here() -> None:
    folder = REPOSITORY / "aeros" / "cli"
    drawing = {
        str(path.relative_to(folder))
        for path in folder.rglob("*.py")
        if re.search(r"\b(?:print_table|table_lines)\(", path.read_text(encoding="utf-8"))
    }
    assert drawing - {"terminal/rendering.py"} == {*COMMANDS, *SLOW, "run/run_report.py"}


def test_json_is_whole_in_a_terminal(paths: dict[str, str]) -> None:
    text = run_in_terminal(["why", paths["out"], "--format", "json"], 80)
    assert max(map(len, text.split("\n"))) > 80
    assert json.loads(text)["headline"]


def test_markup_in_a_name_is_text(tmp_path: Path) -> None:
    shown = run_in_terminal(["explain", "[red]x[/] :smile:"], 80)
    assert "there is no code `[red]x[/] :smile:`" in shown


def test_json_is_printed_as_data_everywhere() -> None:
    folder = REPOSITORY / "aeros" / "cli"
    texts = {path: path.read_text(encoding="utf-8") for path in folder.rglob("*.py")}
    assert any("print_data(json.dumps(" in text for text in texts.values())
    assert [path.name for path, text in texts.items() if re.search(r"\bprint\(\s*json\.dumps", text)] == []
