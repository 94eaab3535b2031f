"""SHA-256 digests of what is certified: two different folders of code never have the same digest.

Paths and contents are hashed with their lengths before them, so bytes cannot move from one file,
or from a name, into another unnoticed.  (Assumes SHA-256 is collision-resistant.)
"""

from __future__ import annotations

import errno
import hashlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Final

MAX_FILE: Final = 128 * 1024
"""Bytes of one code file at most: what can be read and reviewed."""

MAX_CODE: Final = 1024 * 1024
"""Bytes of all code of a module at most."""

_CODE_FORMAT: Final = b"aeros/code/1\n"
"""Hashed first, so a code digest is never the digest of anything else."""


def file_digest(content: bytes) -> str:
    """The SHA-256 of `content`, in hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def text_digest(text: str) -> str:
    """The SHA-256 of `text` as UTF-8, in hexadecimal."""
    return file_digest(text.encode())


def code_files(folder: str | Path) -> dict[str, bytes]:
    """The content of every `*.py` file in `folder` and below, by path relative to it (`/` between parts).

    Raises OSError for a file that cannot be read, is no regular file (a link may lead anywhere, a
    device may never end) or is too large.  A missing folder holds no files.
    """
    root = Path(folder)
    files: dict[str, bytes] = {}
    for path in sorted(root.rglob("*.py")):
        name = path.relative_to(root).as_posix()
        if path.is_symlink() or not path.is_file():
            raise OSError(errno.EINVAL, f"`{name}` is no regular file")
        with path.open("rb") as file:
            files[name] = file.read(MAX_FILE + 1)
        if len(files[name]) > MAX_FILE or sum(map(len, files.values())) > MAX_CODE:
            raise OSError(errno.EFBIG, f"`{name}` is larger than skill code may be")
    return files


def code_digest(files: Mapping[str, bytes]) -> str:
    """The digest of `files` (see `code_files`), whatever order they are in."""
    hasher = hashlib.sha256(_CODE_FORMAT)
    for name, content in sorted((os.fsencode(path), content) for path, content in files.items()):
        for part in (name, content):
            hasher.update(len(part).to_bytes(8, "big"))
            hasher.update(part)
    return hasher.hexdigest()
