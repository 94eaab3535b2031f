"""A file format with its versions, and the errors for files of versions that this program does not read.

A file says its version in `schema`: `aeros/NAME/N`, or N alone.  A YAML file has to say it, as have the
JSON files that always had it; other JSON files and lines without `schema` are of version 1.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

from aeros.spec.diagnostics.errors import MisuseError

_SCHEMA: Final = re.compile(r"aeros/([a-z][a-z-]*)/(0|[1-9][0-9]{0,3})")

Step = Callable[[str], str]
"""Rewrites the text of a file from the previous version, `schema` included; raises `UnmigratableError`."""


class Kind(Enum):
    """Where a file of a format holds its version."""

    YAML = "`schema` in YAML"
    JSON = "`schema` in JSON"
    JSON_LINES = "`schema` in each line, if any"
    DATABASE = "`user_version` of SQLite"
    OTHER = "see below"


class UnmigratableError(Exception):
    """A file cannot be rewritten to the next version; the message gives the reason and the cure."""


class FormatVersionError(Exception):
    """A file has a version that this program does not read; the message gives file, cause and cure."""


@dataclass(frozen=True, slots=True)
class Version:
    """One version of a format.

    change: what the version changed, for docs/formats.md.
    step: rewrites a file of the previous version; None for the first version, and for databases.
    """

    change: str
    step: Step | None = None


@dataclass(frozen=True, slots=True)
class Format:
    """One file format.

    title: what a file of it is, for people.
    files: patterns of file names, `ecm.yaml`; empty where any name will do.
    kind: where the version is.
    versions: all of them, the first one first.
    keys: keys that every file has, which tell it from other files of the same name; `schema` is one of them
        where a file without it is damaged.
    cure: how an older file becomes one of the current version, where `aeros migrate` does not do it.
    first: number of the first version.
    is_numbered: whether `schema` is the number alone.
    """

    name: str
    title: str
    files: tuple[str, ...]
    kind: Kind
    versions: tuple[Version, ...]
    keys: frozenset[str] = frozenset()
    cure: str = ""
    first: int = 1
    is_numbered: bool = False

    @property
    def version(self) -> int:
        """Number of the current version, which this program writes."""
        return self.first + len(self.versions) - 1

    @property
    def schema(self) -> str | int:
        """Value of `schema` in a file of the current version."""
        return self.schema_of(self.version)

    def schema_of(self, version: int) -> str | int:
        """Value of `schema` in a file of that version."""
        return version if self.is_numbered else f"aeros/{self.name}/{version}"

    def step_to(self, version: int) -> Step | None:
        """The step from the version before `version`."""
        if not self.first < version <= self.version:
            raise MisuseError(f"no step leads to version {version} of format {self.name}")
        return self.versions[version - self.first].step

    def version_said(self, schema: Any) -> int | None:
        """The version that the value of `schema` means; None where it names none of this format.

        schema: None where the file has no `schema`.
        """
        if schema is None:
            return None if self.kind is Kind.YAML or "schema" in self.keys else 1
        if self.is_numbered:
            return schema if type(schema) is int and schema >= 0 else None
        parsed = parse_schema(schema)
        return parsed[1] if parsed is not None and parsed[0] == self.name else None

    def version_of(self, content: Any) -> int | None:
        """The version of parsed JSON; None where its `schema` names none of this format."""
        return self.version_said(content.get("schema") if isinstance(content, dict) else None)

    def require_current(self, content: Any, path: object) -> None:
        """Raise `FormatVersionError` where `content`, parsed JSON of the file `path`, has another version."""
        version = self.version_of(content)
        if version is not None and version != self.version:
            cause, cure = self.refusal(version, path)
            raise FormatVersionError(f"`{path}` cannot be read: {cause}; {cure}")
        if version is None:
            raise FormatVersionError(f"`{path}` cannot be read: its `schema` is not `{self.schema}`")

    def refusal(self, version: int, path: object) -> tuple[str, str]:
        """Why a file of that version, not the current one, is not read, and what to do about it."""
        if version > self.version:
            cause, cure = "was written by a newer AEROS, and this one", "install a newer AEROS"
        else:
            cause, cure = "is an older format, and this AEROS", self.cure or f"run `aeros migrate {path}`"
        return f"`{self.schema_of(version)}` {cause} reads `{self.schema}`", cure


def parse_schema(text: Any) -> tuple[str, int] | None:
    """Name and version of `aeros/NAME/N`; None for anything else."""
    found = _SCHEMA.fullmatch(text) if isinstance(text, str) else None
    return None if found is None else (found[1], int(found[2]))
