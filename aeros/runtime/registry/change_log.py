"""The audit record of changes: each is in it, durably, before it is kept.

A record without the change that it tells of is one that was killed, or failed, before it was kept: the
next record then begins from the same generation.
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
from aeros.runtime.audit.keys import InvalidKeyError, read_signing_key
from aeros.runtime.audit.log import AuditError, AuditLog
from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.store import InstalledModule, RegistrySnapshot
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.model import OperatorOverride

LOG: Final = "audit.jsonl"
_CHANGE: Final = "registry-change"


def record_change(
    folder: Path, key: Path, old: RegistrySnapshot, new: RegistrySnapshot, said: str, configuration: str
) -> None:
    """Append to the log in `folder` that `old` is to become `new`; signed if there is a key.

    configuration: the digest of what was proved.
    Raises `UserError` where it cannot be recorded; then there must be no change.
    """
    details = {
        "change": said,
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
        signing = SigningConfiguration(read_signing_key(key)) if key.exists() else None
        with AuditLog(folder / LOG, signing=signing) as log:
            log.append(_CHANGE, details)
    except (AuditError, InvalidKeyError) as failure:
        problem = Diagnostic("AE965", f"the change cannot be recorded, so it is not made: {failure}")
        raise UserError([problem]) from failure


def recorded_configurations(folder: Path) -> dict[str, RegistrySnapshot]:
    """By the digest of the configuration, what the changes in the log made; of several the newest.

    A log that is not sound is read up to there: what comes of a snapshot is known by its digest.
    """
    found: dict[str, RegistrySnapshot] = {}

    def look(record: Record, own: str) -> None:
        if record["event"] == _CHANGE:
            with suppress(AttributeError, KeyError, TypeError, ValueError):
                details = record["details"]
                found[str(details["configuration"])] = _snapshot(details)

    verify_log(folder / LOG, look)
    return found


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
    except (KeyError, OSError):  # a number that has no name here
        user = str(os.getuid())
    return {"user": user, "host": socket.gethostname(), "pid": os.getpid()}
