"""Description of the machine and the releases that experiments ran on, needed to run them again."""

from __future__ import annotations

import os
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

import aeros
from aeros import distribution

_RESULT_RELEVANT_PACKAGES: Final = ("behaviortreepy", "numpy", "py_trees", "pybullet", "z3-solver")
_PACKAGES: Final = (distribution.NAME, "distributed", *_RESULT_RELEVANT_PACKAGES, "scipy")


def environment() -> dict[str, Any]:
    """Describe commit, machine and releases, as far as they can be found.

    Returns:
        JSON values by name.
    """
    return {
        "commit": _commit(),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "processors": os.cpu_count(),
        "packages": {name: found for name in _PACKAGES if (found := _release(name)) is not None},
    }


def package_versions() -> str:
    """List the versions of Python and of the packages that can change the results of trials.

    Returns:
        One line, as `python 3.11.9 numpy 2.0.1 ...`.
    """
    return f"python {platform.python_version()} " + " ".join(
        f"{one} {_release(one)}" for one in _RESULT_RELEVANT_PACKAGES
    )


def _release(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _commit() -> str | None:
    """Return the commit of the checkout that AEROS runs from, with `+` if changed; None without one."""
    outputs = [_git("rev-parse", "HEAD"), _git("status", "--porcelain", "--untracked-files=no")]
    if outputs[0] is None:
        return None
    return outputs[0] + ("+" if outputs[1] else "")


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
