"""A block reaches a run on every plant and however it was started; also a second process, and later runs."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from aeros.agent.errors import AgentError
from aeros.cli.main import main
from aeros.runtime.audit.log import AuditLog
from aeros.session.session import open_session
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT

_MODULE = "fetch_object"
_BLOCK = ("block", "--id", "one", "--reason", "why", "--module", _MODULE, "--state", "robot")
_PATIENCE = 60.0  # s
_STARTS = {
    "registry": (),
    "--ecms": ("--ecms", "ecms"),
    "--site": ("--site", str(reference_site_path())),
    "default folder": (),
}


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """State folder of a robot on which the module is active."""
    state = tmp_path_factory.mktemp("installed") / "robot"
    for command in (("install", str(ROOT / "ecms" / _MODULE)), ("configure", _MODULE), ("activate", _MODULE)):
        assert main([*command, "--state", str(state)]) == 0
    return state


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the module in `ecms`, from which commands are given."""
    shutil.copytree(ROOT / "ecms" / _MODULE, tmp_path / "ecms" / _MODULE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _run(plant: str, start: str, out: str = "out") -> int:
    options = ("--plant", plant, "--state", "robot", "--out", out)
    record = ("--no-film",) if plant == "physics" else ()
    return main(["run", "fetch the object", *options, *record, *_STARTS[start]])


def _decisions(out: str = "out") -> list[dict[str, Any]]:
    """Decisions on actions of the module, in order."""
    records = [json.loads(line) for line in Path(out, "audit.jsonl").read_text().splitlines()]
    return [one for one in records if one["event"] == "decision"]


def _verdicts(decisions: list[dict[str, Any]]) -> set[str]:
    return {one["details"]["verdict"] for one in decisions}


class Operator:
    """Blocks the module once three actions of the run were decided; slows the run until that has returned."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.code: int | None = None
        self.returned_at = 0
        self._decided = 0
        self._written = 0
        self._thread = threading.Thread(target=self._block)
        append = AuditLog.append

        def watched(log: AuditLog, event: str, details: Any) -> int:
            if log.path.parent.name == "out":
                self._look(event)
            written = append(log, event, details)
            if log.path.parent.name == "out":
                self._written = written
            return written

        monkeypatch.setattr(AuditLog, "append", watched)

    def _look(self, event: str) -> None:
        self._decided += event == "decision"
        if event == "decision" and self._decided == 3:
            self._thread.start()
        if self._decided >= 3 and self._thread.is_alive():
            time.sleep(0.05)

    def _block(self) -> None:
        self.code = main(list(_BLOCK))
        self.returned_at = self._written


@pytest.mark.parametrize(
    ("plant", "start"),
    [
        ("symbolic", "registry"),
        ("symbolic", "default folder"),
        ("kinematic", "--ecms"),
        # The ways to start a run are tested without a plant in session/whole/test_operator_reach.py.
        *(pytest.param("symbolic", start, marks=pytest.mark.deep) for start in ("--ecms", "--site")),
        *(
            pytest.param("kinematic", start, marks=pytest.mark.deep)
            for start in ("registry", "--site", "default folder")
        ),
        pytest.param("physics", "default folder", marks=pytest.mark.deep),
    ],
)
@pytest.mark.usefixtures("folder")
def test_no_action_is_allowed_after_a_block_has_returned(
    plant: str, start: str, installed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if start == "registry":
        shutil.copytree(installed, "robot")
    operator = Operator(monkeypatch)
    assert _run(plant, start) == 1
    assert operator.code == 0
    decisions = _decisions()
    assert _verdicts(decisions[:3]) == {"ALLOW"}
    assert _verdicts([one for one in decisions if one["sequence"] > operator.returned_at]) <= {"DENY"}
    # A run that starts later on the same state folder is bound as well.
    assert _run(plant, start, "later") == 1
    assert _verdicts(_decisions("later")) <= {"DENY"}


@pytest.mark.parametrize("options", [(), pytest.param(("--watchdog",), marks=pytest.mark.deep)])
@pytest.mark.usefixtures("folder")
def test_a_command_of_another_process_reaches_a_process_that_runs_the_default_folder(
    options: tuple[str, ...],
) -> None:
    command = (sys.executable, "-m", "aeros")
    options = ("--plant", "kinematic", "--state", "robot", "--out", "out", *options)
    with subprocess.Popen([*command, "run", "fetch the object", *options], stdout=subprocess.DEVNULL) as run:
        log = Path("out", "audit.jsonl")
        latest = time.monotonic() + _PATIENCE
        while not (log.exists() and b'"decision"' in log.read_bytes()) and time.monotonic() < latest:
            time.sleep(0.005)
        assert run.poll() is None
        subprocess.run([*command, *_BLOCK], check=True, stdout=subprocess.DEVNULL)
        written = log.read_bytes().count(b"\n")
        assert run.wait(_PATIENCE) == 1
    after = [one for one in _decisions() if one["sequence"] >= written]
    assert _verdicts(after) <= {"DENY"}


@pytest.mark.usefixtures("folder")
def test_a_block_reaches_a_session_of_a_program_now_and_later(monkeypatch: pytest.MonkeyPatch) -> None:
    operator = Operator(monkeypatch)
    for out in ("out", "later"):
        with open_session("ecms", state="robot", out=out) as session:
            assert not session.run("fetch the object").reached
        last = operator.returned_at if out == "out" else 0
        assert _verdicts([one for one in _decisions(out) if one["sequence"] > last]) <= {"DENY"}
    assert operator.code == 0
    # Without a state folder it is a robot of its own.
    with open_session("ecms") as session:
        assert session.run("fetch the object").reached


@pytest.mark.usefixtures("folder")
def test_the_server_of_mcp_clients_starts_no_withdrawn_module(
    installed: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("mcp")
    shutil.copytree(installed, "robot")
    assert main(["deactivate", _MODULE, "--state", "robot"]) == 0
    options = ["--ecms", "ecms", "--state", "robot", "--http", "127.0.0.1:0"]
    assert main(["mcp", "fetch the object", *options]) == 1
    assert f"`{_MODULE}` is no longer active on this robot" in capsys.readouterr().err


@pytest.mark.usefixtures("folder")
def test_a_session_of_a_program_warns_of_a_withdrawn_module(installed: Path) -> None:
    shutil.copytree(installed, "robot")
    shutil.copytree(ROOT / "ecms" / "clean_table", "ecms/clean_table")
    assert main(["deactivate", _MODULE, "--state", "robot"]) == 0
    with (
        pytest.warns(RuntimeWarning, match=f"`{_MODULE}` is no longer active on this robot"),
        open_session("ecms", state="robot") as session,
        pytest.raises(AgentError, match="no installed module provides"),
    ):
        session.run("fetch the object")


@pytest.mark.usefixtures("folder")
def test_a_withdrawn_module_of_a_folder_is_named_and_not_used(
    installed: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(installed, "robot")
    assert main(["deactivate", _MODULE, "--state", "robot"]) == 0
    assert _run("symbolic", "--ecms") == 1
    message = capsys.readouterr().err
    assert f"`{_MODULE}` is no longer active on this robot" in message
    shutil.copytree(ROOT / "ecms" / "clean_table", "ecms/clean_table")
    assert _run("symbolic", "--ecms") == 1
    message = capsys.readouterr().err
    assert f"warning: `{_MODULE}` is no longer active on this robot, so the run does not use it" in message
    assert f"`aeros activate {_MODULE}`" in message
