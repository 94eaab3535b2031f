"""Compositions as the YAML text of a manifest, and their insertion into one."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any, Final

_NOT_TEXT: Final = frozenset(("true", "false", "null", "yes", "no", "on", "off", "y", "n"))
"""Words that YAML does not read as text where they are not quoted."""


class ManifestConflictError(Exception):
    """Manifest that cannot take the composition; the message says why."""


def composition_text(name: str, description: str, part: dict[str, Any]) -> str:
    """Write an entry of `compositions`.

    Args:
        name: name of the composition.
        description: its purpose, for people.
        part: its graph, as a manifest writes it.

    Returns:
        YAML, indented by two spaces.
    """
    lines = [f"{name}:", f"  description: {json.dumps(description)}", "  do:"]
    lines += [f"    {line}" for line in _lines(part)]
    return "".join(f"  {line}\n" for line in lines)


def _lines(part: dict[str, Any]) -> Iterator[str]:
    nested = {key: value for key, value in part.items() if isinstance(value, dict | list) and key != "inputs"}
    flat = {key: value for key, value in part.items() if key not in nested}
    if not nested:
        yield _flow(flat)
        return
    for key, value in flat.items():
        yield f"{key}: {_flow(value)}"
    for key, value in nested.items():
        first = [] if isinstance(value, list) else list(_lines(value))
        if len(first) == 1 and first[0].startswith("{"):
            yield f"{key}: {first[0]}"
            continue
        yield f"{key}:"
        for one in value if isinstance(value, list) else [value]:
            inner = list(_lines(one))
            mark = "- " if isinstance(value, list) else "  "
            yield from (f"  {mark if number == 0 else '  '}{line}" for number, line in enumerate(inner))


def _flow(value: Any) -> str:
    match value:
        case dict():
            return "{" + ", ".join(f"{key}: {_flow(one)}" for key, one in value.items()) + "}"
        case str() if re.fullmatch(r"[a-z][a-z0-9_.]*", value) and value not in _NOT_TEXT:
            return value
        case _:
            return json.dumps(value)


def with_composition(manifest: str, name: str, text: str) -> str:
    """Add a composition to a manifest.

    Args:
        manifest: text of the manifest.
        name: name of the composition.
        text: its entry, as `composition_text` writes it.

    Returns:
        The text with the composition first among its compositions, or at its end if it has none.

    Raises:
        ManifestConflictError: it has a composition of that name, or writes its compositions on one line.
    """
    section = re.search(r"^compositions:[^\S\n]*(#.*)?$", manifest, re.MULTILINE)
    if section is None:
        if re.search(r"^compositions:", manifest, re.MULTILINE):
            raise ManifestConflictError("its `compositions` are on one line; write each on lines of its own")
        end = "" if manifest.endswith("\n") else "\n"
        return f"{manifest}{end}\ncompositions:\n{text}"
    rest = manifest[section.end() :]
    own = re.split(r"^[^\s#]", rest, maxsplit=1, flags=re.MULTILINE)[0]
    if re.search(rf"^  {name}:", own, re.MULTILINE):
        raise ManifestConflictError(f"it has a composition `{name}`; choose another name by --name")
    return f"{manifest[: section.end()]}\n{text.rstrip(chr(10))}{rest}"
