"""SHA-256 digests of certified files: two different folders of code never have the same digest.

Paths and contents are hashed with their lengths before them, so bytes cannot move from one file, or from a
name, into another unnoticed. (Assumes that SHA-256 is collision-resistant.)
"""

from __future__ import annotations

import errno
import hashlib
import os
import stat
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Final

MAX_FILE: Final = 128 * 1024
"""Bytes of one code file at most: what can be read and reviewed."""

MAX_CODE: Final = 1024 * 1024
"""Bytes of all code of a module at most."""

MAX_MODELS: Final = 4 * 1024**3
"""Bytes of all models of a module at most: they are hashed each time the module is read."""

MAX_FOLDERS: Final = 50
"""Folders inside each other that a module has at most: thousands of them exhaust Python's stack."""

_CODE_FORMAT: Final = b"aeros/code/1\n"
"""Hashed first, so a code digest is never the digest of anything else."""


def file_digest(content: bytes) -> str:
    """Hash bytes.

    Args:
        content: content of a file.

    Returns:
        Its SHA-256, in hexadecimal.
    """
    return hashlib.sha256(content).hexdigest()


def text_digest(text: str) -> str:
    """Hash a text as UTF-8.

    Args:
        text: any text without surrogates.

    Returns:
        Its SHA-256, in hexadecimal.
    """
    return file_digest(text.encode())


def code_files(folder: str | Path) -> dict[str, bytes]:
    """Read all code files of a module.

    Args:
        folder: folder of the module. A missing folder holds no files.

    Returns:
        Content of every `*.py` file in `folder` and below, by path relative to it (`/` between parts).

    Raises:
        OSError: a file cannot be read, is no regular file (a link may lead anywhere, a device may never end),
            or is larger than `MAX_FILE`, or all are larger than `MAX_CODE`, or more than `MAX_FOLDERS`
            folders are inside each other.
    """
    files: dict[str, bytes] = {}
    size = 0
    for name in sorted(_python_files(os.fspath(folder)), key=lambda name: name.split("/")):
        path = os.path.join(folder, name)
        if not stat.S_ISREG(os.lstat(path).st_mode):
            raise OSError(errno.EINVAL, f"`{name}` is not a regular file")
        with Path(path).open("rb") as file:
            files[name] = file.read(MAX_FILE + 1)
        size += len(files[name])
        if len(files[name]) > MAX_FILE or size > MAX_CODE:
            raise OSError(errno.EFBIG, f"`{name}` is larger than skill code may be")
    return files


def _python_files(root: str) -> Iterator[str]:
    """Yield all names `*.py` below `root`, relative to it.

    Raises:
        OSError: a folder cannot be read, or more than `MAX_FOLDERS` folders are inside each other.
    """
    if not os.path.isdir(root):
        return
    for here, folders, files in os.walk(root, onerror=_raise):
        below = os.path.relpath(here, root).replace(os.sep, "/") + "/" if here != root else ""
        if below.count("/") > MAX_FOLDERS:
            raise OSError(errno.ENAMETOOLONG, f"a module has at most {MAX_FOLDERS} folders inside each other")
        yield from (f"{below}{name}" for name in (*folders, *files) if name.endswith(".py"))


def _raise(error: OSError) -> None:
    raise error


def code_digest(files: Mapping[str, bytes]) -> str:
    """Hash code files, in any order.

    Args:
        files: content by path, as `code_files` returns it.

    Returns:
        The digest, in hexadecimal.
    """
    hasher = hashlib.sha256(_CODE_FORMAT)
    for name, content in sorted((os.fsencode(path), content) for path, content in files.items()):
        for part in (name, content):
            hasher.update(len(part).to_bytes(8, "big"))
            hasher.update(part)
    return hasher.hexdigest()


def model_digest(folder: str | Path, name: str, at_most: int = MAX_MODELS) -> tuple[str, int]:
    """Hash a model file, without reading all of it into memory.

    Args:
        folder: folder of the module.
        name: path of the file, relative to `folder`.
        at_most: greatest size in bytes.

    Returns:
        The SHA-256 of the file, in hexadecimal, and its size in bytes.

    Raises:
        OSError: the path leads out of the folder or through a link, is no regular file, cannot be read, or
            the file has more than `at_most` bytes.
    """
    hasher, size = hashlib.sha256(), 0
    try:
        descriptor = _open_below(folder, PurePosixPath(name).parts)
    except ValueError as error:
        raise OSError(errno.EINVAL, "it is not a path") from error
    with os.fdopen(descriptor, "rb") as file:
        while block := file.read(_BLOCK):
            size += len(block)
            if size > at_most:
                raise OSError(errno.EFBIG, f"all models together have more than {MAX_MODELS:,} bytes")
            hasher.update(block)
    return hasher.hexdigest(), size


def model_content(folder: str | Path, name: str, at_most: int) -> bytes:
    """Read a model file whole, as `model_digest` finds it.

    Args:
        folder: folder of the module.
        name: path of the file, relative to `folder`.
        at_most: greatest size in bytes.

    Returns:
        Its bytes.

    Raises:
        OSError: as `model_digest` raises it.
    """
    try:
        descriptor = _open_below(folder, PurePosixPath(name).parts)
    except ValueError as error:
        raise OSError(errno.EINVAL, "it is not a path") from error
    with os.fdopen(descriptor, "rb") as file:
        content = file.read(at_most + 1)
    if len(content) > at_most:
        raise OSError(errno.EFBIG, f"it has more than {at_most:,} bytes")
    return content


_BLOCK: Final = 1024 * 1024


def _open_below(folder: str | Path, parts: Sequence[str]) -> int:
    """Open the regular file at `parts` below `folder`, if no part of the path is a link.

    Each part is examined before it is opened, since opening a device can already have an effect.

    Raises:
        OSError: it is outside the folder, reached through a link, or not a regular file.
    """
    if not parts or ".." in parts or parts[0] == "/":
        raise OSError(errno.EINVAL, "it is not in the module's folder")
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    for position, part in enumerate(parts, 1):
        above = descriptor
        try:
            mode = os.stat(part, dir_fd=above, follow_symlinks=False).st_mode
            if stat.S_ISLNK(mode):
                raise OSError(errno.ELOOP, "it is reached through a link")
            if not (stat.S_ISREG(mode) if position == len(parts) else stat.S_ISDIR(mode)):
                raise OSError(errno.EINVAL, "it is not a regular file")
            flags = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
            descriptor = os.open(part, flags, dir_fd=above)
        finally:
            os.close(above)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):  # it was replaced in between
        os.close(descriptor)
        raise OSError(errno.EINVAL, "it is not a regular file")
    return descriptor
