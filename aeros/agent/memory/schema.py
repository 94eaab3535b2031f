"""Database schema of the memory, and migrations from older versions.

The version is in `PRAGMA user_version`. All migrations that are due, and the version that they lead to, are
one transaction: after a crash the database has the old schema or the new one. A new memory is written as a
whole and then renamed, so a file without tables was cut off, and is refused.
"""

from __future__ import annotations

import sqlite3
from contextlib import closing, suppress
from functools import cache
from pathlib import Path
from typing import Final

from aeros.agent.errors import AgentError
from aeros.files import PRIVATE_FILE, replace_durably
from aeros.spec.migrations.formats import MEMORY
from aeros.spec.migrations.renamed_names import RENAMED_EVENTS

_MIGRATION_1: Final = (
    """CREATE TABLE sessions (
  id INTEGER PRIMARY KEY, agent TEXT NOT NULL, number INTEGER NOT NULL, began TEXT NOT NULL, ended TEXT
) STRICT""",
    """CREATE TABLE episodes (
  id INTEGER PRIMARY KEY, session INTEGER NOT NULL REFERENCES sessions, task TEXT NOT NULL,
  module TEXT NOT NULL, skill TEXT NOT NULL, role TEXT NOT NULL, inputs TEXT NOT NULL,
  started REAL NOT NULL, before TEXT NOT NULL,
  status TEXT, outcome TEXT, failed INTEGER, reason TEXT, ended REAL, after TEXT
) STRICT""",
    "CREATE INDEX episodes_of_skill ON episodes (module, skill)",
    """CREATE TABLE events (
  id INTEGER PRIMARY KEY, session INTEGER NOT NULL REFERENCES sessions, time REAL NOT NULL,
  kind TEXT NOT NULL, details TEXT NOT NULL
) STRICT""",
    """CREATE TABLE facts (
  key TEXT PRIMARY KEY, value TEXT NOT NULL, source TEXT NOT NULL, learned TEXT NOT NULL
) STRICT""",
)

# `context`: NULL where it is not known, so that the episode is evidence in no context.
# `counts`: whether the ending says how good the skill is.  Of a denial, schema 1 did not keep whether it
# could have passed by waiting, so old denials do not count.
_MIGRATION_2: Final = (
    "ALTER TABLE episodes ADD COLUMN context TEXT",
    "ALTER TABLE episodes ADD COLUMN counts INTEGER",
    """UPDATE episodes SET counts = status IN ('finished', 'stopped', 'timed_out', 'raised')
  WHERE status IS NOT NULL""",
    "DROP INDEX episodes_of_skill",
    "CREATE INDEX episodes_that_count ON episodes (module, skill, counts, context, failed)",
)

# `causes`: why the step failed, as data; NULL where only the reason in words was kept.
_MIGRATION_3: Final = ("ALTER TABLE episodes ADD COLUMN causes TEXT",)

_MIGRATION_4: Final = tuple(
    f"UPDATE events SET kind = '{new}' WHERE kind = '{old}'"  # noqa: S608  names of ours
    for old, new in RENAMED_EVENTS.items()
)

# `plant` and `code`: results and durations on another plant, or of other code, are no evidence. NULL where
# they were not kept, so that no such episode is evidence.
_MIGRATION_5: Final = (
    "ALTER TABLE sessions ADD COLUMN plant TEXT",
    "ALTER TABLE episodes ADD COLUMN code TEXT",
    "CREATE INDEX episodes_of_context ON episodes (context, counts)",
)

# What was seen: the first and the latest value of each variable in each session.
_MIGRATION_6: Final = (
    """CREATE TABLE sightings (
  session INTEGER NOT NULL REFERENCES sessions, variable TEXT NOT NULL, first_value TEXT NOT NULL,
  value TEXT NOT NULL, time REAL NOT NULL, seen TEXT NOT NULL, source TEXT, uncertainty REAL,
  PRIMARY KEY (session, variable)
) STRICT""",
)

# `derived_from`: the variables that an attribute of a thing follows from, as a JSON list, so that it is
# forgotten with them; NULL for variables, and where it was not kept.
_MIGRATION_7: Final = ("ALTER TABLE sightings ADD COLUMN derived_from TEXT",)

_MIGRATIONS: Final = (
    *(_MIGRATION_1, _MIGRATION_2, _MIGRATION_3),
    *(_MIGRATION_4, _MIGRATION_5, _MIGRATION_6, _MIGRATION_7),
)

SCHEMA_VERSION: Final = MEMORY.version

IN_MEMORY: Final = Path(":memory:")
"""In place of a file: a memory that nothing is left of."""


def open_database(path: Path) -> sqlite3.Connection:
    """Open the memory at `path`, check it and migrate it to the current schema; create it if there is none.

    Autocommit: each statement is one transaction, durable when it returns.

    Args:
        path: file of the memory, or `IN_MEMORY`.

    Returns:
        The connection.

    Raises:
        AgentError: the file is damaged, of something else, or of a newer version.
    """
    try:
        if path != IN_MEMORY and not path.exists():
            for suffix in ("-wal", "-shm"):  # of another database, which is gone
                path.with_name(path.name + suffix).unlink(missing_ok=True)
            replace_durably(path, _empty_database())
        database = sqlite3.connect(path, isolation_level=None)
    except (OSError, sqlite3.Error) as error:
        raise AgentError(f"the agent's memory {path} cannot be opened: {error}") from error
    try:
        if path == IN_MEMORY:
            database.deserialize(_empty_database())
        _prepare(database, path)
        if path != IN_MEMORY:
            with suppress(PermissionError):
                path.chmod(PRIVATE_FILE)
    except sqlite3.Error as error:
        database.close()
        raise AgentError(f"the agent's memory {path} is damaged or cannot be used: {error}") from error
    except BaseException:
        database.close()
        raise
    return database


@cache
def _empty_database() -> bytes:
    """Return an empty memory of the current schema, cached because its statements take a millisecond."""
    with closing(sqlite3.connect(IN_MEMORY, isolation_level=None)) as database:
        _migrate(database)
        return database.serialize()


def _prepare(database: sqlite3.Connection, path: Path) -> None:
    (version,) = database.execute("PRAGMA user_version").fetchone()
    (tables,) = database.execute("SELECT count(*) FROM sqlite_schema").fetchone()
    if version > SCHEMA_VERSION:
        raise AgentError(
            f"the agent's memory {path} has schema {version}; this version reads up to {SCHEMA_VERSION}; "
            "it was written by a newer AEROS: install a newer AEROS"
        )
    if not tables:
        raise AgentError(
            f"the agent's memory {path} is empty: it was cut off, and what the agent had learned is gone; "
            "restore it from a backup, or delete it to begin a new one"
        )
    if version <= 0:
        raise AgentError(f"{path} is not a database of this kind, not the agent's memory")
    (page,) = database.execute("PRAGMA page_size").fetchone()
    if path != IN_MEMORY and path.stat().st_size % page:
        # SQLite would fill up the last page with zeros, without a word.
        raise AgentError(f"the agent's memory {path} is damaged: its last page was cut off")
    (health,) = database.execute("PRAGMA quick_check(1)").fetchone()
    if health != "ok":
        raise AgentError(f"the agent's memory {path} is damaged: {health}")
    database.execute("PRAGMA journal_mode = WAL")
    database.execute("PRAGMA synchronous = FULL")
    database.execute("PRAGMA foreign_keys = ON")
    # What is forgotten is overwritten, not only unlinked.
    database.execute("PRAGMA secure_delete = ON")
    if version < SCHEMA_VERSION:
        _migrate(database)


def _migrate(database: sqlite3.Connection) -> None:
    database.execute("BEGIN IMMEDIATE")
    try:
        # Another process may have been faster.
        (version,) = database.execute("PRAGMA user_version").fetchone()
        for migration in _MIGRATIONS[version:]:
            for statement in migration:
                database.execute(statement)
        database.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")
    except BaseException:
        database.execute("ROLLBACK")
        raise
    database.execute("COMMIT")
