"""Audit log of registry changes: each change is durably recorded before it is made.

A record without its change is one whose change was killed, or failed, before it was made: the next record
then begins from the same generation.
"""

from __future__ import annotations

import getpass
import os
import socket
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from aeros.runtime.audit.check import Record, verify_log
from aeros.runtime.audit.checkpoints import SigningConfiguration
from aeros.runtime.audit.keys import InvalidKeyError, ensure_key, read_signing_key
from aeros.runtime.audit.log import AuditError, AuditLog
from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.store import InstalledModule, RegistrySnapshot
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.policy import OperatorOverride

LOG: Final = "audit.jsonl"
_CHANGE: Final = "registry-change"


def record_change(
    folder: Path,
    key: Path,
    old: RegistrySnapshot,
    new: RegistrySnapshot,
    description: str,
    configuration: str,
) -> None:
    """Record that the registry is about to change, signed.

    Args:
        folder: the registry's folder, which holds the log.
        key: path of the signing key; made if it does not exist.
        old: registry before the change.
        new: registry after it.
        description: the change in words.
        configuration: digest of the proved configuration.

    Raises:
        UserError: it cannot be recorded; then the change must not be made.
    """
    details = {
        "change": description,
        "by": _operator_identity(),
        "from": old.generation,
        "to": new.generation,
        "configuration": configuration,
        "policy": new.site,
        "modules": {
            one.name: {"version": one.version, "digest": one.digest, "state": one.state.value}
            for one in new.modules.values()
        },
        "blocks": {
            one.id: {"reason": one.reason, "module": one.module, "skill": one.skill, "action": one.action}
            for one in new.blocks.values()
        },
    }
    try:
        signing = SigningConfiguration(read_signing_key(ensure_key(key)))
        with AuditLog(folder / LOG, signing=signing) as log:
            log.append(_CHANGE, details)
    except (AuditError, InvalidKeyError) as failure:
        problem = Diagnostic("AE965", f"the change cannot be recorded, so it is not made: {failure}")
        raise UserError([problem]) from failure


def recorded_configurations(folder: Path) -> dict[str, RegistrySnapshot]:
    """Read all configurations that recorded changes led to.

    A log that is not sound is read up to its first bad record: a snapshot is verified later, by its digest.

    Args:
        folder: the registry's folder.

    Returns:
        Snapshot by digest of the configuration; the newest if there are several.
    """
    snapshots: dict[str, RegistrySnapshot] = {}

    def look(record: Record, own: str) -> None:
        if record["event"] == _CHANGE:
            with suppress(AttributeError, KeyError, TypeError, ValueError):
                details = record["details"]
                snapshots[str(details["configuration"])] = _snapshot(details)

    verify_log(folder / LOG, look)
    return snapshots


def _snapshot(details: Mapping[str, Any]) -> RegistrySnapshot:
    modules = {
        name: InstalledModule.from_digest(name, one["version"], one["digest"], ModuleState(one["state"]))
        for name, one in details["modules"].items()
    }
    blocks = {
        id_: OperatorOverride(id_, one["reason"], one["module"], one["skill"], one["action"])
        for id_, one in details["blocks"].items()
    }
    return RegistrySnapshot(details["to"], details["policy"], modules, blocks)


def _operator_identity() -> dict[str, Any]:
    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a user id without a name
        user = str(os.getuid())
    return {"user": user, "host": socket.gethostname(), "pid": os.getpid()}
