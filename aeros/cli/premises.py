"""What `aeros run` and `aeros mcp` begin with: who governs, who signs, where skills run and what is left."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Final

from aeros.agent.errors import RefusedError
from aeros.agent.routing import Routed, route
from aeros.cli.arguments import UsageError
from aeros.cli.bag import BagRefusedError
from aeros.cli.plants import PlantRefusedError
from aeros.runtime.audit import AuditError
from aeros.runtime.audit_checkpoints import AnchorError, Signing
from aeros.runtime.audit_keys import KeyRefusedError, read_signing_key
from aeros.runtime.configuration import Configuration
from aeros.runtime.isolation.opening import SkillRuns
from aeros.runtime.proving import prove
from aeros.runtime.registry.governing import Governing, Steered
from aeros.runtime.registry.registry import Registry
from aeros.runtime.skill_code import SkillRefusedError
from aeros.spec.folders import reference_site
from aeros.spec.model import Ecm
from aeros.spec.reports import Report

REFUSALS: Final = (
    RefusedError,
    PlantRefusedError,
    SkillRefusedError,
    AuditError,
    AnchorError,
    BagRefusedError,
    KeyRefusedError,
)
"""What ends both with exit code 1 and a reason."""


def seed_of(text: str) -> int:
    """A seed, as an argument."""
    if not text.isascii() or not text.isdigit() or not int(text) < 2**63:
        raise argparse.ArgumentTypeError("expected a whole number from 0 to 2^63 - 1")
    return int(text)


def key_file_of(arguments: argparse.Namespace) -> Path | None:
    """The key to sign with: as --audit-key says, or one in the agent's folder; raises UsageError without."""
    path = arguments.state / "audit.key"
    found: Path | None = arguments.audit_key or (path if path.exists() else None)
    if arguments.anchor is not None and found is None:
        raise UsageError("--anchor needs --audit-key: `aeros audit keygen` makes one")
    return found


def signing_with(key_file: Path | None, anchor: Path | None) -> Signing | None:
    """What signs the audit log, if anything does."""
    return None if key_file is None else Signing(read_signing_key(key_file), anchor)


def governed(
    arguments: argparse.Namespace, *, resumed: bool = False
) -> tuple[Governing | Steered, Configuration, Report]:
    """Who governs, as --site, --ecms and --state say: the configuration in force, proved, and its proof.

    resumed: what was commanded before holds on.
    """
    registry = Registry(arguments.state)
    if arguments.ecms is None and arguments.site is None and registry.exists:
        governing = Governing(registry, resumed=resumed)
        return governing, governing.configuration()[1], governing.report
    site = arguments.site or reference_site()
    configuration, report = prove([arguments.ecms or Path("ecms")], site, certified=True)
    return Steered(configuration, registry, resumed=resumed), configuration, report


def task_meant(
    instruction: str, configuration: Configuration, governor: Governing | Steered, state: Path
) -> Routed:
    """The task that is asked for; where only an installed, inactive module has it, RoutingError says so."""
    others = Registry(state).inactive if isinstance(governor, Governing) else dict[str, Ecm]
    return route(instruction, configuration.modules, others)


@contextmanager
def isolated_skills(configuration: Configuration) -> Iterator[SkillRuns]:
    """Where skill code runs; refuses before anything starts where this host isolates too little."""
    with SkillRuns(configuration.site, configuration.modules.values()) as skills:
        if skills.refusal is not None:
            raise SkillRefusedError(skills.refusal)
        if skills.warning is not None:
            print(f"aeros: warning: {skills.warning}", file=sys.stderr)
        yield skills


def output_folder(wanted: Path | None, task: str) -> Path:
    """A folder that was not there before, or is empty: one run never mixes with another's record."""
    folder = wanted or Path("runs") / f"{task}-{datetime.now().astimezone():%Y%m%d-%H%M%S-%f}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise PlantRefusedError(f"`{folder}` is not empty; give a new folder with --out")
    except OSError as error:
        raise PlantRefusedError(f"cannot write to `{folder}`: {error.strerror}") from error
    return folder
