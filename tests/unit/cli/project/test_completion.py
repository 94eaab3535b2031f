"""The script of `aeros completion` completes commands, options, choices and paths in a real shell."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from aeros.cli.commands import COMMANDS
from aeros.cli.main import main

_COMPLETE = """
source "$1"
shift
COMP_WORDS=("$@")
COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
_shtab_aeros
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture(scope="module")
def script(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("completion") / "aeros.bash"
    with pytest.MonkeyPatch.context() as patch, path.open("w") as file:
        patch.setattr("sys.stdout", file)
        assert main(["completion", "bash"]) == 0
    return path


@pytest.mark.parametrize(
    ("words", "completed"),
    [
        (("aeros", ""), list(COMMANDS)),
        (("aeros", "veri"), ["verify"]),
        (("aeros", "verify", "--form"), ["--format"]),
        (("aeros", "verify", "--format", ""), ["text", "json", "sarif", "junit", "github"]),
        (("aeros", "audit", "re"), ["replay"]),
        (("aeros", "new", "pro"), ["project"]),
        (("aeros", "verify", "mod"), ["modules"]),
    ],
)
def test_bash_completes(words: tuple[str, ...], completed: list[str], script: Path, tmp_path: Path) -> None:
    (tmp_path / "modules").mkdir()
    command = ["bash", "-c", _COMPLETE, "bash", str(script), *words]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60, cwd=tmp_path)
    assert done.stdout.split() == completed


@pytest.mark.parametrize("shell", ["zsh", "tcsh"])
def test_scripts_of_other_shells_name_every_command(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", shell]) == 0
    text = capsys.readouterr().out
    assert all(name in text for name in COMMANDS)
