"""Files of a newer AEROS in a state folder are refused by name, and never misread."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from uuid import uuid4

import pytest

from aeros.agent.errors import AgentError
from aeros.agent.identity import acquire_identity
from aeros.agent.recovery.lifecycle import Lifecycle
from aeros.agent.recovery.quarantine import Quarantine
from aeros.apps.watchdog.resumable_run import load_run_options
from aeros.cli.latest_run import latest_run
from aeros.exit_codes import UsageError
from aeros.experiments.trial_store import TrialStore
from aeros.spec.diagnostics.errors import UserError


def wake(state: Path) -> None:
    with acquire_identity(state, "chef"):
        pass


def ignore(*_: object) -> None:
    """Stand in for a record of changes of phase."""


def crash(state: Path) -> None:
    Quarantine(state).record_crash("why", 2.0, most=9, within=60.0)


def arguments(state: Path) -> argparse.Namespace:
    return argparse.Namespace(state=state)


IDENTITY = {"id": str(uuid4()), "name": "chef", "created": "2026", "sessions": 1}


@pytest.mark.parametrize(
    ("name", "schema", "content", "read"),
    [
        ("identity.json", "aeros/identity/2", IDENTITY, wake),
        ("phase.json", "aeros/phase/2", {"phase": "created"}, lambda state: Lifecycle(state, ignore)),
        ("crashes.json", "aeros/crashes/3", {"crashes": []}, crash),
        ("latest-run.json", "aeros/latest-run/2", {"out": "out", "pid": 1}, latest_run),
        ("run.json", "aeros/run/4", {"instruction": "it"}, lambda state: load_run_options(arguments(state))),
        ("trials.jsonl", "aeros/trial/2", {"condition": "", "seed": 1, "found": {}}, TrialStore),
    ],
)
def test_a_newer_format_is_refused_and_kept(
    tmp_path: Path, name: str, schema: str, content: dict[str, object], read: Callable[[Path], object]
) -> None:
    text = json.dumps({**content, "schema": schema}) + "\n"
    (tmp_path / name).write_text(text)
    with pytest.raises(
        (AgentError, UsageError, UserError), match=rf"{name}`.+`{schema}` was written by a newer"
    ):
        read(tmp_path)
    assert (tmp_path / name).read_text() == text


def test_a_newer_quarantine_is_one(tmp_path: Path) -> None:
    (tmp_path / "quarantine.json").write_text('{"schema": "aeros/quarantine/2"}')
    assert "written by a newer AEROS" in str(Quarantine(tmp_path).reason())


def test_crashes_of_version_1_count(tmp_path: Path) -> None:
    (tmp_path / "crashes.json").write_text('[[1.0, "why"]]')
    assert "crashed 2 times" in str(Quarantine(tmp_path).record_crash("why", 2.0, most=2, within=60.0))


def test_trials_without_a_schema_are_read(tmp_path: Path) -> None:
    (tmp_path / "trials.jsonl").write_text('{"condition":"a","found":{},"seed":1}\n')
    with TrialStore(tmp_path) as store:
        assert store.trials == {("a", 1): {}}
