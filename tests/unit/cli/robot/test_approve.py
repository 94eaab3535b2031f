"""`aeros approve`: the operator lists, approves and refuses what clients ask for."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from aeros.apps.mcp.approvals import (
    Approvals,
)
from aeros.cli.main import main
from aeros.exit_codes import Exit

WHAT = {"what": "execute", "client": "c", "steps": [{"skill": "a.b", "inputs": {}}], "goal": "x"}


def test_the_operator_lists_approves_and_refuses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    approvals = Approvals(tmp_path)
    one, other = approvals.request({**WHAT, "client": "evil\x1b[2J"}), approvals.request({"what": "resume"})
    state = ["--state", str(tmp_path)]
    assert main(["approve", *state]) == Exit.SUCCESS
    listed = capsys.readouterr().out
    assert f"{one}  execute, requested by evil\\x1b[2J, 0 s ago\n    a.b\n    until x\n" in listed
    assert f"{other}  resume" in listed
    assert main(["approve", one, *state]) == Exit.SUCCESS
    assert main(["approve", other, "--reject", *state]) == Exit.SUCCESS
    assert approvals.consume(one) is not None
    assert approvals.is_rejected(other)
    assert main(["approve", one, *state]) == Exit.REJECTED
    assert main(["approve", "--reject", *state]) == Exit.USAGE
    assert main(["approve", "--format", "json", *state]) == Exit.SUCCESS
    assert json.loads(capsys.readouterr().out.splitlines()[-1]) == []


def listed(folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    capsys.readouterr()
    assert main(["approve", "--state", str(folder)]) == Exit.SUCCESS
    return capsys.readouterr().out


def test_where_nothing_waits_it_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert listed(tmp_path, capsys) == "no pending approvals\n"
    assert main(["approve", "--format", "json", "--state", str(tmp_path)]) == Exit.SUCCESS
    assert json.loads(capsys.readouterr().out) == []


def test_steps_have_their_inputs_and_the_goal_follows(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    steps = [{"skill": "a.b", "inputs": {"force": 0.5}}, {"skill": "a.c", "inputs": {}}, "a.d"]
    content = {"what": "execute", "client": "c", "task": "a.make(count = 2)", "steps": steps, "goal": "done"}
    id_ = Approvals(tmp_path).request(content)
    assert listed(tmp_path, capsys) == (
        f"{id_}  execute, requested by c, 0 s ago\n"
        "    for a.make(count = 2)\n"
        '    a.b {"force": 0.5}\n    a.c\n    a.d\n    until done\n'
    )


def test_a_request_that_holds_less_is_shown_all_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    id_ = Approvals(tmp_path).request({"what": "resume", "client": "c", "steps": "none", "asked": "noon"})
    assert listed(tmp_path, capsys) == f"{id_}  resume, requested by c\n"


def test_an_answer_is_confirmed_and_an_unknown_request_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    approvals, state = Approvals(tmp_path), ["--state", str(tmp_path)]
    one, other = approvals.request(WHAT), approvals.request({**WHAT, "goal": "y"})
    assert main(["approve", one, *state]) == Exit.SUCCESS
    assert capsys.readouterr().out == f"{one} is approved, once and within ten minutes\n"
    assert main(["approve", other, "--reject", *state]) == Exit.SUCCESS
    assert capsys.readouterr().out == f"{other} is rejected\n"
    assert main(["approve", "\x1b[2J", *state]) == Exit.REJECTED
    message = capsys.readouterr()
    assert message.out == ""
    assert message.err.startswith("aeros: ")
    assert "\x1b" not in message.err
