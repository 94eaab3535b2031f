from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Timer
from uuid import UUID

import pytest

from aeros.agent.errors import AgentError
from aeros.agent.identity import Identity, acquire_identity, earlier_sessions, lock_folder

HOLD = """
import sys, time
from pathlib import Path
from aeros.agent.identity import acquire_identity
with acquire_identity(Path(sys.argv[1]), "other"):
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
    with acquire_identity(folder, "chef") as identity:
        return identity


def test_the_identity_persists_and_counts_its_sessions(tmp_path: Path) -> None:
    first = wake(tmp_path / "state")
    with acquire_identity(tmp_path / "state", "another name") as second:
        assert (second.id, second.name, second.created) == (first.id, "chef", first.created)
    assert isinstance(first.id, UUID)
    assert (first.sessions, second.sessions) == (1, 2)
    assert earlier_sessions(tmp_path / "state") == 2
    assert earlier_sessions(tmp_path / "another") == 0


def test_a_second_agent_in_another_process_is_refused_with_who_holds_it(tmp_path: Path) -> None:
    with another_agent(tmp_path) as other:
        with pytest.raises(AgentError, match=f"pid {other.pid} on .+, since 20") as refused:
            wake(tmp_path)
        assert "has an agent already" in refused.value.reason
    kept = json.loads((tmp_path / "identity.json").read_text())
    assert kept["sessions"] == 1


def test_a_second_agent_in_the_same_process_is_refused(tmp_path: Path) -> None:
    with acquire_identity(tmp_path, "chef"), pytest.raises(AgentError, match=f"pid {os.getpid()} "):
        wake(tmp_path)
    assert wake(tmp_path).sessions == 2


def test_kill_9_releases_the_lock(tmp_path: Path) -> None:
    with another_agent(tmp_path) as other:
        other.send_signal(signal.SIGKILL)
        other.wait()
        identity = wake(tmp_path)
    assert (identity.name, identity.sessions) == ("other", 2)


def test_a_failure_while_awake_releases_the_lock(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), acquire_identity(tmp_path, "chef"):
        raise KeyboardInterrupt
    assert wake(tmp_path).sessions == 2


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '{"id": "x", "name": "n", "created": "c", "sessions": 1}', "\x00"]
)
def test_a_damaged_identity_is_refused_and_not_replaced(tmp_path: Path, text: str) -> None:
    (tmp_path / "identity.json").write_text(text)
    with pytest.raises(AgentError, match="damaged"):
        wake(tmp_path)
    assert (tmp_path / "identity.json").read_text() == text


def test_a_state_folder_that_is_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("")
    with pytest.raises(AgentError, match="cannot be used"):
        wake(tmp_path / "state")


def test_a_lock_that_is_a_symbolic_link_is_refused(tmp_path: Path) -> None:
    (tmp_path / "agent.lock").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(AgentError, match="cannot be used"):
        wake(tmp_path)


def test_a_holder_that_has_not_written_its_name_still_holds_the_lock(tmp_path: Path) -> None:
    with acquire_identity(tmp_path, "chef"):
        (tmp_path / "agent.lock").write_text("")
        with pytest.raises(AgentError, match="has not identified itself yet"):
            wake(tmp_path)


RACE = """
import sys, time
from pathlib import Path
from aeros.agent.errors import AgentError
from aeros.agent.identity import acquire_identity
print("ready", flush=True)
sys.stdin.readline()
try:
    with acquire_identity(Path(sys.argv[1]), "one of many", "task " + sys.argv[2]) as identity:
        print("awake", identity.id, identity.sessions, flush=True)
        sys.stdin.readline()
except AgentError as refusal:
    print("refused", refusal, flush=True)
"""


def test_of_many_that_wake_at_once_one_does_and_each_other_learns_which(tmp_path: Path) -> None:
    agents = [
        subprocess.Popen(
            [sys.executable, "-c", RACE, str(tmp_path), str(number)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for number in range(12)
    ]
    try:
        for agent in agents:
            assert agent.stdout is not None
            assert agent.stdout.readline() == "ready\n"
        for agent in agents:
            assert agent.stdin is not None
            agent.stdin.write("now\n")
            agent.stdin.flush()
        message = [agent.stdout.readline() for agent in agents if agent.stdout is not None]
        (winner,) = [number for number, line in enumerate(message) if line.startswith("awake")]
        who = f"pid {agents[winner].pid} on "
        purpose = f"for “task {winner}”"
        others = [line for number, line in enumerate(message) if number != winner]
        assert all(line.startswith("refused this robot has an agent already") for line in others)
        # An agent that asks before the winner has written its name learns only that there is one.
        assert all(
            (who in line and purpose in line) or "has not identified itself yet" in line for line in others
        )
    finally:
        for agent in agents:
            agent.kill()
            agent.communicate()
    identity = wake(tmp_path)
    assert identity.sessions == 2
    assert identity.crashed_holder is not None
    assert who in identity.crashed_holder
    assert wake(tmp_path).crashed_holder is None


def test_a_patient_run_waits_for_the_folder(tmp_path: Path) -> None:
    with another_agent(tmp_path) as other:
        ending = Timer(0.3, other.kill)
        ending.start()
        with lock_folder(tmp_path, timeout_s=20.0) as abandoned:
            assert abandoned is not None
        ending.join()
