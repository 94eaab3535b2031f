"""Compositions as the YAML text of a manifest, and their insertion into one."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any, Final

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import Source
from aeros.spec.text.nodes import MappingNode
from aeros.spec.text.yaml_reader import read_yaml

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
    lines = [f"{name}:", f"  description: {_quoted(description)}", "  do:"]
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
            return _quoted(value)


def _quoted(value: Any) -> str:
    """Write a value with its own characters, and with escapes for those that nobody sees."""
    text = json.dumps(value, ensure_ascii=False)
    return "".join(one if one.isprintable() else _escape(ord(one)) for one in text)


def _escape(code: int) -> str:
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def with_composition(manifest: str, name: str, text: str) -> str:
    """Add a composition to a manifest.

    Args:
        manifest: text of the manifest.
        name: name of the composition.
        text: its entry, as `composition_text` writes it.

    Returns:
        The text with the composition first among its compositions, or at its end if it has none.

    Raises:
        ManifestConflictError: it has a composition of that name, writes its compositions on one line, or
            could not be read any more.
    """
    added = _with_entry(manifest, name, text)
    before, after = _composition_names(manifest), _composition_names(added)
    if sorted(after) != sorted([*before, name]):
        raise ManifestConflictError(f"the composition `{name}` cannot be added to it; add it by hand")
    return added


def _composition_names(manifest: str) -> list[str]:
    """Return the names of the compositions, as the reader of manifests finds them.

    Raises:
        ManifestConflictError: the reader refuses the text.
    """
    problems = Diagnostics()
    root = read_yaml(Source("ecm.yaml", manifest), problems)
    if not isinstance(root, MappingNode):
        reason = next((one.headline for one in problems), "it has no keys")
        raise ManifestConflictError(f"it cannot be read as a manifest with the composition: {reason}")
    section = next((value for key, value in root.entries if key.text == "compositions"), None)
    return [key.text for key, _ in section.entries] if isinstance(section, MappingNode) else []


def _with_entry(manifest: str, name: str, text: str) -> str:
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
