"""The README shows what the commands print: each is run, and numbers apart, compared.

In a block ```console a line `$ COMMAND` is followed by its standard output.

    AEROS_UPDATE_GOLDEN=1 pytest tests/repo     rewrites the outputs, and fails
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from tests.repo.pages.shown import COMMAND, CONSOLE, commands_of, numberless, run
from tests.repo.tree import ROOT, UPDATE, text_of

_README = text_of("README.md")
_PAGES = [*(ROOT / "docs").glob("*.md"), *(ROOT / "docs" / "how-to").glob("*.md")]
_MOST_LINES = 150
_WIDEST = 100  # columns, but of tables
_COMMANDS = commands_of(_README)


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the README's paths exist and may be written to."""
    folder = tmp_path_factory.mktemp("clone")
    shutil.copytree(ROOT / "ecms", folder / "ecms")
    shutil.copytree(ROOT / "tests" / "corpus", folder / "tests" / "corpus")
    shutil.copytree(ROOT / "docs" / "examples", folder / "docs" / "examples")
    return folder


if UPDATE:

    @pytest.mark.physics
    def test_the_outputs_are_rewritten(clone: Path) -> None:
        def with_outputs(block: re.Match[str]) -> str:
            found = COMMAND.findall(block[1])
            parts = [f"$ {command}\n{run(command, clone, _WIDEST).stdout}" for command, _ in found]
            return "```console\n" + "".join(parts) + "```"

        (ROOT / "README.md").write_text(CONSOLE.sub(with_outputs, _README), encoding="utf-8")
        pytest.fail("README.md was rewritten")

else:
    # One test: a command may read what the one before it wrote.
    @pytest.mark.physics
    def test_the_commands_print_what_the_readme_shows(clone: Path) -> None:
        for command, shown in _COMMANDS:
            ran = run(command, clone, _WIDEST)
            assert numberless(ran.stdout) == numberless(shown), f"$ {command}\n{ran.stderr}"


def test_the_readme_is_short_and_shows_five_commands() -> None:
    lines = _README.splitlines()
    assert len(lines) <= _MOST_LINES
    assert [line for line in lines if len(line) > _WIDEST and not line.startswith("|")] == []
    assert [command.split()[1] for command, _ in _COMMANDS] == ["verify", "verify", "test", "tasks", "run"]


def test_the_index_leads_to_every_page() -> None:
    index = text_of("docs/README.md")
    pages = [path.relative_to(ROOT / "docs").as_posix() for path in _PAGES if path.name != "README.md"]
    assert [page for page in pages if f"({page})" not in index] == []


@pytest.mark.parametrize(
    "name", sorted(set(re.findall(r"\baeros (verify|run|tasks|[a-z]+(?= --?[a-z]))", _README)))
)
def test_the_command_explains_itself_with_examples(name: str) -> None:
    ran = run(f"aeros {name} --help", ROOT)
    assert ran.returncode == 0
    assert "examples:" in ran.stdout
    assert "exit codes:" in ran.stdout


@pytest.mark.parametrize(
    "target", sorted(set(re.findall(r"`make ([a-z]+)`|^make ([a-z]+)", _README, re.MULTILINE)))
)
def test_the_target_exists_and_is_listed(target: tuple[str, str]) -> None:
    name = target[0] or target[1]
    assert re.search(rf"^{name}:.* ## ", text_of("Makefile"), re.MULTILINE)


def test_every_option_in_the_readme_exists() -> None:
    for name in ("verify", "run"):
        known = run(f"aeros {name} --help", ROOT).stdout
        for line in re.findall(rf"aeros {name} [^\n|`]*", _README):
            for option in re.findall(r"--[a-z-]+", line):
                assert option in known, f"aeros {name} {option}"
