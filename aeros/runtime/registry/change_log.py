"""Audit log of registry changes: it decides what is in force; the database is a copy of its last state.

Each change is recorded, signed and durable before it is stored. A change counts if the record right after it
is a closing checkpoint of the robot's key. So a record that somebody without the key appended never counts:
the next writer signs what it finds with a checkpoint that closes nothing. A change that counts and is not
stored, because its process was killed, is stored by whoever reads the registry next.

The newest checkpoint is copied to an anchor beside the folder. So a folder that was deleted, or put back from
a backup, is noticed, and so is an anchor that was deleted.
"""

from __future__ import annotations

import getpass
import os
import socket
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from aeros.files import open_regular
from aeros.runtime.audit.check import CHECKPOINT, ClosedLogCheck, Record
from aeros.runtime.audit.checkpoints import (
    AnchorError,
    SigningConfiguration,
    read_anchor,
)
from aeros.runtime.audit.keys import (
    InvalidKeyError,
    ensure_key,
    find_public_key,
    read_signing_key,
)
from aeros.runtime.audit.log import AuditError, AuditLog
from aeros.runtime.audit.prefix_memory import ResumableVerifier, read_remembered_prefix
from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.operator_block import OperatorBlock
from aeros.runtime.registry.store import InstalledModule, RegistrySnapshot
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.configured import ModuleConfiguration

LOG: Final = "audit.jsonl"
_CHANGE: Final = "registry-change"


def anchor_of(folder: Path) -> Path:
    """Return the path of the anchor of a registry's log, which is outside of the registry's folder.

    Args:
        folder: the registry's folder.

    Returns:
        A path beside the folder.
    """
    return folder.with_name(f"{folder.name}.anchor")


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
            one.name: {
                "version": one.version,
                "digest": one.digest,
                "state": one.state.value,
                **({"configuration": one.configuration.to_json()} if one.configuration else {}),
            }
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
                "channel": one.channel,
                "device": one.device,
            }
            for one in new.blocks.values()
        },
    }
    try:
        # A change counts once the log is closed, so the anchor need not hold the checkpoint before it.
        signing = SigningConfiguration(
            read_signing_key(ensure_key(key)), (anchor_of(folder),), anchors_opening=False
        )
        with AuditLog(folder / LOG, signing=signing) as log:
            log.append(_CHANGE, details)
    except (AuditError, InvalidKeyError) as failure:
        headline = f"the change cannot be recorded as it should be: {failure}"
        raise UserError([Diagnostic("AE965", headline)]) from failure


@dataclass(frozen=True)
class RecordedState:
    """State of the registry as its audit log tells it.

    Attributes:
        latest: state that the latest change led to; an empty one if there is none.
        before: state before that change; None if the log does not have it.
        damage: description of the log's damage; None if it is sound.
        is_signed: True if all changes are signed; False for a log of a release that signed nothing.
    """

    latest: RegistrySnapshot = field(default_factory=RegistrySnapshot)
    before: RegistrySnapshot | None = None
    damage: str | None = None
    is_signed: bool = True

    def disagreement(self, found: RegistrySnapshot) -> str | None:
        """Compare the database with the record.

        Args:
            found: content of the database.

        Returns:
            The difference in words; None if they agree.
        """
        if self.damage is not None:
            return f"its record of changes is damaged: {self.damage}"
        if not self.is_signed:
            return "its record of changes is not signed, so anybody may have written it"
        if found == self.latest:
            return None
        mine, last = found.generation, self.latest.generation
        if mine == last:
            return f"its database differs from the record of change {last}"
        if mine < last:
            older = "the database is an older one, or was lost"
            return f"its database is at change {mine}, and its record at change {last}: {older}"
        return f"its database is at change {mine}, and its record ends at change {last}: records are missing"

    def is_unfinished(self, found: RegistrySnapshot) -> bool:
        """Say if the latest change is recorded and not yet stored.

        Args:
            found: content of the database.

        Returns:
            True if the database is as it was before that change.
        """
        return self.damage is None and self.is_signed and found == self.before and found != self.latest

    def is_complete_for(self, found: RegistrySnapshot) -> bool:
        """Say if the record alone tells which state is in force.

        Args:
            found: content of the database.

        Returns:
            True if the log is sound, and the database holds no change that is not in it.
        """
        return self.damage is None and found.generation <= self.latest.generation


class _Changes:
    """Changes in a log that count; implements `ResumableCheck`."""

    def __init__(self, signatures: ResumableVerifier | None) -> None:
        self._signatures = signatures
        self.premises = ("changes", None if signatures is None else signatures.premises)
        self._recorded: list[tuple[int, RegistrySnapshot]] = []  # since the newest checkpoint
        self._states = {0: RegistrySnapshot()}  # by generation, before the latest change
        self._latest: tuple[int, RegistrySnapshot] | None = None  # from which generation, and to what
        self.has_checkpoint = False
        self.was_closed = False

    def __call__(self, record: Record, own: str) -> str | None:
        problem = None if self._signatures is None else self._signatures(record, own)
        if problem is not None:
            return problem
        if record["event"] == _CHANGE:
            try:
                details = record["details"]
                self._recorded.append((int(details["from"]), _snapshot(details)))
            except (AttributeError, KeyError, TypeError, ValueError):
                return f"record {record['sequence']} is not of the form of a change"
        elif record["event"] == CHECKPOINT:
            is_closing = record["details"].get("closing") is True
            # The first one also signs changes of a release that signed nothing: `aeros repair` wrote it.
            if is_closing or not self.has_checkpoint:
                self._count()
            self.was_closed |= is_closing
            self.has_checkpoint = True
            self._recorded.clear()
        return None

    def copy(self) -> _Changes:
        """Implement `ResumableCheck.copy`."""
        made = _Changes(None if self._signatures is None else self._signatures.copy())
        made._take(self)
        return made

    def resume(self, earlier: _Changes) -> bool:
        """Implement `ResumableCheck.resume`."""
        if self._signatures is not None and (
            earlier._signatures is None or not self._signatures.resume(earlier._signatures)
        ):
            return False
        self._take(earlier)
        return True

    def _take(self, other: _Changes) -> None:
        self._recorded, self._states = list(other._recorded), dict(other._states)
        self._latest = other._latest
        self.has_checkpoint, self.was_closed = other.has_checkpoint, other.was_closed

    def state(self) -> RecordedState:
        """Return the state after the latest change, whose records are sound."""
        is_signed = self.has_checkpoint or not self._recorded
        if not is_signed:
            self._count()
        if self._latest is None:
            return RecordedState()
        began, latest = self._latest
        return RecordedState(latest, self._states.get(began), is_signed=is_signed)

    def _count(self) -> None:
        for change in self._recorded:
            if self._latest is not None:
                self._states[self._latest[1].generation] = self._latest[1]
            self._latest = change


def read_recorded_state(folder: Path, key: Path) -> RecordedState:
    """Read the state of the registry from its audit log.

    Args:
        folder: the registry's folder.
        key: path of the signing key; its public key suffices.

    Returns:
        The state; a last record that a crash cut short does not count.
    """
    try:
        public = find_public_key(key)
        anchor = None if public is None else read_anchor(anchor_of(folder), public)
    except InvalidKeyError as failure:
        return RecordedState(damage=f"{failure}; restore the key from a backup")
    except AnchorError as failure:
        return RecordedState(damage=str(failure))
    signatures = None if public is None else ResumableVerifier(public, () if anchor is None else (anchor,))
    changes = _Changes(signatures)
    try:
        with (folder / LOG).open("rb") as file:
            prefix = read_remembered_prefix(file, folder / LOG, changes)
    except FileNotFoundError:
        if anchor_of(folder).exists():
            return RecordedState(damage=f"it is gone, and `{anchor_of(folder)}` is the anchor of one")
        return RecordedState()
    except OSError as failure:
        return RecordedState(damage=f"it cannot be read: {failure.strerror}")
    damage = prefix.problem if prefix.torn_tail is None else None
    if damage is None and signatures is not None:
        damage = signatures.missing_tail(prefix.records)
    if damage is None and public is None and changes.has_checkpoint:
        damage = f"it is signed, and the key `{key}` is gone; restore it from a backup"
    if damage is None and anchor is None and changes.was_closed:
        # A writer anchors the checkpoint with which it opens the log, before it can close it.
        damage = f"its anchor `{anchor_of(folder)}` is gone, so nothing shows that no record was cut off"
    return changes.state() if damage is None else RecordedState(damage=damage)


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
    listed = _ChangeList()
    with suppress(OSError), open_regular(folder / LOG) as file:
        read_remembered_prefix(file, folder / LOG, listed)
    return listed.changes


class _ChangeList(ClosedLogCheck):
    """List of all changes in a log, counted or not; implements `ResumableCheck`."""

    premises = "list of changes"

    def __init__(self) -> None:
        super().__init__(self._look)
        self.changes: list[tuple[str, RegistrySnapshot]] = []

    def _look(self, record: Record, _: str) -> None:
        if record["event"] == _CHANGE:
            with suppress(AttributeError, KeyError, TypeError, ValueError):
                details = record["details"]
                self.changes.append((str(details["configuration"]), _snapshot(details)))

    def copy(self) -> _ChangeList:
        """Implement `ResumableCheck.copy`."""
        made = _ChangeList()
        made.resume(self)
        return made

    def resume(self, earlier: _ChangeList) -> bool:
        """Implement `ResumableCheck.resume`."""
        self.changes, self._is_closed = list(earlier.changes), earlier._is_closed
        return True


def _snapshot(details: Mapping[str, Any]) -> RegistrySnapshot:
    modules = {
        name: InstalledModule(
            name,
            one["version"],
            one["digest"],
            ModuleState(one["state"]),
            ModuleConfiguration.from_json(one.get("configuration", {})),
        )
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
            one.get("channel"),
            one.get("device"),
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
