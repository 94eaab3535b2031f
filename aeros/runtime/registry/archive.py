"""Archive of a module: a zip file, with the same bytes for the same module.

Any zip tool can read it. A module is pinned by the digest of its files, not of the archive, so repacking it
changes nothing.
"""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Final

from aeros.runtime.registry.bundle_store import MAX_MODULE
from aeros.spec.diagnostics.codes import Diagnostic, quoted
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.text.digests import MAX_FOLDERS

MAX_FILES: Final = 10_000
_EPOCH: Final = (1980, 1, 1, 0, 0, 0)  # the earliest that the format has
_ENCRYPTED: Final = 1  # bit of the flags of an entry
_REGULAR: Final = 0o100644 << 16


def pack(files: Mapping[str, bytes]) -> bytes:
    """Pack files into an archive.

    Args:
        files: content by path relative to the module's folder.

    Returns:
        Bytes of a zip file, the same for the same files.
    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.external_attr = _REGULAR
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3  # Unix, wherever it is packed
            archive.writestr(entry, files[name], compresslevel=9)
    return buffer.getvalue()


def unpack(path: Path, into: Path) -> None:
    """Unpack an archive.

    Args:
        path: zip file.
        into: folder to write to.

    Raises:
        UserError: it is not a zip file, is too large, or contains a file that is outside the folder, not a
            regular file, duplicated, or of another size than stated.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            # Not `is_dir`, which fails for a name that is empty.
            entries = [entry for entry in archive.infolist() if not entry.filename.endswith("/")]
            problem = _archive_problem(entries)
            if problem is not None:
                raise _refused(path, problem)
            for entry in entries:
                _unpack_entry(archive, entry, into, path)
    except (OSError, zipfile.BadZipFile, zipfile.LargeZipFile, NotImplementedError, RuntimeError) as failure:
        raise _refused(path, _reason(failure)) from failure
    except (EOFError, ValueError, zlib.error) as failure:
        raise _refused(path, f"it is damaged: {failure}") from failure


def _unpack_entry(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, into: Path, path: Path) -> None:
    if entry.flag_bits & _ENCRYPTED:
        raise _refused(path, f"{quoted(entry.filename)} is encrypted")
    try:
        with archive.open(entry) as opened:
            content = opened.read(entry.file_size + 1)
        if len(content) != entry.file_size:
            raise _refused(path, f"{quoted(entry.filename)} does not have its stated size")
        target = into / entry.filename
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
    except (FileExistsError, IsADirectoryError, NotADirectoryError) as failure:
        raise _refused(path, f"{quoted(entry.filename)} is both a file and a folder in it") from failure
    except OSError as failure:
        raise _refused(path, f"{quoted(entry.filename)}: {_reason(failure)}") from failure
    except (EOFError, ValueError, zipfile.BadZipFile, zlib.error) as failure:
        raise _refused(path, f"{quoted(entry.filename)} is damaged: {failure}") from failure


def _reason(failure: Exception) -> str:
    """Return what the system says, without the path, which may be of a temporary file."""
    return (failure.strerror if isinstance(failure, OSError) else None) or str(failure)


def _archive_problem(entries: list[zipfile.ZipInfo]) -> str | None:
    names = [entry.filename for entry in entries]
    if len(names) > MAX_FILES:
        return f"a module has at most {MAX_FILES:,} files"
    if sum(entry.file_size for entry in entries) > MAX_MODULE:
        return f"a module has at most {MAX_MODULE >> 20} MiB"
    for entry in entries:
        if not entry.filename:
            return "a file in it has no name"
        parts = PurePosixPath(entry.filename).parts
        if "\\" in entry.filename or not parts or parts[0] == "/" or ".." in parts:
            return f"{quoted(entry.filename)} is outside the module's folder"
        if len(parts) > MAX_FOLDERS + 1:
            return f"a module has at most {MAX_FOLDERS} folders inside each other"
        if entry.external_attr >> 28 not in (0, 0o10):  # no mode, or a regular file
            return f"{quoted(entry.filename)} is not a regular file"
    if len({str(PurePosixPath(name)) for name in names}) != len(names):
        return "a file is in it twice"
    return None


def _refused(path: Path, reason: str) -> UserError:
    return UserError([Diagnostic("AE961", f"`{path}` cannot be unpacked: {reason}")])
