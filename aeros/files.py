"""Private files and folders, writes that survive a power cut, temporary folders, and locks.

A run writes what a camera of the workplace would see, and what decides whether a robot may move. So the
files of a run and of an agent are for their owner alone, in folders for their owner alone.
"""

from __future__ import annotations

import errno
import fcntl
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, Final

PRIVATE_FILE: Final = 0o600
PRIVATE_FOLDER: Final = 0o700
_SHARED_FILE: Final = 0o666


@contextmanager
def name_in_errors(path: Path) -> Iterator[None]:
    """Name a file in the system's errors of the block that name none, as those of writes do.

    Args:
        path: the file that the block writes or flushes.

    Raises:
        OSError: the error of the block, with a file's name.
    """
    try:
        yield
    except OSError as error:
        if error.filename is None:
            error.filename = str(path)
        raise


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
    make_folder(folder, PRIVATE_FOLDER)
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
    if stat.S_ISREG(os.fstat(descriptor).st_mode):  # `/dev/null` stays everybody's
        with suppress(PermissionError):
            os.fchmod(descriptor, PRIVATE_FILE)
    return os.fdopen(descriptor, "a+b", buffering=0)


def open_regular(path: Path) -> BinaryIO:
    """Open a regular file to read; neither a pipe, which may block for ever, nor a device without an end.

    Args:
        path: the file; a link is followed.

    Returns:
        The file.

    Raises:
        OSError: it cannot be opened, or is no regular file.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError(errno.EINVAL, "it is not a regular file", str(path))
    return os.fdopen(descriptor, "rb")


def replace_durably(path: Path, content: bytes, *, is_private: bool = True) -> None:
    """Replace the file at `path`; after a power cut it holds either the old content or the new.

    Only one process at a time may replace a file: the new content is first written to `path` with the suffix
    `.new`. A link stays, and the file it leads to is replaced. A device or pipe, such as `/dev/null`, stays,
    too: it is written to.

    Args:
        path: the file to replace or create.
        content: its new bytes.
        is_private: the file is for its owner alone; otherwise the umask decides.

    Raises:
        OSError: the file or its folder cannot be written.
    """
    if path.is_char_device() or path.is_fifo():
        with name_in_errors(path), path.open("wb") as stream:
            stream.write(content)
        return
    if path.is_symlink():
        try:
            path = path.resolve()
        except RuntimeError as error:  # of Python before 3.13
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path)) from error
    replacement = path.with_name(path.name + ".new")
    try:
        write_durably(replacement, content, is_private=is_private)
        replacement.replace(path)
    except OSError:
        with suppress(OSError):
            replacement.unlink()
        raise
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
    with name_in_errors(path), os.fdopen(descriptor, "wb") as file:
        if is_private:
            os.fchmod(descriptor, PRIVATE_FILE)
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def make_folder(folder: Path, mode: int = 0o777) -> None:
    """Create a folder and its missing parents; their names survive a power cut.

    Args:
        folder: the folder to create; it may exist.
        mode: mode of the folder itself, without the bits of the umask; parents get the usual mode.

    Raises:
        OSError: a folder cannot be created or flushed, or there is a file in its place.
    """
    missing = [one for one in (folder, *folder.parents) if not one.exists()]
    folder.mkdir(mode=mode, parents=True, exist_ok=True)
    for one in reversed(missing):
        sync_folder(one.parent)


def sync_folder(folder: Path) -> None:
    """Flush a folder's list of file names to the disk.

    Args:
        folder: an existing folder.

    Raises:
        OSError: it cannot be opened or flushed.
    """
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        with name_in_errors(folder):
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


def temporary_root(within: Path | None = None) -> Path | None:
    """Return the folder of this user's temporary folders; create it if needed.

    Args:
        within: an existing folder; by default the system's folder for temporary files.

    Returns:
        The folder; None if somebody else made it, or may change it.
    """
    # Hidden where it stands beside somebody's files.
    hidden = "" if within is None else "."
    root = (within or Path(tempfile.gettempdir())) / f"{hidden}aeros-{os.geteuid()}"
    try:
        root.mkdir(mode=0o700, exist_ok=True)
    except FileExistsError:
        return None  # it is no folder
    found = root.lstat()
    is_private = stat.S_ISDIR(found.st_mode) and not found.st_mode & 0o077
    return root if is_private and found.st_uid == os.geteuid() else None


@contextmanager
def temporary_folder(within: Path | None = None) -> Iterator[Path]:
    """Make a temporary folder that is deleted after the block.

    Its process locks it. So folders that nobody locks belonged to processes that were killed; they are
    deleted as well. Nothing stays in `within`, except after a kill until the next call.

    Args:
        within: an existing folder; by default the system's folder for temporary files.

    Yields:
        The folder, empty and private.
    """
    made, lock = None, None
    while (root := temporary_root(within)) is not None and made is None:
        with suppress(FileNotFoundError), _locked_folder(root, fcntl.LOCK_EX):  # deleted meanwhile: once more
            for other in root.iterdir():
                _delete_if_abandoned(other)
            made = Path(tempfile.mkdtemp(dir=root))
            lock = _lock_folder(made, fcntl.LOCK_SH)
    if root is None or made is None or lock is None:
        with tempfile.TemporaryDirectory(prefix="aeros-", dir=within) as folder:
            yield Path(folder)
        return
    try:
        yield made
    finally:
        shutil.rmtree(made, ignore_errors=True)
        os.close(lock)
        if within is not None:
            with suppress(OSError), _locked_folder(root, fcntl.LOCK_EX):
                root.rmdir()  # unless another process has a folder in it


@contextmanager
def hold_temporary_folder(folder: Path) -> Iterator[None]:
    """Keep a temporary folder whose name another process chose; delete it after the block.

    Args:
        folder: the folder, below `temporary_root`; created if needed.

    Raises:
        OSError: it cannot be created.
    """
    folder.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with _locked_folder(folder.parent, fcntl.LOCK_EX):
        folder.mkdir(mode=0o700, exist_ok=True)
        lock = _lock_folder(folder, fcntl.LOCK_SH)
    try:
        yield
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        os.close(lock)


def _delete_if_abandoned(folder: Path) -> None:
    try:
        descriptor = _open_folder(folder)
    except OSError:
        return  # no folder
    try:
        if try_lock(descriptor):
            shutil.rmtree(folder, ignore_errors=True)
    finally:
        os.close(descriptor)


@contextmanager
def _locked_folder(folder: Path, how: int) -> Iterator[None]:
    lock = _lock_folder(folder, how)
    try:
        yield
    finally:
        os.close(lock)


def _lock_folder(folder: Path, how: int) -> int:
    descriptor = _open_folder(folder)
    fcntl.flock(descriptor, how)
    return descriptor


def _open_folder(folder: Path) -> int:
    return os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
