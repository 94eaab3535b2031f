"""Notes which modules are really proved, and which only found."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from aeros.spec.verification import examine


def note_examined(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the modules that are examined from now on."""
    names: list[str] = []
    honest = examine.examine_module

    def noted(folder: Path, *rest: Any) -> Any:
        names.append(folder.name)
        return honest(folder, *rest)

    monkeypatch.setattr(examine, "examine_module", noted)
    return names
