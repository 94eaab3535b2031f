"""The parts of AEROS that work in this installation: solver, extras, isolation layers and display."""

from __future__ import annotations

import os
import platform
import re
import sys
from collections.abc import Iterator, Mapping
from contextlib import closing
from enum import Enum
from importlib import metadata
from typing import Final, NamedTuple

from packaging.requirements import Requirement

from aeros.distribution import NAME, install_command
from aeros.runtime.isolation.zygote_pool import ZygoteError, ZygotePool

EXTRAS: Final = {
    "cvc5": "a second solver: `aeros verify --strict`",
    "dataset": "datasets in LeRobot's format: `aeros run --dataset`",
    "distributed": "experiments on a cluster: `aeros experiment --executor`",
    "experiments": "trials of many runs: `aeros experiment`",
    "film": "films of runs: `aeros film`, `aeros run --film`",
    "franka": "a real Franka Research 3: `aeros run --plant franka`",
    "gym": "environments of Gymnasium: `import aeros.gym`",
    "kinematic": "robots without physics: `aeros run --plant kinematic`",
    "learned": "modules with networks",
    "learned-proof": "proofs about networks that intervals leave open",
    "live": "a live view of runs: `aeros run --live`",
    "llm": "language models: `aeros run --planner llm`",
    "mcp": "MCP clients: `aeros mcp`",
    "mujoco": "physics by MuJoCo: `aeros run --plant mujoco`",
    "pddl": "classical planners: `aeros run --planner pddl`",
    "ros": "ROS 2 bags and MCAP files: `aeros run --bag`, `--mcap`",
    "ros2": "ROS 2 from PyPI, where no distribution is sourced: `aeros run --ros2`",
    "sim": "physics by PyBullet: `aeros run`",
}
"""What each extra gives a user; extras for those who develop AEROS are left out."""


class PartState(Enum):
    """If a part can be used: it was tried, or it is installed in a version that fits."""

    WORKS = "works"
    INSTALLED = "installed"
    MISSING = "missing"
    BROKEN = "broken"


class InstalledPart(NamedTuple):
    """A part of the installation.

    Attributes:
        name: of the part.
        state: if it can be used; a broken one is needed by every command.
        found: versions or the reason.
        gives: what it is for.
        cure: what to do to have it; empty if it works.
    """

    name: str
    state: PartState
    found: str
    gives: str
    cure: str = ""


def examine_installation(environment: Mapping[str, str] = os.environ) -> Iterator[InstalledPart]:
    """Examine each part of this installation.

    Args:
        environment: variables of the environment.

    Yields:
        The parts; the first ones are needed by every command.
    """
    yield InstalledPart(
        "python", PartState.WORKS, f"{platform.python_version()}, {sys.platform}", "runs AEROS"
    )
    requirements = _requirements()
    yield _needed(requirements.get("", []))
    for extra, gives in EXTRAS.items():
        yield _extra(extra, requirements.get(extra, []), gives)
    yield from _isolation()
    yield _display(environment)


def _requirements() -> dict[str, list[Requirement]]:
    """Return what the distribution requires, by extra; the empty name is for all."""
    found: dict[str, list[Requirement]] = {}
    for line in metadata.requires(NAME) or ():
        requirement = Requirement(line)
        extra = re.search(r'extra == ["\']([\w-]+)["\']', line)
        found.setdefault(extra[1] if extra else "", []).append(requirement)
    return found


def _lacking(requirements: list[Requirement]) -> tuple[list[str], list[str]]:
    """Return the distributions that are there, with their versions, and those that are not or do not fit."""
    there: list[str] = []
    lacking: list[str] = []
    for one in requirements:
        if one.name == NAME:
            continue  # another extra has a line of its own
        try:
            version = metadata.version(one.name)
        except metadata.PackageNotFoundError:
            lacking.append(one.name)
        else:
            fits = one.specifier.contains(version, prereleases=True)
            (there if fits else lacking).append(
                f"{one.name} {version}" + ("" if fits else f" ({one.specifier} is needed)")
            )
    return there, lacking


def _needed(requirements: list[Requirement]) -> InstalledPart:
    there, lacking = _lacking(requirements)
    gives = "proves, decides and keeps records"
    if lacking:
        cure = "install it again: `make install` in the clone of AEROS"
        return InstalledPart("core", PartState.BROKEN, f"lacks {', '.join(lacking)}", gives, cure)
    return InstalledPart("core", PartState.INSTALLED, ", ".join(there), gives)


def _extra(name: str, requirements: list[Requirement], gives: str) -> InstalledPart:
    there, lacking = _lacking(requirements)
    if not lacking:
        return InstalledPart(name, PartState.INSTALLED, ", ".join(there) or "nothing more is needed", gives)
    return InstalledPart(name, PartState.MISSING, f"lacks {', '.join(lacking)}", gives, install_command(name))


def _isolation() -> Iterator[InstalledPart]:
    """Try each layer that keeps the code of modules apart, as a run does."""
    gives = "keeps the code of modules from files, network and memory of others"
    try:
        with closing(ZygotePool(())) as pool:
            reasons = {layer.value: reason for layer, reason in pool.missing.items()}
    except ZygoteError as error:
        yield InstalledPart("isolation", PartState.MISSING, str(error), gives, "see docs/isolation.md")
        return
    for layer, reason in sorted(reasons.items()):
        if reason is None:
            yield InstalledPart(f"isolation: {layer}", PartState.WORKS, "tried", gives)
        else:
            yield InstalledPart(
                f"isolation: {layer}", PartState.MISSING, reason, gives, "see docs/isolation.md"
            )


def _display(environment: Mapping[str, str]) -> InstalledPart:
    gives = "a window: `aeros run --view`"
    named = [name for name in ("DISPLAY", "WAYLAND_DISPLAY") if environment.get(name)]
    if sys.platform == "linux" and not named:
        cure = "set DISPLAY or WAYLAND_DISPLAY; films need no display"
        return InstalledPart("display", PartState.MISSING, "no display", gives, cure)
    return InstalledPart("display", PartState.WORKS, ", ".join(named) or sys.platform, gives)
