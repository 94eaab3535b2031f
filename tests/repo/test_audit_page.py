"""docs/audit.md is carried out, command by command: every line it shows is printed, in this order.

Numbers apart, as the runs of two machines differ in their times.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from tests.repo.tree import ROOT, text_of

_BLOCK = re.compile(r"^```console\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_COMMAND = re.compile(r"^\$ (.+)\n((?:(?!\$ ).*\n)*)", re.MULTILINE)
_COMMANDS = [found for block in _BLOCK.findall(text_of("docs/audit.md")) for found in _COMMAND.findall(block)]


def _normal(text: str) -> list[str]:
    numberless = re.sub(r"-?\d+(\.\d+)?", "0", text)
    return [" ".join(line.split()) for line in numberless.splitlines() if line.strip()]


def test_the_page_does_what_it_says(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "ecms", tmp_path / "ecms")
    shutil.copy(ROOT / "aeros" / "sites" / "panda_cell.yaml", tmp_path / "site.yaml")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    assert len(_COMMANDS) > 10
    for command, shown in _COMMANDS:
        ran = subprocess.run(
            ["/bin/sh", "-c", command],
            cwd=tmp_path,
            env={**os.environ, "PATH": path},
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
        printed = iter(_normal(ran.stdout))
        missing = [line for line in _normal(shown) if line not in printed]
        assert not missing, f"$ {command}\n{ran.stdout}{ran.stderr}"
        refused = "NOT SOUND" in shown or "--ecms hasty" in command
        assert (ran.returncode == 0) != refused, f"$ {command}\n{ran.stdout}{ran.stderr}"
