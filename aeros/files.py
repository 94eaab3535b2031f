"""Files that survive a power cut, written through to the disk and replaced whole; and locks on files."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path


def replace_durably(path: Path, content: bytes) -> None:
    """Put `content` at `path`: after a power cut the file holds the old content or the new.

    One process at a time may replace a file.  Raises `OSError`.
    """
    beside = path.with_name(path.name + ".new")
    write_durably(beside, content)
    beside.replace(path)
    sync_folder(path.parent)


def write_durably(path: Path, content: bytes) -> None:
    """Write the bytes of a file through to the disk; its name is durable once its folder is synced."""
    with path.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def sync_folder(folder: Path) -> None:
    """Make durable which names `folder` holds."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def try_lock(descriptor: int) -> bool:
    """Take the exclusive lock of an open file, or return False where somebody else holds it.

    Raises `OSError` where the file cannot be locked at all.
    """
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
