"""The first steps of a session: governor and proof, signing key, task, isolation of skills, output folder."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from types import MappingProxyType
from typing import Final

from aeros.agent.errors import AgentError
from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.refusals import (
    AmbiguousInstructionError,
    InactiveTaskError,
    InstructionError,
    NothingAskedError,
)
from aeros.agent.instructions.understand import understand
from aeros.agent.world.values import to_exact
from aeros.files import make_private_folder
from aeros.runtime.audit.checkpoints import AnchorError, SigningConfiguration
from aeros.runtime.audit.keys import (
    InvalidKeyError,
    SigningKey,
    ensure_key,
    lost_key_error,
    read_signing_key,
)
from aeros.runtime.audit.log import AuditError
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.isolation.run_factory import SkillRunFactory
from aeros.runtime.registry.folder_modules import (
    FolderModules,
    default_modules,
    uses_installed_modules,
)
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.registry_governor import RegistryGovernor
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.session.bag import BagOutputError
from aeros.session.plant_factory import PlantSetupError
from aeros.sim.symbolic.state import initial_values
from aeros.spec.consequences.start_values import with_defined_predicates
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.expr.semantics import Value
from aeros.spec.model.configured import ModuleConfiguration
from aeros.spec.model.ecm import Ecm, Task
from aeros.spec.model.site import Site
from aeros.spec.verification.reports import Report

AUDIT: Final = "audit.jsonl"
"""The audit log's name in the folder of a run."""

KEY: Final = "audit.key"
"""The name of the key that signs audit logs in an agent's folder."""

ANCHORS: Final = "anchors"
"""The name of the folder, in an agent's folder, of the anchors of its logs."""

SETUP_ERRORS: Final = (
    AgentError,
    PlantSetupError,
    SkillRefusedError,
    AuditError,
    AnchorError,
    BagOutputError,
    InvalidKeyError,
)
"""Exceptions whose message says why a session cannot be set up or continued."""


def default_anchor(state: Path, out: Path) -> Path:
    """Return the path of the anchor that an agent keeps for the log of a run.

    Args:
        state: The agent's state folder.
        out: The folder of the run.

    Returns:
        A path in the state folder, of its own for each folder of a run.
    """
    place = out.resolve()
    return state / ANCHORS / f"{place.name}-{hashlib.sha256(bytes(place)).hexdigest()[:12]}.anchor"


def find_signing_key(state: Path, key_file: Path | None = None) -> SigningKey:
    """Read the key that signs the audit logs of an agent; its first run makes it.

    Args:
        state: The agent's state folder.
        key_file: The private key, as `aeros audit keygen` writes it; None for that of the agent.

    Returns:
        The key.

    Raises:
        InvalidKeyError: The key cannot be made, read or used; or the agent has signed logs, and lost its key.
    """
    if key_file is not None:
        return read_signing_key(key_file)
    path = state / KEY
    anchor = None if path.exists() else next((state / ANCHORS).glob("*.anchor"), None)
    if anchor is not None:
        raise lost_key_error(path, f"`{anchor}` belongs to a log that it signed")
    return read_signing_key(ensure_key(path))


def build_signing(
    key: SigningKey, state: Path, out: Path, anchors: Sequence[Path] = ()
) -> SigningConfiguration:
    """Name the anchors of a run, beginning with the agent's own.

    An anchor that an earlier run left for a folder of the same name is deleted if there is no log in it.

    Args:
        key: Signs the log.
        state: The agent's state folder.
        out: The folder of the run.
        anchors: Further files for the newest signature, beside the agent's own.

    Returns:
        Key and anchors.

    Raises:
        InvalidKeyError: The folder of the anchors cannot be written.
    """
    own = default_anchor(state, out)
    try:
        make_private_folder(own.parent)
        if not (out / AUDIT).exists():
            own.unlink(missing_ok=True)
    except OSError as error:
        raise InvalidKeyError(f"`{own.parent}` cannot be written: {error.strerror}") from error
    return SigningConfiguration(key, (own, *anchors))


def open_governor(
    state: Path,
    modules: Sequence[Path] | None,
    site: Path | None,
    *,
    resumed: bool = False,
    configurations: Mapping[str, ModuleConfiguration] = MappingProxyType({}),
) -> tuple[RegistryGovernor, Configuration, Report]:
    """Prove the configuration and open the governor that follows its changes.

    Whatever modules a run uses, the registry of its state folder governs it: blocks, withdrawn modules and
    the operator's policy.

    Args:
        state: The agent's state folder, with the registry of installed modules if there is one.
        modules: Folders of the modules to load; None for those active in the registry, or else `ecms`.
        site: The site file; None for the policy in force in the registry, or else the reference site.
        resumed: True if a stop that was commanded before this session still holds.
        configurations: Settings of modules of a folder, by module.

    Returns:
        The governor, a context manager that the caller enters; the configuration in force; its report.

    Raises:
        UserError: A file is rejected, a certificate is missing or not current, or the operator has put
            another policy in force or withdrawn all the modules.
    """
    registry = Registry(state)
    source = None
    if modules is not None or site is not None or not uses_installed_modules(registry):
        source = FolderModules(modules or default_modules(), site, registry, configurations=configurations)
    elif configurations:
        name, settings = next(iter(configurations.items()))
        help_ = f"`aeros configure {name}` binds and sets those of installed modules"
        headline = f"the run uses installed modules, so `{settings}` cannot be given to it"
        raise UserError([Diagnostic("AE960", headline, help=(help_,))])
    governor = RegistryGovernor(registry, source, resumed=resumed)
    configuration = governor.configuration()[1]
    if governor.withheld and not configuration.modules:
        governor.close()
        raise _nothing_to_run_error(governor.withheld)
    return governor, configuration, governor.report


def _nothing_to_run_error(withheld: Mapping[str, str]) -> UserError:
    reasons = "; ".join(f"{reason} on this robot" for reason in withheld.values())
    cures = tuple(f"`aeros activate {name}` puts the installed `{name}` in force" for name in withheld)
    return UserError([Diagnostic("AE960", f"there is nothing to run: {reasons}", help=cures)])


def understand_instruction(
    instruction: str, configuration: Configuration, governor: RegistryGovernor
) -> Understanding:
    """Understand an instruction whole, with the words of the active modules.

    Args:
        instruction: The user's words.
        configuration: The active modules.
        governor: Governor of the run; its inactive modules are searched for a hint.

    Returns:
        The tasks that it asks for, in order.

    Raises:
        NearlyUnderstoodError: It is not understood, but without a phrase of it.
        InstructionError: A part is not understood; the message says if an inactive module has the task.
    """
    try:
        return understand(instruction, configuration.modules, governor.inactive_modules)
    except (AmbiguousInstructionError, InactiveTaskError, NothingAskedError):
        raise
    except InstructionError as refusal:
        from aeros.agent.reading.nearest import NearlyUnderstoodError, nearest_reading

        nearest = nearest_reading(instruction, configuration.modules)
        if nearest is None:
            raise
        raise NearlyUnderstoodError(refusal, nearest) from refusal


def declared_start(site: Site, task: Task | None, modules: Iterable[Ecm]) -> dict[str, Value]:
    """Compute the values at the declared start of a task, as the symbolic plant starts from them.

    Args:
        site: The site whose state variables have values.
        task: The task; None for one that declares nothing.
        modules: The modules, whose definitions decide predicates that the task does not state.

    Returns:
        Exact values of all state variables, by name.
    """
    definitions = {name: one for ecm in modules for name, one in ecm.definitions.items()}
    initial = with_defined_predicates({} if task is None else to_doubles(task.start), definitions)
    return {name: to_exact(site.state[name], value) for name, value in initial_values(site, initial).items()}


@contextmanager
def open_isolated_skills(
    configuration: Configuration, warn: Callable[[str], None]
) -> Iterator[SkillRunFactory]:
    """Start the processes in which skill code runs, isolated as the site says; they end with the block.

    Args:
        configuration: The site and the modules whose skills run.
        warn: Called with a text if this host isolates less than the site wants and the site allows that.

    Yields:
        The factory of skill runs.

    Raises:
        SkillRefusedError: This host isolates less than the site requires.
    """
    with SkillRunFactory(configuration.site, configuration.modules.values()) as skills:
        if skills.unavailable_reason is not None:
            raise SkillRefusedError(skills.unavailable_reason)
        if skills.weakness_warning is not None:
            warn(skills.weakness_warning)
        yield skills


def create_output_folder(folder: Path | None, task: str) -> Path:
    """Create the folder that a run writes to, so that one run never mixes with the log of another.

    Args:
        folder: The folder, new or empty; None for one in `runs/`, named for `task` and the time.
        task: The id of the task.

    Returns:
        The folder, which exists, is empty, and is for its owner alone.

    Raises:
        PlantSetupError: The folder is not empty or cannot be written.
    """
    folder = folder or Path("runs") / f"{task}-{datetime.now().astimezone():%Y%m%d-%H%M%S-%f}"
    try:
        if folder.is_dir() and any(folder.iterdir()):
            raise PlantSetupError(f"`{folder}` is not empty; give a new folder with --out")
        make_private_folder(folder)
    except OSError as error:
        raise PlantSetupError(f"cannot write to `{folder}`: {error.strerror}") from error
    return folder
