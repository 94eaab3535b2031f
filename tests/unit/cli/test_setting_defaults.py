"""Settings change the arguments that mean the same, and no broken file of them keeps a stop back."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from aeros.cli.commands import COMMANDS
from aeros.cli.main import main
from aeros.cli.parsers import command_parser, parse
from aeros.cli.project_settings import ProjectSettings
from aeros.cli.setting_defaults import set_defaults, settings_for
from aeros.exit_codes import Exit
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.registry.control_page import ControlPage

_ALL = 'site = "cell.yaml"\necms = "modules"\nstate = "robot"\nplant = "symbolic"\n'
_TAKEN = {
    **dict.fromkeys(("run", "mcp", "serve"), frozenset(("site", "ecms", "state", "plant"))),
    **dict.fromkeys(("tasks", "plan", "look"), frozenset(("site", "ecms", "state"))),
    **dict.fromkeys(("predict", "graph", "verify"), frozenset(("site", "ecms"))),
    **dict.fromkeys(("new", "decide", "diff", "export"), frozenset(("site",))),
}


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with settings in which the program is started."""
    for name in (".git", "modules"):
        (tmp_path / name).mkdir()
    (tmp_path / "cell.yaml").touch()
    (tmp_path / "aeros.toml").write_text(_ALL)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def positionals(parser: argparse.ArgumentParser) -> dict[str, object]:
    return {one.dest: one.default for one in parser._actions if not one.option_strings}


@pytest.mark.parametrize("name", list(COMMANDS))
def test_a_command_takes_the_settings_that_mean_the_same_for_it(name: str, project: Path) -> None:
    command = command_parser(name)
    taken = set(settings_for(name, [name], command).options)
    assert taken - {"state"} == _TAKEN.get(name, frozenset()) - {"state"}
    before = positionals(command)
    set_defaults(command, ProjectSettings(None, {"site": Path("cell.yaml"), "state": Path("robot")}))
    assert positionals(command) == before  # `aeros policy` shows the policy, and puts none in force


def test_a_run_that_goes_on_takes_only_the_state(project: Path) -> None:
    resumed = parse(["run", "--resume"])
    assert (resumed.site, resumed.ecms, resumed.state) == (None, None, Path("robot"))


def test_all_folders_of_a_project_have_one_robot(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (project / "aeros.toml").write_text('site = "cell.yaml"')
    monkeypatch.chdir(project / "modules")
    assert parse(["stop"]).state == Path("../.aeros")
    assert parse(["run", "make tea"]).state == Path("../.aeros")


@pytest.mark.parametrize("text", ['site = "gone.yaml"', "site = ", "sites = 3"])
def test_no_broken_file_keeps_a_stop_back(
    text: str, project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (project / "aeros.toml").write_text(text)
    with ControlPage(project / ".aeros" / "registry") as page:
        assert main(["stop"]) == Exit.SUCCESS
        assert page.command is OperatorCommand.STOP
    is_looked_at = not text.startswith('site = "')
    assert ("aeros: warning: " in capsys.readouterr().err) is is_looked_at
    assert main(["run", "make tea"]) == Exit.USAGE
