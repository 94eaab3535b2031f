"""The language model of a program's planner reads instructions, and has to agree with the grammar."""

from __future__ import annotations

from typing import Any

import pytest

import aeros
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.planning.base import RulePlanner
from tests.repo.tree import ROOT
from tests.unit.agent.reading.test_reader import GOOD, reference
from tests.unit.agent.stub_llm import Stub, says, stub
from tests.unit.cli.run.test_reading import FOLD, FOLDED

pytest.importorskip("httpx", reason="needs `pip install '.[llm]'`")

from aeros.agent.planning.llm import LlmPlanner
from aeros.agent.planning.llm_client import LlmEndpoint


@pytest.fixture(autouse=True)
def _hardly_any_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("aeros.agent.reading.reader._RETRY_DELAY_S", 0.01)


def run(instruction: str, server: Stub) -> str:
    """Audit log of a session whose planner asks the stub."""
    planner = LlmPlanner(reference().site, LlmEndpoint(server.url, "stub"), RulePlanner(), 30.0)
    with aeros.open_session(ROOT / "ecms", planner=planner) as session:
        assert session.run(instruction).reached
        return (session.out / "audit.jsonl").read_text()


def test_a_model_that_agrees_with_the_grammar_is_named_in_the_audit_log() -> None:
    with stub(says(GOOD)) as server:
        assert "grammar, and `stub` agrees" in run("make dumplings", server)
        assert server.asked


@pytest.mark.parametrize(
    ("instruction", "answer", "reason"),
    [
        ("clean the table", GOOD, "gave no reading"),
        (FOLD, FOLDED, "an operator has to confirm"),
        ("do not make dumplings", GOOD, "is prohibited, so nothing moves"),
    ],
)
def test_without_agreement_nothing_moves(instruction: str, answer: dict[str, Any], reason: str) -> None:
    with stub(says(answer)) as server, pytest.raises(InstructionError, match=reason):
        run(instruction, server)


def test_the_name_of_a_task_is_not_read() -> None:
    with stub(says("never asked")) as server:
        assert "agrees" not in run("make_dumplings", server)
