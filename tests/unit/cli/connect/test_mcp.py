"""`aeros mcp` says what it lacks."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit


def test_without_the_sdk_it_says_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("aeros.cli.connect.mcp.find_spec", lambda _: None)
    assert main(["mcp", "make dumplings", "--state", str(tmp_path / "state")]) == Exit.USAGE
    assert "pip install '.[mcp]'" in capsys.readouterr().err
    assert not (tmp_path / "state").exists()
