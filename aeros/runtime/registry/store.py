"""Database of the registry, in one SQLite file; each change is one transaction.

Rollback journal, `synchronous = EXTRA`: after kill -9 or a power cut at any instant, opening the file gives
the state before the change or the state after it. A refused change writes nothing.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from aeros.runtime.registry.lifecycle import ModuleState
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.migrations.formats import REGISTRY
from aeros.spec.model.policy import OperatorOverride

_VERSION: Final = REGISTRY.version
_CURE: Final = "restore it from a backup, or remove its folder and install again"
_SCHEMA: Final = (
    "CREATE TABLE policy (only INTEGER PRIMARY KEY CHECK (only = 1), generation INTEGER NOT NULL, "
    "site TEXT NOT NULL) STRICT",
    "CREATE TABLE modules (name TEXT PRIMARY KEY, version TEXT NOT NULL, digest TEXT NOT NULL, "
    "folder TEXT NOT NULL, state TEXT NOT NULL) STRICT",
    "CREATE TABLE blocks (id TEXT PRIMARY KEY, reason TEXT NOT NULL, module TEXT, skill TEXT, "
    "action TEXT) STRICT",
    f"PRAGMA user_version = {_VERSION}",
)


@dataclass(frozen=True)
class InstalledModule:
    """A module that is installed on this robot.

    Attributes:
        name: id of the module.
        version: its version.
        digest: SHA-256 over all its files.
        folder: folder of the files, relative to the registry's folder.
        state: state in its life cycle.
    """

    name: str
    version: str
    digest: str
    folder: str
    state: ModuleState

    @classmethod
    def from_digest(cls, name: str, version: str, digest: str, state: ModuleState) -> InstalledModule:
        """Make an entry for a module stored in the folder of its digest.

        Args:
            name: id of the module.
            version: its version.
            digest: SHA-256 over all its files.
            state: state in its life cycle.

        Returns:
            The entry.
        """
        return cls(name, version, digest, f"modules/{digest}/{name}", state)


@dataclass(frozen=True)
class RegistrySnapshot:
    """Content of the registry at one time.

    Attributes:
        generation: number of changes so far; 0 for an empty registry.
        site: the policy's file, relative to the registry's folder; empty if there is none.
        modules: installed modules by name.
        blocks: operator overrides by id.
    """

    generation: int = 0
    site: str = ""
    modules: Mapping[str, InstalledModule] = field(default_factory=dict)
    blocks: Mapping[str, OperatorOverride] = field(default_factory=dict)


class RegistryStore:
    """Registry database in a folder."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "registry.sqlite3"

    def read(self) -> RegistrySnapshot:
        """Read the registry.

        Returns:
            Its content; an empty snapshot if nothing was ever stored.

        Raises:
            UserError: the database is damaged or has another version.
        """
        with self._open() as database:
            if database is None:
                return RegistrySnapshot()
            database.execute(
                "BEGIN"
            )  # a change of another process meanwhile is seen as a whole, or not at all
            policy = database.execute("SELECT generation, site FROM policy").fetchone()
            modules = database.execute(
                "SELECT name, version, digest, folder, state FROM modules ORDER BY name"
            ).fetchall()
            blocks = database.execute(
                "SELECT id, reason, module, skill, action FROM blocks ORDER BY id"
            ).fetchall()
        try:
            generation, site = policy
            kept = {
                row[0]: InstalledModule(row[0], row[1], row[2], row[3], ModuleState(row[4]))
                for row in modules
            }
        except (TypeError, ValueError) as failure:
            raise self._damaged(str(failure)) from failure
        return RegistrySnapshot(generation, site, kept, {row[0]: OperatorOverride(*row) for row in blocks})

    def replace(self, new: RegistrySnapshot) -> None:
        """Replace the content atomically.

        Args:
            new: content from now on.

        Raises:
            UserError: the database cannot be written, is damaged or has another version.
        """
        with self._open(create=True) as database:
            if database is None:
                raise self._damaged("it cannot be created")
            database.execute("BEGIN IMMEDIATE")
            if _is_new(database):
                for statement in _SCHEMA:
                    database.execute(statement)
            for table in ("policy", "modules", "blocks"):
                database.execute(f"DELETE FROM {table}")  # noqa: S608
            database.execute("INSERT INTO policy VALUES (1, ?, ?)", (new.generation, new.site))
            modules = [(m.name, m.version, m.digest, m.folder, m.state.value) for m in new.modules.values()]
            database.executemany("INSERT INTO modules VALUES (?, ?, ?, ?, ?)", modules)
            blocks = [(b.id, b.reason, b.module, b.skill, b.action) for b in new.blocks.values()]
            database.executemany("INSERT INTO blocks VALUES (?, ?, ?, ?, ?)", blocks)
            database.execute("COMMIT")

    @contextmanager
    def _open(self, *, create: bool = False) -> Iterator[sqlite3.Connection | None]:
        """Open the database; yield None if it is empty and is not to be created."""
        # Opened for writing even to read: a killed change must be rolled back first.
        if not create and not self.path.exists():
            yield None
            return
        try:
            mode = "rwc" if create else "rw"
            database = sqlite3.connect(
                f"{self.path.absolute().as_uri()}?mode={mode}", uri=True, timeout=10.0, isolation_level=None
            )
        except sqlite3.Error as failure:
            raise self._damaged(str(failure)) from failure
        try:
            database.execute("PRAGMA synchronous = EXTRA")
            version = database.execute("PRAGMA user_version").fetchone()[0]
            if version not in (_VERSION, 0) or (version == 0 and not _is_new(database)):
                raise self._other_version(version)
            yield database if create or version == _VERSION else None
        except sqlite3.Error as failure:
            raise self._damaged(str(failure)) from failure
        finally:
            database.close()

    def _other_version(self, version: int) -> UserError:
        if version == 0:
            return self._damaged("it is not a database of this kind")
        return self._damaged(*REGISTRY.refusal(version, self.path))

    def _damaged(self, reason: str, cure: str = _CURE) -> UserError:
        headline = f"the registry `{self.path}` cannot be used: {reason}"
        return UserError([Diagnostic("AE965", headline, help=(cure,))])


def _is_new(database: sqlite3.Connection) -> bool:
    return bool(database.execute("SELECT count(*) = 0 FROM sqlite_schema").fetchone()[0])
