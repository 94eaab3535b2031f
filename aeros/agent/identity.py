"""Identity of the agent across sessions, and the lock that makes it the only agent of its state folder.

Exactly one agent holds a state folder. The lock belongs to an open file description, so the kernel
releases it when the last process that holds it ends, even by kill -9. A child that was forked without
`exec` shares the lock: while such a child may still drive the robot, no second agent starts.
The lock file is never deleted, because a new file of that name would be a second lock.
"""

from __future__ import annotations

import json
import os
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from uuid import UUID, uuid4

from aeros.agent.errors import AgentError
from aeros.files import make_folder, replace_durably, try_lock
from aeros.spec.migrations.format import FormatVersionError
from aeros.spec.migrations.formats import IDENTITY

_LOCK = "agent.lock"
_IDENTITY = "identity.json"
_POLL_INTERVAL_S = 0.02  # s, while waiting for the holder of the folder
_MAX_HOLDER_BYTES = 64 * 1024


@dataclass(frozen=True, slots=True)
class Identity:
    """The identity of a persistent agent; its name and id are set once, when it is created.

    Attributes:
        id: unique id.
        name: name for people.
        created: time of creation, UTC, ISO 8601.
        sessions: number of sessions so far, this one included.
        crashed_holder: process that held the folder last, if it ended without releasing it (by kill -9, say).
    """

    id: UUID
    name: str
    created: str
    sessions: int
    crashed_holder: str | None = None


def new_identity(name: str) -> Identity:
    """Create the identity of a new agent in its first session.

    Args:
        name: name of the agent.

    Returns:
        An identity with a random id, created now.
    """
    return Identity(uuid4(), name, _utc_now(), 1)


def earlier_sessions(folder: Path) -> int:
    """Count the sessions of the agent whose identity is in a folder.

    Args:
        folder: state folder of the robot.

    Returns:
        The number of sessions that have begun; 0 without an identity.

    Raises:
        AgentError: the identity cannot be read.
    """
    kept = _read(folder / _IDENTITY)
    return 0 if kept is None else kept.sessions


@contextmanager
def acquire_identity(folder: Path, name: str, purpose: str = "") -> Iterator[Identity]:
    """Lock `folder` and yield the agent's identity kept there; create one if there is none.

    Args:
        folder: state folder of the robot.
        name: name for an identity that is created now.
        purpose: text shown to others who want the lock.

    Yields:
        The identity, with its session count increased and written.

    Raises:
        AgentError: another agent holds the folder, or the identity cannot be read or written.
    """
    with lock_folder(folder, purpose) as abandoned:
        kept = _read(folder / _IDENTITY)
        identity = new_identity(name) if kept is None else replace(kept, sessions=kept.sessions + 1)
        identity = replace(identity, crashed_holder=abandoned)
        _write(folder / _IDENTITY, identity)
        yield identity


@contextmanager
def lock_folder(folder: Path, purpose: str = "", timeout_s: float = 0.0) -> Iterator[str | None]:
    """Hold the lock of `folder` for this block.

    Args:
        folder: state folder; it is created if it does not exist.
        purpose: text shown to others who want the lock.
        timeout_s: wall time (s) to wait for the present holder.

    Yields:
        The previous holder if it ended without releasing the lock, else None.

    Raises:
        AgentError: another process still holds the lock after `timeout_s`, or the folder cannot be used.
    """
    try:
        make_folder(folder, 0o700)
        flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW
        descriptor = os.open(folder / _LOCK, flags, 0o600)
    except OSError as error:
        raise AgentError(f"the agent's state folder {folder} cannot be used: {error.strerror}") from error
    try:
        latest = time.monotonic() + timeout_s
        try:
            while not try_lock(descriptor):
                if time.monotonic() >= latest:
                    raise AgentError(f"this robot has an agent already: {_read_holder(descriptor)}")
                time.sleep(_POLL_INTERVAL_S)
        except OSError as error:
            raise AgentError(f"{folder / _LOCK} cannot be locked: {error.strerror}") from error
        abandoned = _read_holder(descriptor) if os.fstat(descriptor).st_size else None
        holder = {"pid": os.getpid(), "host": socket.gethostname(), "since": _utc_now(), "purpose": purpose}
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, json.dumps(holder).encode(), 0)
        yield abandoned
        os.ftruncate(descriptor, 0)
    finally:
        os.close(descriptor)


@contextmanager
def undisturbed(folder: Path) -> Iterator[None]:
    """Keep agents out of `folder` for this block, without a trace in its lock.

    Args:
        folder: any folder, whether an agent ever used it or not.

    Raises:
        AgentError: an agent holds the folder, or its lock cannot be taken.
    """
    try:
        descriptor = os.open(folder / _LOCK, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
    except FileNotFoundError:
        yield  # no agent ever held it
        return
    except OSError as error:
        raise AgentError(f"{folder / _LOCK} cannot be locked: {error.strerror}") from error
    try:
        if not try_lock(descriptor):
            raise AgentError(f"an agent is already running here: {_read_holder(descriptor)}")
        yield
    finally:
        os.close(descriptor)


def _read_holder(descriptor: int) -> str:
    try:
        holder = json.loads(os.pread(descriptor, _MAX_HOLDER_BYTES, 0))
        purpose = f", for “{holder['purpose']}”" if holder["purpose"] else ""
        return f"pid {holder['pid']} on {holder['host']}, since {holder['since']}{purpose}"
    except (ValueError, KeyError, TypeError):
        # Between taking the lock and saying who took it.
        return "a process that has not identified itself yet"


def _read(path: Path) -> Identity | None:
    try:
        text = path.read_text("utf-8")
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        raise AgentError(f"the agent's identity {path} cannot be read: {error}") from error
    try:
        kept = json.loads(text)
        IDENTITY.require_current(kept, path)
        identity = Identity(UUID(kept["id"]), str(kept["name"]), str(kept["created"]), int(kept["sessions"]))
    except FormatVersionError as error:
        raise AgentError(str(error)) from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        # A new identity here would cut the agent off from its memory without a word.
        raise AgentError(f"the agent's identity {path} is damaged; restore it from a backup") from error
    return identity


def _write(path: Path, identity: Identity) -> None:
    """Replace the file whole: after a power cut it holds the old identity or the new one.

    Raises:
        AgentError: the file cannot be written.
    """
    kept = {
        "schema": IDENTITY.schema,
        "id": str(identity.id),
        "name": identity.name,
        "created": identity.created,
        "sessions": identity.sessions,
    }
    try:
        replace_durably(path, json.dumps(kept, indent=2).encode())
    except OSError as error:
        raise AgentError(f"the agent's identity {path} cannot be written: {error.strerror}") from error


def _utc_now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
