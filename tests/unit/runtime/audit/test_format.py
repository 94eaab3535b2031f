from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.runtime.audit.format import explain_problem


def log_of(folder: Path, schema: str) -> Path:
    record = {"previous": hashlib.sha256(schema.encode()).hexdigest(), "sequence": 0}
    log = folder / "audit.jsonl"
    log.write_text(json.dumps(record) + "\n")
    return log


def test_a_log_of_a_newer_version_is_called_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = log_of(tmp_path, "aeros/audit/2")
    message = "`aeros/audit/2` was written by a newer AEROS, and this one reads `aeros/audit/1`"
    assert explain_problem(log, "why").startswith(message)
    assert main(["audit", "verify", str(log)]) == Exit.REJECTED
    assert f"NOT SOUND: {message}; install a newer AEROS\n" in capsys.readouterr().out


@pytest.mark.parametrize(("version", "is_known"), [(2, True), (999, True), (1000, False)])
def test_versions_below_a_thousand_are_recognised(tmp_path: Path, version: int, is_known: bool) -> None:
    log = log_of(tmp_path, f"aeros/audit/{version}")
    assert explain_problem(log, "why").startswith(f"`aeros/audit/{version}` was written") is is_known


def test_a_first_line_is_read_up_to_a_mebibyte(tmp_path: Path) -> None:
    log = log_of(tmp_path, "aeros/audit/2")
    text = log.read_text().rstrip()
    log.write_text(" " * ((1 << 20) - len(text)) + text)
    assert explain_problem(log, "why") != "why"
    log.write_text(" " * ((1 << 20) - len(text) + 1) + text)
    assert explain_problem(log, "why") == "why"


@pytest.mark.parametrize("content", [b"", b"[]\n", b"\xff", b"{}\n", b'{"previous": 3}\n'])
def test_other_errors_stay_reported(tmp_path: Path, content: bytes) -> None:
    log = log_of(tmp_path, "aeros/audit/1")
    assert explain_problem(log, "why") == "why"
    log.write_bytes(content)
    assert explain_problem(log, "why") == "why"
    assert explain_problem(tmp_path / "nowhere", "why") == "why"
