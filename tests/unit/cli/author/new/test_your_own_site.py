"""docs/how-to/your-own-site.md is carried out as it is written."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from tests.repo.pages.shown import carry_out, commands_of
from tests.repo.tree import text_of

_REFUSED = re.compile(r"error\[|warning\[AE951\]")
"""What a command shows that is to fail."""


def test_the_page_is_carried_out(tmp_path: Path) -> None:
    folder = tmp_path
    commands = commands_of(text_of("docs/how-to/your-own-site.md"))
    assert len(commands) == 14
    for command, shown in commands:
        if command == "cd cell":
            folder = folder / "cell"
        elif command.startswith("aeros"):
            carry_out(command, shown, folder, refused=_REFUSED.search(shown) is not None)
        else:
            subprocess.run(["/bin/sh", "-c", command], cwd=folder, check=True, timeout=60)
