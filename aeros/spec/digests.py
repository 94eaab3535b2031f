"""SHA-256 digests of what is certified: two different folders of code never have the same digest.

Paths and contents are hashed with their lengths before them, so bytes cannot move from one file,
or from a name, into another unnoticed.  (Assumes SHA-256 is collision-resistant.)
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Final

_CODE_FORMAT: Final = b"aeros/code/1\n"
"""Hashed first, so a code digest is never the digest of anything else."""


def file_digest(content: bytes) -> str:
    """The SHA-256 of `content`, in hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def code_files(folder: str | Path) -> dict[str, bytes]:
    """The content of every `*.py` file in `folder` and below, by path relative to it (`/` between parts).

    Raises OSError for a file that cannot be read.  A missing folder holds no files.
    """
    root = Path(folder)
    found = (path for path in root.rglob("*.py") if path.is_file())
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in sorted(found)}


def code_digest(files: Mapping[str, bytes]) -> str:
    """The digest of `files` (see `code_files`), whatever order they are in."""
    hasher = hashlib.sha256(_CODE_FORMAT)
    for name, content in sorted((os.fsencode(path), content) for path, content in files.items()):
        for part in (name, content):
            hasher.update(len(part).to_bytes(8, "big"))
            hasher.update(part)
    return hasher.hexdigest()
