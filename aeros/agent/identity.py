"""Who the agent is, across sessions, and that it is the only one: one state folder is one robot's.

Exactly one agent holds a state folder.  The lock is an open file description, so the kernel
releases it when the last process that holds it ends, by kill -9 too; a child that was forked
without `exec` shares it, and while such a child may still drive the robot no second agent starts.
The lock file is never deleted: a new file of that name would be a second lock.
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
from aeros.files import replace_durably, try_lock
from aeros.spec.migrations.format import FormatVersionError
from aeros.spec.migrations.formats import IDENTITY

_LOCK = "agent.lock"
_IDENTITY = "identity.json"
_POLL_INTERVAL_S = 0.02  # s, while waiting for whoever holds the folder
_MAX_HOLDER_BYTES = 64 * 1024


@dataclass(frozen=True, slots=True)
class Identity:
    """The agent that persists: given its name and id once, at birth.

    created: UTC, ISO 8601.
    sessions: how often it has been woken, this time included.
    abandoned: who held its folder last, where that ended without letting go: by kill -9, say.
    """

    id: UUID
    name: str
    created: str
    sessions: int
    crashed_holder: str | None = None


def new_identity(name: str) -> Identity:
    """A new agent, awake for the first time."""
    return Identity(uuid4(), name, _utc_now(), 1)


@contextmanager
def acquire_identity(folder: Path, name: str, purpose: str = "") -> Iterator[Identity]:
    """The identity kept in `folder`, awake and held by nobody else; born as `name` if there is none.

    purpose: as `lock_folder` has it.

    Raises `AgentError` where another agent holds the folder, or the identity cannot be read.
    """
    with lock_folder(folder, purpose) as abandoned:
        kept = _read(folder / _IDENTITY)
        identity = new_identity(name) if kept is None else replace(kept, sessions=kept.sessions + 1)
        identity = replace(identity, crashed_holder=abandoned)
        _write(folder / _IDENTITY, identity)
        yield identity


@contextmanager
def lock_folder(folder: Path, purpose: str = "", timeout_s: float = 0.0) -> Iterator[str | None]:
    """Nobody else holds `folder` meanwhile; who held it last, where that ended without letting go.

    purpose: what for, as whoever is refused is told.
    patience: seconds for whoever holds it to let go; raises `AgentError` where somebody still does.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
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
    """Keep agents out of `folder` meanwhile, and leave no trace in its lock; any folder will do.

    Raises:
        RefusedError: an agent holds the folder.
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
            raise AgentError(f"an agent is at work here: {_read_holder(descriptor)}")
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
        return "a process that has not said yet who it is"


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
    """Replace the file whole: after a power cut it holds the old identity or the new one."""
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
