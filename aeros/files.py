"""Private files and folders, file writes that survive a power cut, and locks on files.

A run writes what a camera of the workplace would see, and what decides whether a robot may move. So the
files of a run and of an agent are for their owner alone, in folders for their owner alone.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, Final

PRIVATE_FILE: Final = 0o600
PRIVATE_FOLDER: Final = 0o700
_SHARED_FILE: Final = 0o666


@contextmanager
def private_umask() -> Iterator[None]:
    """Make every file that this process and its children create private, also those that libraries write.

    The umask is of the whole process: for commands, not for a library beside other threads.
    """
    before = os.umask(0o077)
    try:
        yield
    finally:
        os.umask(before)


def make_private_folder(folder: Path) -> None:
    """Create a folder for its owner alone; an existing one becomes private, if it is ours.

    Args:
        folder: the folder; its parents are created as usual.

    Raises:
        OSError: it cannot be created.
    """
    folder.mkdir(mode=PRIVATE_FOLDER, parents=True, exist_ok=True)
    with suppress(PermissionError):
        folder.chmod(PRIVATE_FOLDER)


def open_private(path: Path) -> BinaryIO:
    """Open a file to read and to append to, for its owner alone, also if it was there with another mode.

    Args:
        path: the file; created if it does not exist.

    Returns:
        The file, unbuffered.

    Raises:
        OSError: it cannot be opened.
    """
    flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC
    descriptor = os.open(path, flags, PRIVATE_FILE)
    with suppress(PermissionError):
        os.fchmod(descriptor, PRIVATE_FILE)
    return os.fdopen(descriptor, "a+b", buffering=0)


def replace_durably(path: Path, content: bytes, *, is_private: bool = True) -> None:
    """Replace the file at `path`; after a power cut it holds either the old content or the new.

    Only one process at a time may replace a file: the new content is first written to `path` with the suffix
    `.new`.

    Args:
        path: the file to replace or create.
        content: its new bytes.
        is_private: the file is for its owner alone; otherwise the umask decides.

    Raises:
        OSError: the file or its folder cannot be written.
    """
    replacement = path.with_name(path.name + ".new")
    write_durably(replacement, content, is_private=is_private)
    replacement.replace(path)
    sync_folder(path.parent)


def write_durably(path: Path, content: bytes, *, is_private: bool = False) -> None:
    """Write a file and flush its bytes to the disk; its name is durable only after `sync_folder`.

    Args:
        path: the file to write; an existing one is overwritten in place.
        content: its bytes.
        is_private: the file is for its owner alone; otherwise the umask decides.

    Raises:
        OSError: the file cannot be written.
    """
    flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC
    descriptor = os.open(path, flags, PRIVATE_FILE if is_private else _SHARED_FILE)
    with os.fdopen(descriptor, "wb") as file:
        if is_private:
            os.fchmod(descriptor, PRIVATE_FILE)
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
