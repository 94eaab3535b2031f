"""Options that a project gives: where they are found, what they mean, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.cli.parsers import parse
from aeros.cli.project_settings import find_settings
from aeros.exit_codes import Exit, UsageError
from tests.repo.tree import ROOT


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder in which the program is started, the root of a repository."""
    (tmp_path / ".git").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_nearest_file_counts_up_to_the_root_of_the_repository(project: Path) -> None:
    deep = project / "a" / "b"
    deep.mkdir(parents=True)
    (project.parent / "aeros.toml").write_text('state = "outside"')
    assert find_settings(deep).path is None
    (project / "aeros.toml").write_text('state = "robot"')
    found = find_settings(deep)
    assert (found.path, found.options) == (project / "aeros.toml", {"state": Path("robot")})
    (project / "a" / "pyproject.toml").write_text('[project]\nname = "x"')
    assert find_settings(deep).path == project / "aeros.toml"
    (project / "a" / "pyproject.toml").write_text('[tool.aeros]\nplant = "symbolic"')
    assert find_settings(deep).options == {"plant": "symbolic", "state": Path("a/.aeros")}
    (project.parent / "aeros.toml").unlink()


def test_settings_are_the_defaults_of_options_and_those_given_take_their_place(project: Path) -> None:
    (project / "modules").mkdir()
    (project / "cell.yaml").touch()
    (project / "aeros.toml").write_text(
        'site = "cell.yaml"\necms = "modules"\nstate = "robot"\nplant = "symbolic"\n'
    )
    run = parse(["run", "make tea"])
    assert (run.site, run.ecms) == (Path("cell.yaml"), [Path("modules")])
    assert (run.state, run.plant) == (Path("robot"), "symbolic")
    given = parse(["run", "make tea", "--state", "mine", "--plant", "kinematic", "--ecms", "modules"])
    assert (given.state, given.plant, given.ecms) == (Path("mine"), "kinematic", [Path("modules")])
    assert parse(["verify"]).paths == [Path("modules")]
    assert parse(["verify", "cell.yaml"]).paths == [Path("cell.yaml")]
    replay = parse(["audit", "replay", "cell.yaml"])
    assert (replay.site, replay.state) == (None, Path("robot"))  # the run may be another project's
    assert parse(["verify"]).from_settings == {"site"}
    assert parse(["verify", "--site", "cell.yaml"]).from_settings == frozenset()


def test_an_unknown_setting_is_refused_at_its_line_by_commands_that_have_options_of_it(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (project / "aeros.toml").write_text('# options\nsites = "cell.yaml"\n')
    assert main(["verify", "."]) == Exit.USAGE
    path = project / "aeros.toml"
    assert (
        capsys.readouterr().err == f"aeros: `{path}`, line 2: `sites` is no setting; did you mean `site`?\n"
    )
    assert main(["explain", "AE501"]) == Exit.SUCCESS


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("site = 3", "line 1: `site` is 3; expected text"),
        ('site = "absent.yaml"', "absent.yaml` does not exist"),
        ("ecms = []", "expected at least one path"),
        ('ecms = ["absent"]', "absent` does not exist"),
        ("state = ''", "expected text"),
        ('state = "a\\u0000b"', "expected text on one line"),
        ("xyzzy = 1", "`xyzzy` is no setting; settings are `site`, `ecms`, `state`, `plant`"),
        ("site = ", "is not TOML: "),
    ],
)
def test_a_setting_that_cannot_be_used_is_named_with_its_cause(project: Path, text: str, reason: str) -> None:
    (project / "aeros.toml").write_text(text)
    with pytest.raises(UsageError, match=r"aeros\.toml") as refused:
        find_settings(project)
    assert reason in str(refused.value)


def test_a_file_that_is_no_text_or_no_table_is_refused(project: Path) -> None:
    (project / "aeros.toml").write_bytes(b"\xff")
    with pytest.raises(UsageError, match="is not UTF-8"):
        find_settings(project)
    (project / "aeros.toml").unlink()
    (project / "pyproject.toml").write_text("[tool]\naeros = 3")
    with pytest.raises(UsageError, match=r"write `\[tool.aeros\]`"):
        find_settings(project)


def test_without_modules_verify_says_how_to_name_them(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["verify"]) == Exit.USAGE
    assert "set `ecms` in aeros.toml" in capsys.readouterr().err
    assert find_settings(ROOT).path is None
