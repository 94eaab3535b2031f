"""Rewriting of one file's text from an older version of its format to the current one.

Pure functions of a file's name and text: `aeros migrate` reads and writes the files.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase
from itertools import islice
from pathlib import PurePath
from typing import Any, Final

from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.migrations import formats
from aeros.spec.migrations.format import Format, Kind, UnmigratableError, parse_schema
from aeros.spec.migrations.yaml_edits import schema_of

_SCHEMA: Final = re.compile(r"schema[\"']?\s*:\s*[\"']?aeros/")


@dataclass(frozen=True, slots=True)
class Rewritten:
    """A text in the current version of its format.

    Attributes:
        format: the format.
        version: the version that it had.
        text: the text in the current version.
        changes: changes of the versions since then, the oldest first.
    """

    format: Format
    version: int
    text: str
    changes: tuple[str, ...]

    @property
    def is_changed(self) -> bool:
        """True if the text was of an older version."""
        return self.version < self.format.version


def has_known_name(path: PurePath) -> bool:
    """Say if a file of this name may be of a format that `aeros migrate` knows.

    Args:
        path: path of the file; only the name counts.

    Returns:
        True for every YAML file and for the JSON files of AEROS.
    """
    return path.suffix in (".yaml", ".yml") or any(
        fnmatchcase(path.name, pattern)
        for format_ in formats.FORMATS
        for pattern in format_.files
        if format_.kind in (Kind.YAML, Kind.JSON, Kind.JSON_LINES)
    )


def format_of(path: PurePath, text: str) -> Format | None:
    """Find the format of a file.

    Args:
        path: path of the file.
        text: text of the file.

    Returns:
        The format; None if it is none of AEROS.

    Raises:
        UserError: a YAML file is not well-formed.
    """
    if path.suffix in (".yaml", ".yml"):
        return _yaml_format(path, text)
    for format_ in formats.FORMATS:
        if format_.kind in (Kind.JSON, Kind.JSON_LINES) and any(
            fnmatchcase(path.name, pattern) for pattern in format_.files
        ):
            return format_ if _is_of(format_, text) else None
    return None


def rewrite(path: PurePath, text: str, format_: Format) -> Rewritten:
    """Rewrite a text to the current version of its format.

    Args:
        path: of the file, for messages.
        text: of the file, of any version.
        format_: the format, as `format_of` found it.

    Returns:
        The new text; the same text where its version is the current one.

    Raises:
        UnmigratableError: its version is newer or unknown, or a step cannot be done.
        UserError: a YAML file is not well-formed.
        InternalError: a fault of AEROS: a version has no step, or its step leads elsewhere.
    """
    version = _version(text, format_, path)
    if version is None or version < format_.first:
        raise UnmigratableError(f"its `schema` is not `{format_.schema}` or an earlier version of that")
    if version > format_.version or (version < format_.version and format_.cure):
        raise UnmigratableError("; ".join(format_.refusal(version, path)))
    changes = []
    for number in range(version + 1, format_.version + 1):
        step = format_.step_to(number)
        if step is None:
            raise InternalError(f"version {number} of format {format_.name} has no step")
        text = step(text)
        if _version(text, format_, path) != number:
            raise InternalError(f"the step to version {number} of format {format_.name} left another version")
        changes.append(format_.versions[number - format_.first].change)
    return Rewritten(format_, version, text, tuple(changes))


def _yaml_format(path: PurePath, text: str) -> Format | None:
    yaml_formats = [format_ for format_ in formats.FORMATS if format_.kind is Kind.YAML]
    by_file_name = next((format_ for format_ in yaml_formats if path.name in format_.files), None)
    if by_file_name is None and _SCHEMA.search(text) is None:
        return None  # some other YAML, which may use features that AEROS refuses
    schema = schema_of(text, str(path))
    parsed = None if schema is None else parse_schema(schema[0])
    if parsed is None:
        return by_file_name
    return next((format_ for format_ in yaml_formats if format_.name == parsed[0]), by_file_name)


def _version(text: str, format_: Format, path: PurePath) -> int | None:
    if format_.kind is Kind.YAML:
        schema = schema_of(text, str(path))
        return None if schema is None else format_.version_from_schema(schema[0])
    if format_.kind is Kind.JSON_LINES:
        lines = _lines(text)
        if "schema" in format_.keys:  # the first line has it for all of the file
            lines = islice(lines, 1)
        return _oldest(format_.version_of(line) for line in lines)
    return format_.version_of(_parsed(text))


def _oldest(versions: Iterable[int | None]) -> int | None:
    """Return the oldest version of any line; None if a line has none, as newer programs may append."""
    of_lines = list(versions)
    known = [version for version in of_lines if version is not None]
    return None if len(known) < len(of_lines) else min(known, default=1)


def _lines(text: str) -> Iterator[Any]:
    for line in text.splitlines():
        yield _parsed(line)


def _is_of(format_: Format, text: str) -> bool:
    """Say if the text has the keys that every file of the format has."""
    first = text.partition("\n")[0] if format_.kind is Kind.JSON_LINES else text
    content = _parsed(first)
    if isinstance(content, dict):
        parsed = parse_schema(content.get("schema"))
        return (parsed is not None and parsed[0] == format_.name) or (
            bool(format_.keys) and format_.keys <= content.keys()
        )
    return isinstance(content, list) and format_ is formats.CRASHES


def _parsed(text: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return None
