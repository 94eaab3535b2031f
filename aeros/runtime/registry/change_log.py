"""Audit log of registry changes: each change is durably recorded before it is made, and marked after.

A record without its change is one whose change was killed, or failed, before it was made: the next record
then begins from the same generation. A change whose record is marked as made is in the database, so a
database without it is an older one.
"""

from __future__ import annotations

import getpass
import os
import socket
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from aeros.runtime.audit.check import Record, read_prefix, verify_log
from aeros.runtime.audit.checkpoints import SigningConfiguration
from aeros.runtime.audit.keys import InvalidKeyError, ensure_key, read_signing_key
from aeros.runtime.audit.log import AuditError, AuditLog
from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.operator_block import OperatorBlock
from aeros.runtime.registry.store import InstalledModule, RegistrySnapshot
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError

LOG: Final = "audit.jsonl"
_CHANGE: Final = "registry-change"
_MADE: Final = "registry-change-made"


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
        "policy_set": new.is_policy_set,
        "withdrawn": sorted(new.withdrawn),
        "modules": {
            one.name: {"version": one.version, "digest": one.digest, "state": one.state.value}
            for one in new.modules.values()
        },
        "blocks": {
            one.id: {
                "reason": one.reason,
                "module": one.module,
                "skill": one.skill,
                "action": one.action,
                "version": one.version,
                "digest": one.digest,
            }
            for one in new.blocks.values()
        },
    }
    _append(folder, key, _CHANGE, details, "the change cannot be recorded, so it is not made")


def record_made(folder: Path, key: Path, generation: int) -> UserError | None:
    """Mark the latest recorded change as made; signed if there is a key.

    Args:
        folder: the registry's folder, which holds the log.
        key: path of the signing key; need not exist.
        generation: generation that the change led to.

    Returns:
        The error if that cannot be recorded; the change is in force all the same.
    """
    try:
        _append(
            folder,
            key,
            _MADE,
            {"to": generation},
            "the change is in force, but its record cannot be completed",
        )
    except UserError as unrecorded:
        return unrecorded
    return None


def _append(folder: Path, key: Path, event: str, details: Mapping[str, Any], problem: str) -> None:
    try:
        signing = SigningConfiguration(read_signing_key(ensure_key(key)))
        with AuditLog(folder / LOG, signing=signing) as log:
            log.append(event, details)
    except (AuditError, InvalidKeyError) as failure:
        raise UserError([Diagnostic("AE965", f"{problem}: {failure}")]) from failure


@dataclass(frozen=True)
class RecordedState:
    """State of the registry as its audit log tells it.

    Attributes:
        latest: state that the latest recorded change led to; an empty one if there is none.
        is_made: True if that change is known to have been made.
        before: state before that change; None if the log does not have it.
        damage: description of the log's damage; None if it is sound.
    """

    latest: RegistrySnapshot
    is_made: bool
    before: RegistrySnapshot | None
    damage: str | None = None

    def disagreement(self, found: RegistrySnapshot) -> str | None:
        """Compare the database with the record.

        Args:
            found: content of the database.

        Returns:
            The difference in words; None if they agree.
        """
        if self.damage is not None:
            return f"its record of changes is damaged: {self.damage}"
        if found == self.latest or (not self.is_made and found == self.before):
            return None
        mine, last = found.generation, self.latest.generation
        if mine == last:
            return f"its database differs from the record of change {last}"
        if mine < last:
            older = "the database is an older one, or was lost"
            return f"its database is at change {mine}, and its record at change {last}: {older}"
        return f"its database is at change {mine}, and its record ends at change {last}: records are missing"

    def is_complete_for(self, found: RegistrySnapshot) -> bool:
        """Say if the record alone tells which state is in force.

        Args:
            found: content of the database.

        Returns:
            True if the log is sound, and the database holds no change that is not in it.
        """
        return self.damage is None and found.generation <= self.latest.generation


def read_recorded_state(folder: Path) -> RecordedState:
    """Read the state of the registry from its audit log.

    Args:
        folder: the registry's folder.

    Returns:
        The state; a last record that a crash cut short does not count.
    """
    states = {0: RegistrySnapshot()}  # before the latest change, by generation
    latest: list[tuple[int, RegistrySnapshot]] = []  # the latest change: from which generation, and to what
    made: set[int] = set()

    def look(record: Record, _: str) -> str | None:
        details = record["details"]
        try:
            if record["event"] == _CHANGE:
                states.update((one.generation, one) for _, one in latest)
                latest[:] = [(details["from"], _snapshot(details))]
                made.discard(details["to"])
            elif record["event"] == _MADE:
                made.add(details["to"])
        except (AttributeError, KeyError, TypeError, ValueError):
            return f"record {record['sequence']} is not of the form of a change"
        return None

    try:
        with (folder / LOG).open("rb") as file:
            prefix = read_prefix(file, look)
    except FileNotFoundError:
        return RecordedState(RegistrySnapshot(), is_made=True, before=None)
    except OSError as failure:
        return RecordedState(RegistrySnapshot(), True, None, f"it cannot be read: {failure.strerror}")
    damage = prefix.problem if prefix.torn_tail is None else None
    if not latest:
        return RecordedState(RegistrySnapshot(), True, None, damage)
    ((began, found),) = latest
    return RecordedState(found, found.generation in made, states.get(began), damage)


def recorded_configurations(folder: Path) -> dict[str, RegistrySnapshot]:
    """Read all configurations of installed modules that recorded changes led to.

    Args:
        folder: the registry's folder.

    Returns:
        Snapshot by digest of the configuration; the newest if there are several.
    """
    return dict(recorded_changes(folder))


def recorded_changes(folder: Path) -> list[tuple[str, RegistrySnapshot]]:
    """Read all recorded changes.

    A log that is not sound is read up to its first bad record: a snapshot is verified later, by its digest.

    Args:
        folder: the registry's folder.

    Returns:
        For each change, in order, the digest of the configuration of installed modules, and the snapshot.
    """
    changes: list[tuple[str, RegistrySnapshot]] = []

    def look(record: Record, _: str) -> None:
        if record["event"] == _CHANGE:
            with suppress(AttributeError, KeyError, TypeError, ValueError):
                details = record["details"]
                changes.append((str(details["configuration"]), _snapshot(details)))

    verify_log(folder / LOG, look)
    return changes


def _snapshot(details: Mapping[str, Any]) -> RegistrySnapshot:
    modules = {
        name: InstalledModule(name, one["version"], one["digest"], ModuleState(one["state"]))
        for name, one in details["modules"].items()
    }
    blocks = {
        id_: OperatorBlock(
            id_,
            one["reason"],
            one["module"],
            one["skill"],
            one["action"],
            one.get("version"),
            one.get("digest"),
        )
        for id_, one in details["blocks"].items()
    }
    # Version 2 of the registry had neither: a policy counts as set.
    is_set, withdrawn = details.get("policy_set", True), details.get("withdrawn", ())
    return RegistrySnapshot(
        details["to"], details["policy"], modules, blocks, bool(is_set), frozenset(withdrawn)
    )


def _operator_identity() -> dict[str, Any]:
    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a user id without a name
        user = str(os.getuid())
    return {"user": user, "host": socket.gethostname(), "pid": os.getpid()}
