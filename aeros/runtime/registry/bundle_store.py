"""Storage of installed modules: all files of a module, in a folder named by the digest of names and contents.

Stored files are never changed; another version goes to another folder. So the loaded files are the proved
files, and a folder that no record names can be deleted.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from aeros.files import make_folder, sync_folder, write_durably
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.text.digests import MAX_FOLDERS, code_digest
from aeros.spec.text.files import hidden_path_error

MAX_MODULE: Final = 256 * 1024 * 1024
"""Limit on the bytes of all files of a module."""

_EXCLUDED_NAMES: Final = ("__pycache__", "ecm.lock")


def module_files(folder: Path) -> dict[str, bytes]:
    """Read every file of a module. Hidden files, caches and the certificate do not belong to it.

    Args:
        folder: the module's folder.

    Returns:
        Content by path relative to the folder.

    Raises:
        UserError: there is a link or a device, a name holds a character that a reader cannot see, a file
            cannot be read, there are too many bytes, or too many folders are inside each other.
    """
    files: dict[str, bytes] = {}
    total = 0
    try:
        for name, entry in _entries(folder):
            path = Path(entry.path)
            if not entry.is_file(follow_symlinks=False):
                raise _unreadable(path, "it is not a regular file")
            hidden = hidden_path_error(name)
            if hidden is not None:
                raise UserError([hidden])
            total += entry.stat(follow_symlinks=False).st_size
            if total > MAX_MODULE:
                raise _unreadable(path, f"a module has at most {MAX_MODULE >> 20} MiB")
            files[name] = path.read_bytes()
    except OSError as failure:
        raise _unreadable(folder, failure.strerror or str(failure)) from failure
    return files


def _entries(folder: str | Path, below: str = "") -> Iterator[tuple[str, os.DirEntry[str]]]:
    """Yield all of a module that is no folder, sorted; `Path.rglob` takes four times as long."""
    if not below and not os.path.isdir(folder):
        return
    if below.count("/") > MAX_FOLDERS:
        why = f"a module has at most {MAX_FOLDERS} folders inside each other"
        raise _unreadable(Path(folder).parents[MAX_FOLDERS], why)
    with os.scandir(folder) as listed:
        entries = sorted(listed, key=lambda one: one.name)
    for entry in entries:
        if entry.name.startswith(".") or entry.name in _EXCLUDED_NAMES:
            continue
        if entry.is_dir(follow_symlinks=False):
            yield from _entries(entry.path, f"{below}{entry.name}/")
        else:
            yield f"{below}{entry.name}", entry


def bundle_digest(files: Mapping[str, bytes]) -> str:
    """Compute the digest by which a module is pinned.

    Args:
        files: content by path relative to the module's folder.

    Returns:
        SHA-256 over names and contents, in hexadecimal.
    """
    return code_digest(files)


def store_bundle(files: Mapping[str, bytes], store: Path, name: str) -> Path:
    """Store a module's files durably, unless exactly these files are stored already.

    Args:
        files: content by path relative to the module's folder.
        store: folder of all stored modules.
        name: id of the module.

    Returns:
        The folder below `store` that holds the files.
    """
    digest = bundle_digest(files)
    target = store / digest / name
    if target.is_dir() and module_files(target) == files:
        return target
    make_folder(store, 0o700)
    staging = store / f".{digest}.{os.getpid()}"
    shutil.rmtree(staging, ignore_errors=True)
    write_files(files, staging / name)
    for folder in sorted({path.parent for path in staging.rglob("*")}):
        sync_folder(folder)
    shutil.rmtree(store / digest, ignore_errors=True)
    staging.rename(store / digest)
    sync_folder(store)
    return target


@contextmanager
def stored_bundle(files: Mapping[str, bytes], store: Path, name: str) -> Iterator[Path]:
    """Store a module's files as `store_bundle` does; if the block fails, nothing new stays stored.

    Args:
        files: content by path relative to the module's folder.
        store: folder of all stored modules.
        name: id of the module.

    Yields:
        The folder below `store` that holds the files.
    """
    folders = (store / bundle_digest(files) / name, store / bundle_digest(files), store, store.parent)
    absent = [folder for folder in folders if not folder.exists()]
    try:
        yield store_bundle(files, store, name)
    except BaseException:
        for folder in absent:
            if folder == folders[0]:
                shutil.rmtree(folder, ignore_errors=True)
            else:
                with suppress(OSError):
                    folder.rmdir()
        raise


def write_files(files: Mapping[str, bytes], folder: Path) -> None:
    """Write a module's files durably.

    Args:
        files: content by path relative to the module's folder.
        folder: the folder, created if it does not exist.
    """
    for relative, content in files.items():
        path = folder / relative
        path.parent.mkdir(parents=True, exist_ok=True)
        write_durably(path, content)


def remove_unreferenced(store: Path, digests: Collection[str]) -> None:
    """Delete stored modules that are not referenced: left by an interrupted change, or never in force.

    Args:
        store: folder of all stored modules.
        digests: digests of the modules to keep.
    """
    for folder in store.iterdir() if store.is_dir() else ():
        if folder.name not in digests:
            shutil.rmtree(folder, ignore_errors=True)


def _unreadable(path: Path, reason: str) -> UserError:
    return UserError([Diagnostic("AE961", f"`{path}` cannot be stored: {reason}")])
