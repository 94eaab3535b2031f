"""The token: made once, for its owner alone; what others could have read is refused."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from aeros.apps.mcp.transports.token_file import TokenError, ensure_token


def test_a_token_is_made_once_for_its_owner_alone(tmp_path: Path) -> None:
    path = tmp_path / "state" / "mcp-token"
    token = ensure_token(path)
    assert len(token) >= 43
    assert path.stat().st_mode & 0o777 == 0o600
    assert ensure_token(path) == token
    path.unlink()
    assert ensure_token(path) != token


@pytest.mark.parametrize(
    "text", ["", "short", "with a space " * 5, "ä" * 40, "x" * 31, "x" * 1001, "x" * 40 + " " * 1000]
)
def test_a_token_that_is_too_weak_or_too_long_is_refused(text: str, tmp_path: Path) -> None:
    path = tmp_path / "token"
    path.write_text(text)
    path.chmod(0o600)
    with pytest.raises(TokenError, match="must hold one token of 32 to 1000 printable characters"):
        ensure_token(path)


@pytest.mark.parametrize("end", ["", "\n", "\r\n"])
def test_the_longest_token_may_end_its_line(end: str, tmp_path: Path) -> None:
    path = tmp_path / "token"
    path.write_bytes(b"x" * 1000 + end.encode())
    path.chmod(0o600)
    assert ensure_token(path) == "x" * 1000


def test_a_token_that_others_can_read_is_refused_and_so_is_a_link(tmp_path: Path) -> None:
    path = tmp_path / "token"
    ensure_token(path)
    (tmp_path / "link").symlink_to(path)
    path.chmod(0o640)
    with pytest.raises(TokenError, match="must be a file that only you can read: chmod 600"):
        ensure_token(path)
    path.chmod(0o600)
    with pytest.raises(TokenError, match="it is a link; name the file itself"):
        ensure_token(tmp_path / "link")
    os.mkfifo(tmp_path / "pipe", 0o600)
    with pytest.raises(TokenError, match="pipe` is no regular file"):
        ensure_token(tmp_path / "pipe")
    with pytest.raises(TokenError, match="cannot use the token file"):
        ensure_token(tmp_path / "token" / "below")
