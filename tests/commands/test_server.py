"""A served command has its own arguments, folder, environment, streams and exit code."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from tests.commands.server import commands_folder


def served(command: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    path = f"{commands_folder()}{os.pathsep}{os.environ['PATH']}"
    return subprocess.run(
        ["/bin/sh", "-c", command],
        cwd=folder,
        env={**os.environ, **environment, "PATH": path},
        input="given\n",
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.mark.parametrize(
    ("command", "code", "output", "error"),
    [
        ("aeros explain AE101 | head -n 1", 0, "AE101", ""),
        ("aeros run --resume --state empty", 1, "", "nothing to resume"),
        ("aeros unheard-of", 2, "", "no command"),
    ],
)
def test_aeros_ends_and_prints_as_in_a_process_of_its_own(
    command: str, code: int, output: str, error: str, tmp_path: Path
) -> None:
    ended = served(command, tmp_path)
    assert ended.returncode == code, ended
    assert output in ended.stdout
    assert error in ended.stdout + ended.stderr


def test_a_program_has_the_streams_folder_and_environment_of_its_caller(tmp_path: Path) -> None:
    (tmp_path / "beside.py").write_text("WORD = 'beside'")
    (tmp_path / "program.py").write_text(
        "import os, sys\n"
        "from beside import WORD\n"
        "if __name__ == '__main__':\n"
        "    print(sys.argv, WORD, os.getcwd(), os.environ['OF_THE_CALLER'], input())\n"
        "    print('error', file=sys.stderr)\n"
        "    sys.exit(7)\n"
    )
    ended = served("python program.py one", tmp_path, OF_THE_CALLER="yes")
    assert ended.stdout == f"['program.py', 'one'] beside {tmp_path} yes given\n"
    assert (ended.stderr, ended.returncode) == ("error\n", 7)


@pytest.mark.parametrize("act", ["os.abort()", "os.kill(os.getpid(), 9)", "1 / 0"])
def test_a_command_that_dies_has_failed_and_the_next_one_runs(act: str, tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(f"import os\n{act}\n")
    assert served("python program.py", tmp_path).returncode > 0
    assert served("python -c 'print(1 + 1)'", tmp_path).stdout == "2\n"
    assert served("aeros explain AE101", tmp_path).returncode == 0
