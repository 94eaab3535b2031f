"""File writes that survive a power cut, and locks on files."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path


def replace_durably(path: Path, content: bytes) -> None:
    """Replace the file at `path`; after a power cut it holds either the old content or the new.

    Only one process at a time may replace a file: the new content is first written to `path` with the suffix
    `.new`.

    Args:
        path: the file to replace or create.
        content: its new bytes.

    Raises:
        OSError: the file or its folder cannot be written.
    """
    replacement = path.with_name(path.name + ".new")
    write_durably(replacement, content)
    replacement.replace(path)
    sync_folder(path.parent)


def write_durably(path: Path, content: bytes) -> None:
    """Write a file and flush its bytes to the disk; its name is durable only after `sync_folder`.

    Args:
        path: the file to write; an existing one is overwritten in place.
        content: its bytes.

    Raises:
        OSError: the file cannot be written.
    """
    with path.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def sync_folder(folder: Path) -> None:
    """Flush a folder's list of file names to the disk.

    Args:
        folder: an existing folder.

    Raises:
        OSError: it cannot be opened or flushed.
    """
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def try_lock(descriptor: int) -> bool:
    """Take the exclusive lock of an open file, without waiting.

    Args:
        descriptor: the file descriptor of the open file.

    Returns:
        True if the lock was taken; False if another process holds it.

    Raises:
        OSError: the file cannot be locked at all.
    """
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
