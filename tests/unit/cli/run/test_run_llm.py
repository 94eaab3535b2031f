"""`aeros run --planner llm`, with a server on this machine in place of a language model."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from aeros.cli.main import main
from aeros.cli.run.planners import LLM_KEY
from aeros.exit_codes import Exit
from aeros.runtime.audit.log import verify_log
from tests.unit.agent.stub_llm import says, stub

ECMS = Path(__file__).parents[4] / "ecms"
KEY = "sk-secret"


def _run(folder: Path, *arguments: str, instruction: str = "make dumplings") -> int:
    where = ["--state", str(folder / "state"), "--out", str(folder / "out"), "--ecms", str(ECMS)]
    return main(["run", instruction, "--plant", "symbolic", *where, "--planner", "llm", *arguments])


def step(skill: str, **more: Any) -> dict[str, Any]:
    return {
        "skill": f"make_dumplings.{skill}",
        "inputs": {},
        "retry": 0,
        "between_tries": None,
        "on_failure": None,
        **more,
    }


GOOD = {
    "plan": [step("prepare"), step("recover"), step("wrap", retry=2, between_tries="recover"), step("boil")]
}
READING: dict[str, Any] = {
    "requests": [
        {
            "task": "make_dumplings.make_dumplings",
            "arguments": {},
            "goal": "dumplings_cooked >= count",
            "condition": None,
            "plan": GOOD["plan"],
        }
    ],
    "prohibited": [],
    "words": [{"phrase": "make dumplings", "accounts_for": "request 1"}],
}


def test_a_models_plan_is_verified_then_decided_by_the_gate_and_the_key_is_kept_nowhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("httpx", reason="needs `pip install '.[llm]'`")
    monkeypatch.setenv(LLM_KEY, KEY)
    hasty = {**READING, "requests": [{**READING["requests"][0], "plan": [step("boil")]}]}
    with stub(says(hasty), says(READING)) as server:
        assert _run(tmp_path, "--llm-url", server.url, "--llm-model", "stub") == Exit.SUCCESS
    message = capsys.readouterr()
    assert "goal reached" in message.out
    assert "understood make_dumplings.make_dumplings(count = 1): dumplings_cooked >= count" in message.out
    assert "(it came with the meaning of the instruction)" in message.out
    assert (
        "its precondition `robot_at_bench and dumpling_wrapped and dumplings_cooked < 2` does not hold"
        in json.dumps(server.asked[1])
    )
    assert server.headers[0]["authorization"] == f"Bearer {KEY}"
    assert verify_log(tmp_path / "out" / "audit.jsonl").decisions.allowed > 50
    left = [path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()]
    assert KEY.encode() not in b"".join([*left, message.out.encode(), message.err.encode()])


def test_where_a_model_does_not_help_the_rules_do_or_for_another_goal_a_search(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("httpx", reason="needs `pip install '.[llm]'`")
    with stub(says("I am a teapot.")) as server:
        asked = ["--llm-url", server.url, "--llm-model", "stub"]
        assert _run(tmp_path / "rules", *asked, instruction="make_dumplings") == Exit.SUCCESS
        assert "planned by rules instead, as the language model has no plan" in capsys.readouterr().out
        assert _run(tmp_path / "smt", *asked, "--goal", "dumpling_wrapped") == Exit.SUCCESS
        assert "planned by smt instead, as the language model has no plan" in capsys.readouterr().out


def test_a_model_that_reads_wrongly_starts_nothing_and_the_record_of_a_run_has_the_account(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("httpx", reason="needs `pip install '.[llm]'`")
    asked = ["--llm-model", "stub", "--llm-url"]
    with stub(says("I am a teapot.")) as server:
        assert _run(tmp_path / "teapot", *asked, server.url) == Exit.REJECTED
    assert "so nothing moves: try 1: it is not JSON" in capsys.readouterr().err
    assert not (tmp_path / "teapot" / "out").exists()
    with stub(says(READING)) as server:
        assert _run(tmp_path / "good", *asked, server.url) == Exit.SUCCESS
    record = (tmp_path / "good" / "out" / "audit.jsonl").read_text(encoding="utf-8")
    assert '"account":["`make dumplings`: request 1"]' in record
    assert '"source":"grammar, and `stub` agrees"' in record


@pytest.mark.parametrize("given", [[], ["--llm-url", "http://localhost/v1"], ["--llm-model", "stub"]])
def test_a_model_needs_a_place_and_a_name(
    given: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _run(tmp_path, *given) == Exit.USAGE
    assert "--planner llm, --llm-url and --llm-model must be given together" in capsys.readouterr().err


def test_without_the_client_library_the_error_names_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "httpx", None)
    monkeypatch.delitem(sys.modules, "aeros.agent.planning.llm_client", raising=False)
    monkeypatch.delitem(sys.modules, "aeros.agent.planning.llm", raising=False)
    asked = ["--llm-url", "http://localhost/v1", "--llm-model", "stub"]
    assert _run(tmp_path, *asked) == Exit.REJECTED
    assert (
        "--planner llm needs `pip install '.[llm]'` in the clone of AEROS (httpx is missing)"
        in capsys.readouterr().err
    )
