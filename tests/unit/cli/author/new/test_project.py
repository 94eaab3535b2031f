"""Sites, checks in CI and whole projects from templates: what is created passes at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.spec.verification.certificate import LOCK


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder in which commands are started."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def hooks() -> list[dict[str, Any]]:
    """Return the pre-commit hooks that are configured here."""
    (repository,) = yaml.safe_load(Path(".pre-commit-config.yaml").read_text())["repos"]
    return list(repository["hooks"])


def test_a_new_project_is_proved_tested_and_run_at_once(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["new", "project", "bench"]) == Exit.SUCCESS
    assert capsys.readouterr().out.endswith(
        'next:\n  cd bench\n  aeros verify\n  aeros test bench_tests.yaml\n  aeros run "pick up the part"\n'
    )
    monkeypatch.chdir(here / "bench")
    assert Path("modules/pick", LOCK).exists()
    workflow = yaml.safe_load(Path(".github/workflows/aeros.yaml").read_text())
    commands = [step["run"] for step in workflow["jobs"]["verify"]["steps"] if "run" in step]
    assert commands[0].startswith("python -m pip install 'aeros-robot")
    assert commands[1] == "aeros fmt . --check"
    for command in commands[1:]:
        assert main(command.split()[1:]) == Exit.SUCCESS
    assert [(hook["id"], main([hook["id"].removeprefix("aeros-"), *hook["args"]])) for hook in hooks()] == [
        ("aeros-fmt", Exit.SUCCESS),
        ("aeros-verify", Exit.SUCCESS),
    ]
    assert "warning" not in capsys.readouterr().err
    assert main(["run", "pick up the part", "--out", "out"]) == Exit.SUCCESS
    assert "pick.pick: goal reached" in capsys.readouterr().out


def test_an_unsafe_change_of_a_new_project_is_rejected(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["new", "project", "bench"]) == Exit.SUCCESS
    monkeypatch.chdir(here / "bench")
    manifest = Path("modules/pick/ecm.yaml")
    manifest.write_text(manifest.read_text().replace("force <= 21 N", "force <= 210 N"))
    assert main(["verify", "--check"]) == Exit.REJECTED
    assert "soft-grip" in capsys.readouterr().out


def test_a_new_site_lists_what_it_declares(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "site", "cell"]) == Exit.SUCCESS
    capsys.readouterr()
    assert main(["site", "cell.yaml"]) == Exit.SUCCESS
    assert "person_distance" in capsys.readouterr().out


def test_checks_in_ci_are_of_the_modules_given(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for path in ("my modules", "cell.yaml", "tests.yaml"):
        (here / path).touch()
    options = ["--modules", "my modules", "--site", "cell.yaml", "--tests", "tests.yaml"]
    assert main(["new", "ci", *options]) == Exit.SUCCESS
    text = Path(".github/workflows/aeros.yaml").read_text()
    assert "- run: aeros verify 'my modules' --site cell.yaml --check --format github\n" in text
    assert "- run: aeros test tests.yaml\n" in text
    assert "- run: aeros fmt 'my modules' cell.yaml tests.yaml --check\n" in text
    assert [hook["args"] for hook in hooks()] == [
        ["my modules", "cell.yaml", "tests.yaml"],
        ["--check", "my modules", "--site", "cell.yaml"],
    ]


def test_checks_in_ci_without_options_are_of_this_folder_or_of_the_settings(here: Path) -> None:
    assert main(["new", "ci"]) == Exit.SUCCESS
    assert "aeros verify . --check" in Path(".github/workflows/aeros.yaml").read_text()
    (here / "inner").mkdir()
    (here / "inner" / "aeros.toml").write_text('ecms = "."')
    assert main(["new", "ci", "--parent", "inner"]) == Exit.SUCCESS
    assert "aeros verify --check" in Path("inner/.github/workflows/aeros.yaml").read_text()


def test_nothing_that_exists_is_overwritten_and_nothing_else_is_written(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / ".pre-commit-config.yaml").write_text("mine")
    assert main(["new", "ci"]) == Exit.REJECTED
    assert "`.pre-commit-config.yaml` exists already" in capsys.readouterr().err
    assert [path.name for path in here.iterdir()] == [".pre-commit-config.yaml"]
    for _ in range(2):
        code = main(["new", "site", "cell"])
    assert code == Exit.REJECTED


def test_a_folder_that_cannot_be_written_is_named(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(path: Path, content: bytes, *, is_private: bool) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("aeros.cli.author.new.project.replace_durably", full)
    assert main(["new", "site", "cell"]) == Exit.REJECTED
    assert "aeros: cannot write to `.`: No space left on device" in capsys.readouterr().err
