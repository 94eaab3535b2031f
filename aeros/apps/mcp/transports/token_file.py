"""The token that clients over HTTP present: a file that only its owner can read."""

from __future__ import annotations

import os
import secrets
import stat
from errno import ELOOP
from pathlib import Path
from typing import Final

from aeros.files import make_folder

TOKEN_FILE: Final = "mcp-token"  # noqa: S105 - a file's name
"""Name of the file in the agent's folder."""

_MIN_CHARS: Final = 32
_MAX_CHARS: Final = 1_000
_LINE_END: Final = 2
"""Characters that an editor or `echo` may write after the token."""


class TokenError(Exception):
    """A token that cannot be used; the message says why and what to do."""


def ensure_token(path: Path) -> str:
    """Read the token, which is made if there is no file.

    Args:
        path: The file.

    Returns:
        The token, 32 to 1000 printable characters without spaces.

    Raises:
        TokenError: The file cannot be read or written, others can read it, or it holds no such token.
    """
    try:
        make_folder(path.parent, 0o700)
        _create(path)
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK)
        with os.fdopen(descriptor, "rb") as file:
            mode = os.fstat(descriptor).st_mode
            if not stat.S_ISREG(mode):
                raise TokenError(f"`{path}` is no regular file; delete it, or name another token file")
            text = file.read(_MAX_CHARS + _LINE_END + 1).decode("ascii", "replace")
    except OSError as error:
        reason = "it is a link; name the file itself" if error.errno == ELOOP else error.strerror
        raise TokenError(f"cannot use the token file `{path}`: {reason}") from error
    if mode & 0o077:
        raise TokenError(f"`{path}` must be a file that only you can read: chmod 600 '{path}'")
    is_whole = len(text) <= _MAX_CHARS + _LINE_END
    text = text.strip()
    is_token = _MIN_CHARS <= len(text) <= _MAX_CHARS and all("!" <= character <= "~" for character in text)
    if not (is_whole and is_token):
        raise TokenError(
            f"`{path}` must hold one token of {_MIN_CHARS} to {_MAX_CHARS} printable characters; "
            "delete it for a new one"
        )
    return text


def _create(path: Path) -> None:
    """Write a new token, unless the file exists."""
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    except FileExistsError:
        return
    with os.fdopen(descriptor, "w") as file:
        file.write(secrets.token_urlsafe(32) + "\n")
