r"""Layers of a site: a site file, and overlay files that add to it; all are one text with one digest.

An overlay names its site by a path. The text of a site with overlays is the outermost overlay, then each
further one, then the site file. A line `--- # FILE` before each part but the first names its file, relative
to the overlay, so the text is the same on every computer. A registry stores it as it is, under its digest.
Every other file holds one layer: what looks like an overlay brings no site of its own.
"""

from __future__ import annotations

import os
import re
from functools import lru_cache
from pathlib import Path
from typing import Final

from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics, SpanLabel, quoted
from aeros.spec.diagnostics.errors import MisuseError, UserError
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.text.digests import text_digest
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.text.files import MAX_BYTES, read_source, too_large_error
from aeros.spec.text.nodes import MappingNode, ScalarNode

OVERLAY_SCHEMA: Final = "aeros/overlay/"
"""Beginning of `schema` in an overlay."""

_SEPARATOR: Final = re.compile(r"^--- # (.+)\n", re.MULTILINE)
_MAX_LAYERS: Final = 8  # more are a mistake, such as an overlay on itself


def read_site(path: Path) -> Source:
    """Read a site file; if it is an overlay, with everything that it is based on.

    Args:
        path: the site file or overlay.

    Returns:
        The text, with the path of the outermost file.

    Raises:
        UserError: a file cannot be read or holds several layers, overlays are based on each other, or all are
            too large together.
    """
    source = read_source(path)
    _require_one_layer(source, path)
    text, at = source.text, source
    for _ in range(_MAX_LAYERS):
        last = layers_of(at)[-1]
        base = _base(last)
        if base is None:
            return Source(source.path, text)
        name, span = base
        file = _base_file(path.parent, name)
        try:
            at = read_source(file)
        except UserError as error:
            raise _unusable(span, error.diagnostics[0].headline) from error
        if _SEPARATOR.search(at.text):
            raise _unusable(span, f"{quoted(at.path)} has a line `--- # …`; write `---` alone, or delete it")
        text = f"{text}{'' if text.endswith(chr(10)) else chr(10)}--- # {name}\n{at.text}"
        if len(text.encode()) > MAX_BYTES:
            raise UserError([too_large_error(source.path)])
        path = file
    headline = (
        f"{quoted(source.path)} cannot be read: it is based on more than {_MAX_LAYERS} files, or on itself"
    )
    raise UserError([Diagnostic("AE002", headline)])


def is_reference_site(layer: Source) -> bool:
    """Say if a site file is the reference site, or a copy of it such as a registry stores.

    Args:
        layer: text of a site file without its overlays.

    Returns:
        True if it has the same text.
    """
    return layer.text == read_source(reference_site_path()).text


def site_content(path: Path, content: bytes) -> bytes:
    """Return the content of a site file, with everything that it is based on if it is an overlay.

    Args:
        path: the file.
        content: its content.

    Returns:
        The content of all layers.

    Raises:
        UserError: as `read_site` raises it.
    """
    return read_site(path).text.encode() if OVERLAY_SCHEMA.encode() in content else content


@lru_cache(maxsize=16)
def layers_of(source: Source) -> tuple[Source, ...]:
    """Split the text of a site into its layers.

    Args:
        source: text from `read_site`.

    Returns:
        The overlays, the outermost first, and last the site file; each with its own path.
    """
    marks = list(_SEPARATOR.finditer(source.text)) if OVERLAY_SCHEMA in source.text else []
    starts = [0, *(mark.end() for mark in marks)]
    ends = [*(mark.start() for mark in marks), len(source.text)]
    paths = [Path(source.path)]
    for mark in marks:
        paths.append(_shown_base(paths[-1].parent, mark[1]))
    names = [source.path, *map(str, paths[1:])]
    return tuple(
        Source(name, source.text[start:end]) for name, start, end in zip(names, starts, ends, strict=True)
    )


def whole_offset(source: Source, span: SourceSpan) -> int:
    """Return the distance of a layer's text from the beginning of the whole text.

    Args:
        source: text of all layers.
        span: a place in one of them.

    Returns:
        Number of characters before the layer.

    Raises:
        MisuseError: the place is in no layer.
    """
    for layer, start in zip(layers_of(source), _starts(source), strict=True):
        if layer == span.source:
            return start
    raise MisuseError(f"`{span.source.path}` is no layer of `{source.path}`")


def layer_span(source: Source, start: int, end: int) -> SourceSpan:
    """Find a place of the whole text in its layer.

    Args:
        source: text of all layers.
        start: offset of the first character in the whole text.
        end: offset after the last character.

    Returns:
        The place in its layer.

    Raises:
        MisuseError: the place is in no layer.
    """
    layers = layers_of(source)
    for layer, first in reversed(list(zip(layers, _starts(source), strict=True))):
        if first <= start:
            return SourceSpan(layer, start - first, end - first)
    raise MisuseError(f"no place {start}..{end} in {source.path}")


def _require_one_layer(source: Source, path: Path) -> None:
    """Refuse several layers in one file, unless a registry has stored it: its name is its digest.

    Raises:
        UserError: it holds several.
    """
    mark = _SEPARATOR.search(source.text) if OVERLAY_SCHEMA in source.text else None
    if mark is None or path.stem == text_digest(source.text):
        return
    headline = "an overlay and the site that it is based on are two files"
    span = SpanLabel(SourceSpan(source, mark.start(), mark.end() - 1), "begins another file here")
    help_ = ("write the site into a file of its own, and its path after `base:`",)
    raise UserError([Diagnostic("AE002", headline, span, help=help_)])


def _starts(source: Source) -> tuple[int, ...]:
    marks = _SEPARATOR.finditer(source.text) if len(layers_of(source)) > 1 else ()
    return (0, *(mark.end() for mark in marks))


def _base(layer: Source) -> tuple[str, SourceSpan] | None:
    """Return the path of the site that an overlay is based on, as it is written; None for a site file."""
    if OVERLAY_SCHEMA not in layer.text:
        return None
    from aeros.spec.text.yaml_reader import read_yaml  # a run under a site without overlays reads no YAML

    root = read_yaml(layer, Diagnostics())
    entries = {key.text: value for key, value in root.entries} if isinstance(root, MappingNode) else {}
    schema, base = entries.get("schema"), entries.get("base")
    if not isinstance(schema, ScalarNode) or not schema.text.startswith(OVERLAY_SCHEMA):
        return None
    if base is None:
        return reference_site_path().name, schema.span
    if not isinstance(base, ScalarNode) or not base.text.strip() or "\n" in base.text:
        raise _unusable(base.span, "`base` is not the path of a site file")
    return base.text.strip(), base.span


def _base_file(folder: Path, name: str) -> Path:
    """Return the file of a base; the reference site has its name everywhere, unless a file here has it."""
    here = Path(os.path.normpath(folder / name))
    return reference_site_path() if name == reference_site_path().name and not here.exists() else here


def _shown_base(folder: Path, name: str) -> Path:
    """Return the path of a base for messages; its name alone if there is no such file."""
    path = _base_file(folder, name)
    return path if path.exists() else Path(name)


def _unusable(span: SourceSpan, reason: str) -> UserError:
    return UserError(
        [
            Diagnostic(
                "AE002",
                f"the site that this overlay is based on cannot be used: {reason}",
                SpanLabel(span),
                help=("`base` is a path relative to this file; without it, the reference site is meant",),
            )
        ]
    )
