"""What experiments ran on: for whoever wants the same again."""

from __future__ import annotations

import os
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

import aeros

_RESULT_RELEVANT_PACKAGES: Final = ("numpy", "py_trees", "pybullet", "z3-solver")
_PACKAGES: Final = ("aeros", "distributed", *_RESULT_RELEVANT_PACKAGES, "scipy")


def environment() -> dict[str, Any]:
    """Commit, machine and releases, as far as they can be found."""
    return {
        "commit": _commit(),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "processors": os.cpu_count(),
        "packages": {name: found for name in _PACKAGES if (found := _release(name)) is not None},
    }


def package_versions() -> str:
    """Python's and those of packages, which decide what trials find besides code of AEROS."""
    return f"python {platform.python_version()} " + " ".join(
        f"{one} {_release(one)}" for one in _RESULT_RELEVANT_PACKAGES
    )


def _release(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _commit() -> str | None:
    """Of the checkout that AEROS runs from, `+` where it was changed since; None where it is none."""
    told = [_git("rev-parse", "HEAD"), _git("status", "--porcelain", "--untracked-files=no")]
    if told[0] is None:
        return None
    return told[0] + ("+" if told[1] else "")


def _git(*arguments: str) -> str | None:
    folder = str(Path(aeros.__file__).parent)
    try:
        done = subprocess.run(  # noqa: S603
            ("git", "-C", folder, *arguments),  # noqa: S607
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
