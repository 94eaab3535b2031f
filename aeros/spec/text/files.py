"""Reading of text files: regular, UTF-8 and not too large, or an error that says why not."""

from __future__ import annotations

import os
import stat
from typing import Final

from aeros.spec.diagnostics.characters import describe_character, find_hidden, hiding_reason, is_hidden
from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel, quoted
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import Source, SourceSpan

MAX_BYTES: Final = 1 << 20


def read_source(path: str | os.PathLike[str]) -> Source:
    """Read a text file.

    At most one byte more than allowed is ever read, and a pipe or device is
    never opened for long enough to wait on it.

    Args:
        path: path of the file, shown in diagnostics as it is.

    Returns:
        The text.

    Raises:
        UserError: the file cannot be read, is not a regular file, is not UTF-8, is larger than `MAX_BYTES`,
            or holds a character that a reader cannot see.
    """
    shown = os.fspath(path)
    try:
        data = _bytes_of(shown)
    except (OSError, ValueError) as problem:  # ValueError: a path no file can have
        reason = problem.strerror if isinstance(problem, OSError) and problem.strerror else str(problem)
        headline = f"{quoted(shown)} cannot be read: {reason[:1].lower()}{reason[1:]}"
        raise UserError([Diagnostic("AE002", headline)]) from problem
    return decoded_source(shown, data)


def decoded_source(shown: str, data: bytes) -> Source:
    """Decode the content of a text file.

    Args:
        shown: path of the file, as diagnostics show it.
        data: its bytes.

    Returns:
        The text.

    Raises:
        UserError: it is not UTF-8, is larger than `MAX_BYTES`, or holds a character that a reader cannot see.
    """
    if len(data) > MAX_BYTES:
        raise UserError([too_large_error(shown)])
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as problem:
        raise UserError([_not_utf8(shown, data, problem.start)]) from problem
    source = Source(shown, text)
    offset = find_hidden(source.text)
    if offset is not None:
        raise UserError([hidden_character_error(source.span(offset, offset + 1))])
    return source


def _bytes_of(path: str) -> bytes:
    """Read up to `MAX_BYTES` + 1 bytes of a regular file."""
    # Asked before opening, as opening a device can already do something.
    _require_regular(os.stat(path).st_mode)
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(descriptor, "rb") as file:
        _require_regular(os.fstat(descriptor).st_mode)  # it may have been replaced in between
        return file.read(MAX_BYTES + 1) or b""  # None from a file under /proc that has nothing yet


def _require_regular(mode: int) -> None:
    if stat.S_ISDIR(mode):
        raise OSError(0, "it is a directory")
    if not stat.S_ISREG(mode):
        raise OSError(0, "it is not a regular file")


def hidden_character_error(span: SourceSpan, character: str | None = None) -> Diagnostic:
    """Build the diagnostic for a character that a reader cannot see.

    Args:
        span: place of the character, or of the text that holds an escape for it.
        character: the character; None where the span is the character itself.

    Returns:
        The diagnostic, which names the character and says why it is not allowed.
    """
    hidden = span.text if character is None else character
    headline = f"the character {describe_character(hidden)} is not allowed: it is {hiding_reason(hidden)}"
    is_mark = hidden == "\ufeff" and span.start == 0
    cure = (
        "save the file as UTF-8 without a byte order mark" if is_mark else "delete it, or write it in words"
    )
    return Diagnostic("AE005", headline, SpanLabel(span), help=(cure,))


def hidden_path_error(path: str) -> Diagnostic | None:
    """Build the diagnostic for a path that a listing would not show as it is.

    Args:
        path: path of a file that people review.

    Returns:
        The diagnostic; None if every character of the path can be seen.
    """
    offset = find_hidden(path)
    hidden = next((one for one in path if is_hidden(one)), None if offset is None else path[offset])
    if hidden is None:
        return None
    headline = f"the name of the file `{path}` holds the character {describe_character(hidden)}"
    return Diagnostic("AE005", headline, help=("rename the file with letters, digits and `_`",))


def too_large_error(path: str) -> Diagnostic:
    """Build the diagnostic for a file that is larger than `MAX_BYTES`.

    Args:
        path: path of the file.

    Returns:
        The diagnostic.
    """
    return Diagnostic(
        "AE003",
        f"{quoted(path)} is larger than {MAX_BYTES:,} bytes",
        help=("split it: manifests are written by hand, data belongs in files of its own",),
    )


def _not_utf8(path: str, data: bytes, offset: int) -> Diagnostic:
    source = Source(path, data.decode("utf-8", errors="replace"))
    start = len(data[:offset].decode("utf-8"))
    return Diagnostic(
        "AE004",
        f"byte {offset} (0x{data[offset]:02x}) is not UTF-8",
        SpanLabel(source.span(start, start + 1)),
        help=("save the file as UTF-8",),
    )
