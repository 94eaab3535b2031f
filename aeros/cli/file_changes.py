"""Changes of files that people wrote: shown as a diff, and written durably."""

from __future__ import annotations

import difflib
import stat
from pathlib import Path
from typing import Final

from aeros.files import replace_durably
from aeros.spec.migrations import formats

_REGISTRY: Final = formats.REGISTRY.files[0]
_KEPT: Final = ("modules", "policies")  # the folders in which a registry has copies


def unified_diff(before: str, after: str, name: str, new_name: str | None = None) -> str:
    """Compare two texts of a file.

    Args:
        before: the text.
        after: the changed text.
        name: name of the file to show.
        new_name: name of the changed file to show; by default the same.

    Returns:
        Text that `patch -p0` and `git apply -p0` read; no text if nothing is changed.
    """
    # A line ends at "\n" alone, as in `patch`: `splitlines` would end lines at other signs, too.
    old, new = ([f"{line}\n" for line in text.split("\n")] for text in (before, after))
    for lines in (old, new):
        last = lines.pop().removesuffix("\n")
        lines += [last] if last else []
    ending = "\n\\ No newline at end of file\n"
    found = difflib.unified_diff(old, new, name, new_name or name)
    return "".join(line if line.endswith("\n") else line + ending for line in found)


def replace_text(path: Path, before: str, after: str) -> None:
    """Replace the text of a file; its mode stays, and so does a link to it.

    Args:
        path: the file.
        before: its text as it was read.
        after: the text to write, in UTF-8.

    Raises:
        OSError: the file cannot be written, or was changed since it was read.
    """
    target = path.resolve()
    mode = stat.S_IMODE(target.stat().st_mode)
    if target.read_bytes() != before.encode():
        raise OSError(0, "the file was changed while this command ran")
    replace_durably(target, after.encode(), is_private=False)
    target.chmod(mode)


def is_pinned(path: Path) -> bool:
    """Check if a registry keeps a file under its digest.

    Args:
        path: the file.

    Returns:
        True if it is a copy that no change may touch.
    """
    real = path.resolve()
    return any(
        (folder / _REGISTRY).exists() and real.relative_to(folder).parts[0] in _KEPT
        for folder in real.parents
    )
