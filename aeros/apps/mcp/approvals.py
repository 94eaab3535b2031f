"""Requests of MCP clients that need the operator's approval: one file each, in the agent's folder.

Anyone who can write that folder counts as the operator; clients are not authenticated.  An approval holds
for exactly the content of the file, is used once, and expires after ten minutes.  A new server deletes the
requests of earlier servers.
"""

from __future__ import annotations

import getpass
import hashlib
import json
import os
import re
import secrets
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from aeros.files import make_folder, replace_durably

APPROVALS_FOLDER: Final = "approvals"
VALIDITY_S: Final = 600.0
"""Seconds after which an approval, or what waits for one, is void."""

MAX_PENDING: Final = 8

_ID: Final = re.compile(r"[0-9a-f]{8}")
_MAX_BYTES: Final = 200_000


class ApprovalError(Exception):
    """A request that does not exist or cannot be approved; the message says why."""


@dataclass(frozen=True, slots=True)
class Approval:
    """An operator's approval of a request.

    Attributes:
        id: Id of the request, eight hexadecimal digits.
        approved_by: Name of the operator.
        approved_at: Time of the approval, seconds since 1970.
        is_verified: True if it came from someone who can write the agent's folder; False if a client says
            that its user approved, which nothing verifies.
    """

    id: str
    approved_by: str
    approved_at: float
    is_verified: bool = True


class Approvals:
    """The server's side: requests, and approvals to be used.

    Args:
        state: The agent's state folder.  Requests left there by an earlier server are deleted.
    """

    def __init__(self, state: Path) -> None:
        self._folder = state / APPROVALS_FOLDER
        make_folder(self._folder, 0o700)
        self._waiting: dict[str, tuple[str, float]] = {}
        for path in self._folder.iterdir():
            path.unlink()

    def request(self, what: Mapping[str, Any], known: str | None = None) -> str:
        """Write a request for the operator.

        Args:
            what: Content of the request, JSON values.
            known: Id of an earlier request with the same content; it is returned if still pending.

        Returns:
            The id of the request.

        Raises:
            ApprovalError: `MAX_PENDING` requests are pending already.
        """
        self._remove_expired()
        if known in self._waiting:
            return str(known)
        if len(self._waiting) >= MAX_PENDING:
            raise ApprovalError(f"too many pending approvals ({MAX_PENDING})")
        id_ = secrets.token_hex(4)
        content = json.dumps({"id": id_, "asked": time.time(), **what}, indent=1).encode()
        replace_durably(self._folder / f"{id_}.json", content)
        self._waiting[id_] = (hashlib.sha256(content).hexdigest(), time.monotonic())
        return id_

    def consume(self, id_: str | None) -> Approval | None:
        """Use an approval, which is void from then on.

        Args:
            id_: Id of the request; None for no request.

        Returns:
            The approval; None if there is none, it expired, or the request changed after the approval.
        """
        self._remove_expired()
        if id_ not in self._waiting:
            return None
        digest, _ = self._waiting[str(id_)]
        found = _read(self._folder / f"{id_}.approved")
        if found is None or found.get("digest") != digest or type(found.get("at")) is not float:
            return None
        self.withdraw(str(id_))
        if not 0.0 <= time.time() - found["at"] <= VALIDITY_S:
            return None
        return Approval(str(id_), str(found.get("by")), found["at"])

    def consume_claimed(self, id_: str | None, claimed_by: str) -> Approval | None:
        """Use a request that a client's user approved, as the client says.

        Args:
            id_: Id of the request; None for no request.
            claimed_by: Text that names the client.

        Returns:
            The approval; None if the request is not pending, or the operator has rejected it.
        """
        self._remove_expired()
        if id_ not in self._waiting or self.is_rejected(id_):
            return None
        self.withdraw(str(id_))
        return Approval(str(id_), claimed_by, time.time(), is_verified=False)

    def is_rejected(self, id_: str | None) -> bool:
        """Check if a request can no longer be approved.

        Args:
            id_: Id of the request; None for no request.

        Returns:
            True if the operator rejected it, or it expired.
        """
        self._remove_expired()
        return id_ is not None and not (self._folder / f"{id_}.json").exists()

    def is_decided(self, id_: str | None) -> bool:
        """Check if the operator has approved or rejected a request.

        Args:
            id_: Id of the request; None for no request.

        Returns:
            True if the operator has, or the request expired.
        """
        return self.is_rejected(id_) or (self._folder / f"{id_}.approved").exists()

    def withdraw(self, id_: str) -> None:
        """Delete a request and its approval.

        Args:
            id_: Id of the request.
        """
        self._waiting.pop(id_, None)
        for suffix in ("json", "approved"):
            (self._folder / f"{id_}.{suffix}").unlink(missing_ok=True)

    def withdraw_all(self) -> None:
        """Delete all requests and approvals, as after a stop."""
        for id_ in list(self._waiting):
            self.withdraw(id_)

    @property
    def pending(self) -> list[str]:
        """List the ids of the pending requests."""
        self._remove_expired()
        return list(self._waiting)

    def _remove_expired(self) -> None:
        for id_, (_, asked) in list(self._waiting.items()):
            if time.monotonic() - asked > VALIDITY_S:
                self.withdraw(id_)


def pending_requests(state: Path) -> list[Mapping[str, Any]]:
    """Read the pending requests, for the operator.

    Args:
        state: The agent's state folder.

    Returns:
        The content of each request that is not approved yet, sorted by id.
    """
    paths = sorted((state / APPROVALS_FOLDER).glob("*.json"))
    read = [one for path in paths if _ID.fullmatch(path.stem) and (one := _read(path)) is not None]
    return [one for one in read if not (state / APPROVALS_FOLDER / f"{one.get('id')}.approved").exists()]


def approve(state: Path, id_: str) -> None:
    """Approve a pending request.

    Args:
        state: The agent's state folder.
        id_: Id of the request.

    Raises:
        ApprovalError: There is no such request.
    """
    content = _content(_request(state, id_))
    approval = {"digest": hashlib.sha256(content).hexdigest(), "by": _current_user(), "at": time.time()}
    replace_durably(state / APPROVALS_FOLDER / f"{id_}.approved", json.dumps(approval).encode())


def reject(state: Path, id_: str) -> None:
    """Reject a pending request.

    Args:
        state: The agent's state folder.
        id_: Id of the request.

    Raises:
        ApprovalError: There is no such request.
    """
    _request(state, id_).unlink(missing_ok=True)


def _request(state: Path, id_: str) -> Path:
    path = state / APPROVALS_FOLDER / f"{id_}.json"
    if _ID.fullmatch(id_) is None or not path.is_file():
        raise ApprovalError(f"no pending approval `{id_}`")
    return path


def _read(path: Path) -> dict[str, Any] | None:
    try:
        found = json.loads(_content(path))
    except (OSError, ValueError, RecursionError):
        return None
    return found if type(found) is dict else None


def _content(path: Path) -> bytes:
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW)
    with os.fdopen(descriptor, "rb") as file:
        return file.read(_MAX_BYTES)


def _current_user() -> str:
    try:
        return f"{getpass.getuser()} (uid {os.getuid()})"
    except (KeyError, OSError):
        return f"uid {os.getuid()}"
