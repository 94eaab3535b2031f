from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from uuid import UUID

import pytest

from aeros.agent.errors import RefusedError
from aeros.agent.identity import Identity, sole_identity

HOLD = """
import sys, time
from pathlib import Path
from aeros.agent.identity import sole_identity
with sole_identity(Path(sys.argv[1]), "other"):
    print("held", flush=True)
    time.sleep(60)
"""


@contextmanager
def another_agent(folder: Path) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(folder)], stdout=subprocess.PIPE, text=True
    ) as other:
        try:
            assert other.stdout is not None
            assert other.stdout.readline() == "held\n"
            yield other
        finally:
            other.kill()


def wake(folder: Path) -> Identity:
    with sole_identity(folder, "chef") as identity:
        return identity


def test_the_identity_persists_and_counts_its_sessions(tmp_path: Path) -> None:
    first = wake(tmp_path / "state")
    with sole_identity(tmp_path / "state", "another name") as second:
        assert (second.id, second.name, second.created) == (first.id, "chef", first.created)
    assert isinstance(first.id, UUID)
    assert (first.sessions, second.sessions) == (1, 2)


def test_a_second_agent_in_another_process_is_refused_with_who_holds_it(tmp_path: Path) -> None:
    with another_agent(tmp_path) as other:
        with pytest.raises(RefusedError, match=f"pid {other.pid} on .+, since 20") as refused:
            wake(tmp_path)
        assert "has an agent already" in refused.value.reason
    kept = json.loads((tmp_path / "identity.json").read_text())
    assert kept["sessions"] == 1


def test_a_second_agent_in_the_same_process_is_refused(tmp_path: Path) -> None:
    with sole_identity(tmp_path, "chef"), pytest.raises(RefusedError, match=f"pid {os.getpid()} "):
        wake(tmp_path)
    assert wake(tmp_path).sessions == 2


def test_kill_9_releases_the_lock(tmp_path: Path) -> None:
    with another_agent(tmp_path) as other:
        other.send_signal(signal.SIGKILL)
        other.wait()
        identity = wake(tmp_path)
    assert (identity.name, identity.sessions) == ("other", 2)


def test_a_failure_while_awake_releases_the_lock(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), sole_identity(tmp_path, "chef"):
        raise KeyboardInterrupt
    assert wake(tmp_path).sessions == 2


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '{"id": "x", "name": "n", "created": "c", "sessions": 1}', "\x00"]
)
def test_a_damaged_identity_is_refused_and_not_replaced(tmp_path: Path, text: str) -> None:
    (tmp_path / "identity.json").write_text(text)
    with pytest.raises(RefusedError, match="damaged"):
        wake(tmp_path)
    assert (tmp_path / "identity.json").read_text() == text


def test_a_state_folder_that_is_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("")
    with pytest.raises(RefusedError, match="cannot be used"):
        wake(tmp_path / "state")


def test_a_lock_that_is_a_symbolic_link_is_refused(tmp_path: Path) -> None:
    (tmp_path / "agent.lock").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(RefusedError, match="cannot be used"):
        wake(tmp_path)


def test_a_holder_that_has_not_said_who_it_is_still_holds(tmp_path: Path) -> None:
    with sole_identity(tmp_path, "chef"):
        (tmp_path / "agent.lock").write_text("")
        with pytest.raises(RefusedError, match="has not said yet who it is"):
            wake(tmp_path)
