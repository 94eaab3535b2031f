"""Folders as runs leave them: one that was run, and one written to say whatever a test wants."""

from __future__ import annotations

import atexit
import json
import lzma
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from aeros.cli.main import main
from aeros.runtime.audit.log import AuditLog
from tests.repo.tree import ROOT

SITE = "0" * 64


def run_symbolic(folder: Path, *arguments: str) -> Path:
    """A run with a re-plan, a retry and a recovery, in 143 s of the plant."""
    out = folder / "out"
    code = main(
        ["run", "make dumplings", "--plant", "symbolic", "--seed", "7", "--ecms", str(ROOT / "ecms"),
         "--state", str(folder / "state"), "--out", str(out), *arguments]
    )  # fmt: skip
    assert code == 0
    return out


def copied_run(folder: Path, *arguments: str) -> Path:
    """A copy of that run, which a process runs once; its state names the place where it was run."""
    for name in ("out", "state"):
        shutil.copytree(_run_once(arguments) / name, folder / name)
    return folder / "out"


@cache
def _run_once(arguments: tuple[str, ...]) -> Path:
    folder = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, folder)
    run_symbolic(folder, *arguments)
    return folder


def decision(time: float, verdict: str = "ALLOW", skill: str = "reach", **more: Any) -> dict[str, Any]:
    """The details of a decision."""
    action = {"kind": "move_tool", "parameters": {"speed": 0.2}}
    return {
        "verdict": verdict,
        "reasons": [],
        "decided": None if verdict == "DENY" else action,
        "configuration": "c",
        "time": time,
        "state": {},
        "module": "arm",
        "skill": skill,
        "asked": action,
        **more,
    }


def written_run(
    folder: Path, records: Sequence[tuple[str, Mapping[str, Any]]], trace: Sequence[Mapping[str, Any]] = ()
) -> Path:
    """A folder with these records after the session's, and this trace."""
    folder.mkdir()
    session = {"configuration": "c", "site": {"id": "cell", "digest": SITE}, "modules": {}}
    with AuditLog(folder / "audit.jsonl", clock=lambda: 0.0) as log:
        for event, details in [("session-opened", session), *records]:
            log.append(event, details)
    (folder / "trace.jsonl").write_text("".join(json.dumps(line) + "\n" for line in trace))
    (folder / "measured.jsonl").write_text("")
    return folder


def old_run(folder: Path) -> Path:
    """The same run, recorded when events had the old names of `RENAMED_EVENTS` (commit 05243d5f, seed 7)."""
    data = Path(__file__).parents[1] / "data" / "run_with_old_events"
    folder.mkdir()
    (folder / "audit.jsonl").write_bytes(lzma.decompress((data / "audit.jsonl.xz").read_bytes()))
    (folder / "trace.jsonl").write_bytes((data / "trace.jsonl").read_bytes())
    (folder / "measured.jsonl").write_text("")
    return folder
