"""A module as it is kept: all its files, under the digest of their names and contents.

Kept files are never changed; another version is another folder.  So what was proved is what is
loaded, and a folder that no record names is rubbish.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from aeros.files import sync_folder, write_durably
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.text.digests import code_digest

MAX_MODULE: Final = 256 * 1024 * 1024
"""Bytes of all files of a module at most."""

_EXCLUDED_NAMES: Final = ("__pycache__", "ecm.lock")


def module_files(folder: Path) -> dict[str, bytes]:
    """The content of every file of the module in `folder`, by path relative to it.

    Hidden files, caches and the certificate are no part of it.  Raises `UserError` for a link, a
    device, a file that cannot be read, or too many bytes.
    """
    files: dict[str, bytes] = {}
    total = 0
    try:
        for path in sorted(folder.rglob("*")):
            name = path.relative_to(folder)
            if any(part.startswith(".") or part in _EXCLUDED_NAMES for part in name.parts):
                continue
            if path.is_dir() and not path.is_symlink():
                continue
            if path.is_symlink() or not path.is_file():
                raise _unreadable(path, "it is no regular file")
            total += path.stat().st_size
            if total > MAX_MODULE:
                raise _unreadable(path, f"a module has at most {MAX_MODULE >> 20} MiB")
            files[name.as_posix()] = path.read_bytes()
    except OSError as failure:
        raise _unreadable(folder, failure.strerror or str(failure)) from failure
    return files


def bundle_digest(files: Mapping[str, bytes]) -> str:
    """The SHA-256 over names and contents, in hexadecimal: what a bundle is pinned by."""
    return code_digest(files)


def store_bundle(files: Mapping[str, bytes], store: Path, name: str) -> Path:
    """The folder below `store` that holds exactly `files`, written through to the disk."""
    digest = bundle_digest(files)
    kept = store / digest / name
    if kept.is_dir() and module_files(kept) == files:
        return kept
    beside = store / f".{digest}.{os.getpid()}"
    shutil.rmtree(beside, ignore_errors=True)
    for relative, content in files.items():
        path = beside / name / relative
        path.parent.mkdir(parents=True, exist_ok=True)
        write_durably(path, content)
    for folder in sorted({path.parent for path in beside.rglob("*")}):
        sync_folder(folder)
    shutil.rmtree(store / digest, ignore_errors=True)
    beside.rename(store / digest)
    sync_folder(store)
    return kept


def remove_unreferenced(store: Path, named: set[Path]) -> None:
    """Remove what holds none of the folders `named`: left by an interrupted change, or never in force."""
    for folder in store.iterdir() if store.is_dir() else ():
        if not any(folder in path.parents for path in named):
            shutil.rmtree(folder, ignore_errors=True)


def _unreadable(path: Path, reason: str) -> UserError:
    return UserError([Diagnostic("AE961", f"`{path}` cannot be kept: {reason}")])
