"""File format with its versions, and the errors for files of versions that this program does not read.

A file states its version in `schema`: `aeros/NAME/N`, or N alone. A YAML file must state it, as must the JSON
files that always had it. Other JSON files and lines without `schema` are of version 1.
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
    """Place of the version in a file of a format."""

    YAML = "`schema` in YAML"
    JSON = "`schema` in JSON"
    JSON_LINES = "`schema` in each line, if any"
    DATABASE = "`user_version` of SQLite"
    OTHER = "see below"


class UnmigratableError(Exception):
    """File that cannot be rewritten to the next version; the message gives the reason and the cure."""


class FormatVersionError(Exception):
    """File of a version that this program does not read; the message gives file, cause and cure."""


@dataclass(frozen=True, slots=True)
class Version:
    """One version of a format.

    Attributes:
        change: changes of this version, for docs/formats.md.
        step: function that rewrites a file of the previous version; None for the first version, and for
            databases.
    """

    change: str
    step: Step | None = None


@dataclass(frozen=True, slots=True)
class Format:
    """One file format.

    Attributes:
        name: name of the format in `schema`, such as `ecm`.
        title: kind of file, for people.
        files: patterns of file names, `ecm.yaml`; empty if any name will do.
        kind: place of the version.
        versions: all of them, the first one first.
        keys: keys that every file has, which distinguish it from other files of the same name; `schema` is
            one of them if a file without it is damaged.
        cure: how to get a file of the current version, if `aeros migrate` does not do it.
        first: number of the first version.
        is_numbered: `schema` is the number alone.
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
        """Return the value of `schema` in a file of a version.

        Args:
            version: number of the version.

        Returns:
            The number itself, or `aeros/NAME/N`.
        """
        return version if self.is_numbered else f"aeros/{self.name}/{version}"

    def step_to(self, version: int) -> Step | None:
        """Return the step from the previous version.

        Args:
            version: version that the step leads to.

        Returns:
            The step; None for a database.

        Raises:
            MisuseError: no step leads to that version.
        """
        if not self.first < version <= self.version:
            raise MisuseError(f"no step leads to version {version} of format {self.name}")
        return self.versions[version - self.first].step

    def version_from_schema(self, schema: Any) -> int | None:
        """Read the version from the value of `schema`.

        Args:
            schema: value of `schema`; None if the file has none.

        Returns:
            The version; None if the value names no version of this format.
        """
        if schema is None:
            return None if self.kind is Kind.YAML or "schema" in self.keys else 1
        if self.is_numbered:
            return schema if type(schema) is int and schema >= 0 else None
        parsed = parse_schema(schema)
        return parsed[1] if parsed is not None and parsed[0] == self.name else None

    def version_of(self, content: Any) -> int | None:
        """Read the version of parsed JSON.

        Args:
            content: parsed file or line.

        Returns:
            The version; None if its `schema` names no version of this format.
        """
        return self.version_from_schema(content.get("schema") if isinstance(content, dict) else None)

    def require_current(self, content: Any, path: object) -> None:
        """Refuse a file of another version than the current one.

        Args:
            content: parsed JSON of the file.
            path: path of the file, for the message.

        Raises:
            FormatVersionError: the file has another version, or none.
        """
        version = self.version_of(content)
        if version is not None and version != self.version:
            cause, cure = self.refusal(version, path)
            raise FormatVersionError(f"`{path}` cannot be read: {cause}; {cure}")
        if version is None:
            raise FormatVersionError(f"`{path}` cannot be read: its `schema` is not `{self.schema}`")

    def refusal(self, version: int, path: object) -> tuple[str, str]:
        """Explain why a file of another version is not read.

        Args:
            version: version of the file, not the current one.
            path: path of the file, for the message.

        Returns:
            The cause, and what to do.
        """
        if version > self.version:
            cause, cure = "was written by a newer AEROS, and this one", "install a newer AEROS"
        else:
            cause, cure = "is an older format, and this AEROS", self.cure or f"run `aeros migrate {path}`"
        return f"`{self.schema_of(version)}` {cause} reads `{self.schema}`", cure


def parse_schema(text: Any) -> tuple[str, int] | None:
    """Parse a value of `schema`.

    Args:
        text: any value.

    Returns:
        Name and version of `aeros/NAME/N`; None for anything else.
    """
    match = _SCHEMA.fullmatch(text) if isinstance(text, str) else None
    return None if match is None else (match[1], int(match[2]))
