"""What trials stand on: modules proved under a site, and the code that runs them; made once for a process."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

import aeros
from aeros.agent.planning.routing import RoutedTask
from aeros.experiments.environment import package_versions
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.gate.port import Gate
from aeros.runtime.proving import prove_configuration
from aeros.runtime.skills.in_process_run import CachedRunFactory
from aeros.spec.diagnostics.codes import Diagnostic, did_you_mean
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.text.discovery import reference_site_path

_EXCLUDED_FOLDERS: Final = ("api.py", "cli", "docs", "experiments")
"""Parts of AEROS that decide nothing of what a trial finds, but for …"""

_INCLUDED_FILES: Final = (
    "architecture.py",
    "architectures",
    "failures.py",
    "luck.py",
    "means.py",
    "open_gate.py",
    "plants.py",
    "sharing.py",
    "slow_planner.py",
)
"""… these of `experiments`; what data and the kind of trial decide is in the condition and its digest."""


@dataclass(frozen=True, slots=True)
class InputPaths:
    """Where the premises are read from, as a worker elsewhere has them too.

    site: None for the reference site.
    """

    modules_folder: str
    site: str | None = None


@dataclass(frozen=True, slots=True)
class TrialInputs:
    """What is proved and compiled.

    where: it was read from.
    digest: over site, certificates (so manifests and skill code), the code that all trials run, and the
        releases that it runs on.
    runs: opens skills in this process.
    """

    paths: InputPaths
    configuration: Configuration
    gate: Gate
    skill_runs: CachedRunFactory
    digest: str

    def routed(self, task: str) -> RoutedTask:
        """The task of that name; raises `UserError` where no module has it."""
        tasks = {
            one.id: RoutedTask(name, one)
            for name, ecm in self.configuration.modules.items()
            for one in ecm.tasks.values()
        }
        if task not in tasks:
            near = did_you_mean(task, tasks)
            help_ = (f"did you mean `{near}`?",) if near else (f"there are {', '.join(tasks)}",)
            raise UserError([Diagnostic("AE130", f"no module has the task `{task}`", help=help_)])
        return tasks[task]


@cache
def load_inputs(where: InputPaths) -> TrialInputs:
    """Everything proved and compiled; raises `UserError` where anything of it is refused."""
    site = reference_site_path() if where.site is None else Path(where.site)
    configuration, _ = prove_configuration([Path(where.modules_folder)], site, certified=True)
    digest = hashlib.sha256(
        f"{configuration.digest} {code_digest()} {package_versions()}".encode()
    ).hexdigest()
    return TrialInputs(where, configuration, CompiledGate(configuration), CachedRunFactory(), digest)


@cache
def code_digest() -> str:
    """SHA-256 over every file of AEROS that decides what trials of any kind find."""
    root = Path(aeros.__file__).parent
    deciding = (one for one in root.iterdir() if one.name not in _EXCLUDED_FOLDERS)
    also = (root / "experiments" / name for name in _INCLUDED_FILES)
    return digest_of_files(
        {str(path.relative_to(root)): path for one in (*deciding, *also) for path in _source_files(one)}
    )


def digest_of_files(files: Mapping[str, Path]) -> str:
    """SHA-256 over names and contents."""
    digest = hashlib.sha256()
    for name, path in sorted(files.items()):
        content = path.read_bytes()
        digest.update(f"{name} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def _source_files(path: Path) -> Iterator[Path]:
    """The files at `path` and below that are somebody's, and no cache."""
    if path.is_file():
        yield path
        return
    for here, folders, names in os.walk(path):
        folders[:] = [one for one in folders if one != "__pycache__"]
        yield from (Path(here) / name for name in names)
