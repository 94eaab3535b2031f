"""Inputs of trials: modules proved under a site, and the code that runs them; loaded once a process."""

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

_EXCLUDED_FOLDERS: Final = (
    "api.py",
    "apps",
    "cli",
    "docs",
    "experiments",
    "franka",
    "gym",
    "ros2_control",
    "schemas",
    "templates",
)
"""Parts of AEROS that do not decide the findings of a trial, except for …"""

_INCLUDED_FILES: Final = (
    "architecture.py",
    "architectures",
    "failure_models.py",
    "open_gate.py",
    "plant_cache.py",
    "random_stream.py",
    "slow_planner.py",
    "trial_context.py",
    "trial_plants.py",
)
"""… these of `experiments`; data and the kind of trial are in the condition and its digest."""


@dataclass(frozen=True, slots=True)
class InputPaths:
    """Paths that the inputs are read from; a worker on another machine has them too.

    Attributes:
        modules_folder: folder of the modules.
        site: path of the site file; None for the reference site.
    """

    modules_folder: str
    site: str | None = None


@dataclass(frozen=True, slots=True)
class TrialInputs:
    """Proved and compiled inputs of trials.

    Attributes:
        paths: files and folders that they were read from.
        configuration: the proved modules under their site.
        gate: compiled from the configuration.
        skill_runs: opens skills in this process.
        sources_digest: over site, certificates (so manifests and skill code), scenes, and the code that all
            trials run.
        digest: over these, and the releases that they run on.
    """

    paths: InputPaths
    configuration: Configuration
    gate: Gate
    skill_runs: CachedRunFactory
    sources_digest: str
    digest: str

    def routed(self, task: str) -> RoutedTask:
        """Find a task by its name.

        Args:
            task: name of the task.

        Returns:
            The task, and the module that provides it.

        Raises:
            UserError: no module has the task.
        """
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
    """Prove the modules and compile the gate; cached.

    Args:
        where: folder of the modules, and the site.

    Returns:
        The inputs of all trials.

    Raises:
        UserError: a module or the site is refused.
    """
    site = reference_site_path() if where.site is None else Path(where.site)
    configuration, _ = prove_configuration([Path(where.modules_folder)], site, certified=True)
    scenes = scene_digest(where.modules_folder)
    sources = hashlib.sha256(f"{configuration.digest} {code_digest()} {scenes}".encode()).hexdigest()
    digest = hashlib.sha256(f"{sources} {package_versions()}".encode()).hexdigest()
    gate = CompiledGate(configuration)
    return TrialInputs(where, configuration, gate, CachedRunFactory(), sources, digest)


@cache
def code_digest() -> str:
    """Digest every file of AEROS that decides the findings of trials of any kind.

    Returns:
        SHA-256, hexadecimal.
    """
    root = Path(aeros.__file__).parent
    deciding = (one for one in root.iterdir() if one.name not in _EXCLUDED_FOLDERS)
    also = (root / "experiments" / name for name in _INCLUDED_FILES)
    return digest_of_files(
        {str(path.relative_to(root)): path for one in (*deciding, *also) for path in _source_files(one)}
    )


def scene_digest(modules_folder: str) -> str:
    """Digest the scenes of modules, which are no part of their certificates, with the models that they name.

    Args:
        modules_folder: folder of the modules.

    Returns:
        SHA-256, hexadecimal.
    """
    root = Path(modules_folder)
    files = (path for path in root.glob("**/scenes/**/*") if path.is_file())
    return digest_of_files({str(path.relative_to(root)): path for path in files})


def digest_of_files(files: Mapping[str, Path]) -> str:
    """Digest names and contents of files.

    Args:
        files: path of each file, by the name that is digested with its content.

    Returns:
        SHA-256, hexadecimal.
    """
    digest = hashlib.sha256()
    for name, path in sorted(files.items()):
        content = path.read_bytes()
        digest.update(f"{name} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def _source_files(path: Path) -> Iterator[Path]:
    """List the files at `path` and below, without caches."""
    if path.is_file():
        yield path
        return
    for here, _, names in os.walk(path):
        if Path(here).name != "__pycache__":
            yield from (Path(here) / name for name in names)
