"""`aeros mcp` says what it lacks, before it opens a robot."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.repo.tree import ROOT

has_sdk = pytest.mark.skipif(find_spec("mcp") is None, reason="the extra `mcp` is not installed")


def test_without_the_sdk_it_says_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("aeros.cli.connect.mcp.find_spec", lambda _: None)
    assert main(["mcp", "make dumplings", "--state", str(tmp_path / "state")]) == Exit.USAGE
    assert "pip install '.[mcp]'" in capsys.readouterr().err
    assert not (tmp_path / "state").exists()


@has_sdk
@pytest.mark.parametrize(
    ("options", "why"),
    [
        (["--token-file", "token"], "--token-file is for clients over HTTP"),
        (["--http", "0.0.0.0:80"], "--http: give one address of this host"),
        (["--http", "robot"], "--http: expected PORT or HOST:PORT"),
    ],
)
def test_options_that_cannot_be_are_refused(
    options: list[str], why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["mcp", "--state", str(tmp_path / "state"), *options]) == Exit.USAGE
    assert why in capsys.readouterr().err
    assert not (tmp_path / "state").exists()


@has_sdk
@pytest.mark.parametrize("kind", ["device", "file"])
def test_standard_input_without_a_client_is_refused(kind: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("{}\n")
    with (Path(os.devnull) if kind == "device" else tmp_path / "file").open() as nobody:
        ended = subprocess.run(
            [sys.executable, "-m", "aeros.cli.main", "mcp", "--state", str(tmp_path / "state")],
            stdin=nobody, capture_output=True, text=True, cwd=ROOT, timeout=60, check=False,
        )  # fmt: skip
    assert (ended.returncode, ended.stdout) == (Exit.USAGE, "")
    assert "a client starts `aeros mcp` and talks to it through a pipe" in ended.stderr
    assert "Traceback" not in ended.stderr
    assert not (tmp_path / "state").exists()
