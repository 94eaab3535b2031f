"""Database of the registry, in one SQLite file; each change is one transaction.

Rollback journal, `synchronous = EXTRA`: after kill -9 or a power cut at any instant, opening the file gives
the state before the change or the state after it. A refused change writes nothing.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import astuple, dataclass, field
from pathlib import Path
from typing import Final

from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.operator_block import OperatorBlock
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.migrations.formats import REGISTRY
from aeros.spec.model.configured import UNCONFIGURED, ModuleConfiguration

_VERSION: Final = REGISTRY.version
_CURE: Final = "run `aeros repair`, which puts the last recorded change in force again"
_SCHEMA: Final = (
    "CREATE TABLE policy (only INTEGER PRIMARY KEY CHECK (only = 1), generation INTEGER NOT NULL, "
    "site TEXT NOT NULL, is_set INTEGER NOT NULL, withdrawn TEXT NOT NULL) STRICT",
    "CREATE TABLE modules (name TEXT PRIMARY KEY, version TEXT NOT NULL, digest TEXT NOT NULL, "
    "folder TEXT NOT NULL, state TEXT NOT NULL, configuration TEXT NOT NULL) STRICT",
    "CREATE TABLE blocks (id TEXT PRIMARY KEY, reason TEXT NOT NULL, module TEXT, skill TEXT, "
    "action TEXT, version TEXT, digest TEXT, channel TEXT, device TEXT) STRICT",
    f"PRAGMA user_version = {_VERSION}",
)
_UPGRADES: Final = {
    # Version 2 did not say if a policy was set by the operator: it counts as set.
    2: (
        "ALTER TABLE policy ADD COLUMN is_set INTEGER NOT NULL DEFAULT 1",
        "ALTER TABLE policy ADD COLUMN withdrawn TEXT NOT NULL DEFAULT '[]'",
        "ALTER TABLE blocks ADD COLUMN version TEXT",
        "ALTER TABLE blocks ADD COLUMN digest TEXT",
    ),
    3: ("ALTER TABLE modules ADD COLUMN configuration TEXT NOT NULL DEFAULT '{}'",),
    4: ("ALTER TABLE blocks ADD COLUMN channel TEXT", "ALTER TABLE blocks ADD COLUMN device TEXT"),
}
"""Statements that lead from a version to the next."""


@dataclass(frozen=True)
class InstalledModule:
    """A module that is installed on this robot.

    Attributes:
        name: id of the module.
        version: its version.
        digest: SHA-256 over all its files.
        state: state in its life cycle.
        configuration: bindings and parameters that the operator set.
    """

    name: str
    version: str
    digest: str
    state: ModuleState
    configuration: ModuleConfiguration = UNCONFIGURED

    @property
    def folder(self) -> str:
        """Folder of the files, relative to the registry's folder."""
        return f"modules/{self.digest}/{self.name}"


@dataclass(frozen=True)
class RegistrySnapshot:
    """Content of the registry at one time.

    Attributes:
        generation: number of changes so far; 0 for an empty registry.
        site: the policy's file, relative to the registry's folder; empty if there is none.
        modules: installed modules by name.
        blocks: the operator's blocks by id.
        is_policy_set: True if the operator set the policy; otherwise it is a copy of the reference site.
        withdrawn: modules that were deactivated or removed, and not activated since.
    """

    generation: int = 0
    site: str = ""
    modules: Mapping[str, InstalledModule] = field(default_factory=dict)
    blocks: Mapping[str, OperatorBlock] = field(default_factory=dict)
    is_policy_set: bool = False
    withdrawn: frozenset[str] = frozenset()

    @property
    def configurations(self) -> dict[str, ModuleConfiguration]:
        """Settings of each installed module that has any, by name."""
        return {name: one.configuration for name, one in self.modules.items() if one.configuration}


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
            policy = database.execute("SELECT * FROM policy").fetchone()
            modules = database.execute("SELECT * FROM modules ORDER BY name").fetchall()
            blocks = database.execute("SELECT * FROM blocks ORDER BY id").fetchall()
        if policy is None:
            raise self._damaged("it holds no policy")
        try:
            # Version 2 has neither of the last two, and version 3 no configuration of a module.
            _, generation, site, is_set, withdrawn = (*policy, 1, "[]")[:5]
            kept = {row[0]: self._module(*row) for row in modules}
            return RegistrySnapshot(
                generation,
                site,
                kept,
                {row[0]: OperatorBlock(*row) for row in blocks},
                bool(is_set),
                frozenset(json.loads(withdrawn)),
            )
        except (TypeError, ValueError) as failure:
            raise self._damaged(str(failure)) from failure

    def _module(
        self, name: str, version: str, digest: str, folder: str, state: str, configuration: str = "{}"
    ) -> InstalledModule:
        settings = ModuleConfiguration.from_json(json.loads(configuration))
        one = InstalledModule(name, version, digest, ModuleState(state), settings)
        if folder != one.folder:
            raise self._damaged(f"`{name}` is in `{folder}`, and not in `{one.folder}`")
        return one

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
            else:
                for version in range(_version_of(database), _VERSION):
                    for statement in _UPGRADES[version]:
                        database.execute(statement)
                database.execute(f"PRAGMA user_version = {_VERSION}")
            for table in ("policy", "modules", "blocks"):
                database.execute(f"DELETE FROM {table}")  # noqa: S608
            database.execute(
                "INSERT INTO policy VALUES (1, ?, ?, ?, ?)",
                (new.generation, new.site, int(new.is_policy_set), json.dumps(sorted(new.withdrawn))),
            )
            modules = [
                (m.name, m.version, m.digest, m.folder, m.state.value, json.dumps(m.configuration.to_json()))
                for m in new.modules.values()
            ]
            database.executemany("INSERT INTO modules VALUES (?, ?, ?, ?, ?, ?)", modules)
            blocks = [astuple(block) for block in new.blocks.values()]
            database.executemany("INSERT INTO blocks VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", blocks)
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
            is_new = _is_new(database)  # read first: another process may create the tables meanwhile
            version = _version_of(database)
            if version not in (_VERSION, *_UPGRADES, 0) or (version == 0 and not is_new):
                raise self._other_version(version)
            yield database if create or version != 0 else None
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


def _version_of(database: sqlite3.Connection) -> int:
    return int(database.execute("PRAGMA user_version").fetchone()[0])


def _is_new(database: sqlite3.Connection) -> bool:
    return bool(database.execute("SELECT count(*) = 0 FROM sqlite_schema").fetchone()[0])
