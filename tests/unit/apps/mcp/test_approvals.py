"""An approval is the operator's, for exactly what was asked, once, and not for long."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest

from aeros.apps.mcp.approvals import (
    APPROVALS_FOLDER,
    MAX_PENDING,
    VALIDITY_S,
    ApprovalError,
    Approvals,
    approve,
    pending_requests,
    reject,
)

WHAT = {"what": "execute", "client": "c", "steps": [{"skill": "a.b", "inputs": {}}], "goal": "x"}


def test_an_approval_is_used_once(tmp_path: Path) -> None:
    approvals = Approvals(tmp_path)
    id_ = approvals.request(WHAT)
    assert approvals.consume(id_) is None
    approve(tmp_path, id_)
    found = approvals.consume(id_)
    assert found is not None
    assert found.id == id_
    assert "uid" in found.approved_by
    assert approvals.consume(id_) is None
    assert approvals.pending == []


def test_to_ask_again_is_to_wait_on(tmp_path: Path) -> None:
    approvals = Approvals(tmp_path)
    id_ = approvals.request(WHAT)
    assert approvals.request(WHAT, id_) == id_
    assert [one["id"] for one in pending_requests(tmp_path)] == [id_]


def test_an_approval_of_something_else_is_none(tmp_path: Path) -> None:
    approvals = Approvals(tmp_path)
    id_ = approvals.request(WHAT)
    path = tmp_path / APPROVALS_FOLDER / f"{id_}.json"
    path.write_text(path.read_text().replace("a.b", "a.harmless"))
    approve(tmp_path, id_)
    assert approvals.consume(id_) is None


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"digest": "0", "by": "x", "at": 1.0}', "\x00"])
def test_a_file_that_is_no_approval_approves_nothing(content: str, tmp_path: Path) -> None:
    approvals = Approvals(tmp_path)
    id_ = approvals.request(WHAT)
    (tmp_path / APPROVALS_FOLDER / f"{id_}.approved").write_text(content)
    assert approvals.consume(id_) is None


def test_an_approval_that_is_late_is_void(tmp_path: Path) -> None:
    approvals = Approvals(tmp_path)
    id_ = approvals.request(WHAT)
    approve(tmp_path, id_)
    path = tmp_path / APPROVALS_FOLDER / f"{id_}.approved"
    message = json.loads(path.read_text())
    path.write_text(json.dumps({**message, "at": time.time() - VALIDITY_S - 1}))
    assert approvals.consume(id_) is None
    approve_again = pytest.raises(ApprovalError, match="no pending approval")
    with approve_again:
        approve(tmp_path, id_)


def test_a_request_that_waits_too_long_is_void(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    approvals = Approvals(tmp_path)
    id_ = approvals.request(WHAT)
    approve(tmp_path, id_)
    now = time.monotonic()
    monkeypatch.setattr("aeros.apps.mcp.approvals.time.monotonic", lambda: now + VALIDITY_S + 1)
    assert approvals.consume(id_) is None
    assert approvals.is_rejected(id_)


def test_requests_left_by_an_earlier_server_are_void(tmp_path: Path) -> None:
    id_ = Approvals(tmp_path).request(WHAT)
    approve(tmp_path, id_)
    assert Approvals(tmp_path).consume(id_) is None
    assert pending_requests(tmp_path) == []


def test_a_refusal_is_known(tmp_path: Path) -> None:
    approvals = Approvals(tmp_path)
    id_ = approvals.request(WHAT)
    assert not approvals.is_rejected(id_)
    reject(tmp_path, id_)
    assert approvals.is_rejected(id_)
    assert approvals.consume(id_) is None


def test_a_client_cannot_fill_the_folder(tmp_path: Path) -> None:
    approvals = Approvals(tmp_path)
    for _ in range(MAX_PENDING):
        approvals.request(WHAT)
    with pytest.raises(ApprovalError, match=r"too many pending approvals \(8\)"):
        approvals.request(WHAT)
    approvals.withdraw_all()
    assert pending_requests(tmp_path) == []


@pytest.mark.parametrize("id_", ["", "../../identity", "0" * 8, "zzzzzzzz", "a" * 9])
def test_only_what_waits_can_be_approved(id_: str, tmp_path: Path) -> None:
    Approvals(tmp_path)
    (tmp_path / "identity.json").write_text("{}")
    with pytest.raises(ApprovalError, match="no pending approval"):
        approve(tmp_path, id_)
    with pytest.raises(ApprovalError, match="no pending approval"):
        reject(tmp_path, id_)


def test_a_link_is_not_followed(tmp_path: Path) -> None:
    approvals = Approvals(tmp_path)
    id_ = approvals.request(WHAT)
    approve(tmp_path, id_)
    approved = tmp_path / APPROVALS_FOLDER / f"{id_}.approved"
    approved.rename(tmp_path / "elsewhere")
    approved.symlink_to(tmp_path / "elsewhere")
    assert approvals.consume(id_) is None
