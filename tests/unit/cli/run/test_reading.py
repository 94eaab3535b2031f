"""`--planner llm` reads the instruction: the grammar agrees, or an operator confirms, or nothing moves."""

from __future__ import annotations

import argparse
import sys
from typing import Any, cast

import pytest

from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.refusals import InstructionError, NothingAskedError
from aeros.cli.run.reading import find_meaning
from aeros.exit_codes import UsageError
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.registry.registry_governor import RegistryGovernor
from tests.unit.agent.dumplings import build
from tests.unit.agent.reading.test_reader import GOOD, POLITE, reference
from tests.unit.agent.reading.wrong_answers import WRONG_ANSWERS, answer_of, modules_of, step
from tests.unit.agent.stub_llm import Stub, says, stub
from tests.unit.cli.run.test_instruction import NobodyElse, Terminal

pytest.importorskip("httpx", reason="needs `pip install '.[llm]'`")

FOLD = "fold me a raw one"
FOLDED = {
    **GOOD,
    "requests": [
        {
            **GOOD["requests"][0],
            "goal": "dumpling_wrapped and not dumpling_cooked",
            "plan": [step(f"make_dumplings.{skill}") for skill in ("prepare", "recover", "wrap")],
        }
    ],
    "words": [{"phrase": FOLD, "accounts_for": "request 1"}],
}


@pytest.fixture(autouse=True)
def _hardly_any_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("aeros.agent.reading.reader._RETRY_DELAY_S", 0.01)


def options(instruction: str, server: Stub, **other: Any) -> argparse.Namespace:
    given = {
        "instruction": instruction,
        "planner": "llm",
        "llm_url": server.url,
        "llm_model": "stub",
        **dict.fromkeys(("task", "goal", "composition", "pddl_engine", "planning_timeout")),
        **dict.fromkeys(("resume", "serve_plant", "supervised"), False),
    }
    return argparse.Namespace(**{**given, **other})


def meaning_of(
    instruction: str, server: Stub, configuration: Configuration | None = None, **other: Any
) -> Understanding:
    governor = cast("RegistryGovernor", NobodyElse())
    return find_meaning(options(instruction, server, **other), configuration or reference(), governor)


def at_terminal(monkeypatch: pytest.MonkeyPatch, typed: str, *, is_terminal: bool = True) -> Terminal:
    screen = Terminal(is_terminal=is_terminal)
    monkeypatch.setattr(sys, "stdin", Terminal(typed, is_terminal=is_terminal))
    monkeypatch.setattr(sys, "stderr", screen)
    return screen


@pytest.mark.parametrize("name", WRONG_ANSWERS)
def test_a_wrong_answer_moves_nothing_in_a_script(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    case = WRONG_ANSWERS[name]
    at_terminal(monkeypatch, "yes\n", is_terminal=False)
    site = reference().site
    configuration = build(Configuration, site=site, modules=modules_of(case, reference().modules, site))
    with stub(says(answer_of(case))) as server, pytest.raises(InstructionError) as refusal:
        meaning_of(case["instruction"], server, configuration)
    assert case["reason"] in str(refusal.value)


@pytest.mark.parametrize(
    "name", [name for name, case in WRONG_ANSWERS.items() if case["refused_by"] != "operator"]
)
def test_an_operator_is_not_asked_about_an_answer_that_is_refused(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = WRONG_ANSWERS[name]
    screen = at_terminal(monkeypatch, "yes\n")
    site = reference().site
    configuration = build(Configuration, site=site, modules=modules_of(case, reference().modules, site))
    with stub(says(answer_of(case))) as server, pytest.raises(InstructionError):
        meaning_of(case["instruction"], server, configuration)
    assert "carry this out" not in screen.getvalue()


def test_an_operator_sees_the_formal_goal_and_confirms_it(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = at_terminal(monkeypatch, "yes\n")
    with stub(says(FOLDED)) as server:
        meaning = meaning_of(FOLD, server)
    assert "make_dumplings.dumpling_wrapped and (not make_dumplings.dumpling_cooked)" in screen.getvalue()
    assert meaning.source == "`stub`, confirmed by the operator at the terminal"
    assert meaning.account == (f"`{FOLD}`: request 1",)


@pytest.mark.parametrize("typed", ["no\n", "\n", "", "y\n", "yes please\n"])
def test_without_a_plain_yes_nothing_moves(typed: str, monkeypatch: pytest.MonkeyPatch) -> None:
    at_terminal(monkeypatch, typed)
    with stub(says(FOLDED)) as server, pytest.raises(InstructionError, match="did not confirm"):
        meaning_of(FOLD, server)


def test_where_both_agree_nobody_is_asked_and_the_reading_is_shown(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    at_terminal(monkeypatch, "", is_terminal=False)
    with stub(says(POLITE)) as server:
        meaning = meaning_of("please make dumplings", server)
    assert meaning.source == "grammar, and `stub` agrees"
    shown = capsys.readouterr().out
    assert "understood make_dumplings.make_dumplings(count = 1): dumplings_cooked >= count" in shown
    assert "understood asks for nothing: `please`" in shown


@pytest.mark.parametrize("instruction", ["do not make dumplings", "make dumplings but don't make dumplings"])
def test_the_model_is_not_asked_to_overrule_a_prohibition(instruction: str) -> None:
    with stub(says(GOOD)) as server, pytest.raises(NothingAskedError):
        meaning_of(instruction, server)
    assert server.asked == []


@pytest.mark.parametrize(
    "other",
    [
        {"instruction": "make_dumplings"},
        {"goal": "dumpling_wrapped"},
        {"resume": True},
        {"serve_plant": True},
    ],
    ids=["a task's name", "a formal goal", "a resumed run", "a plant's own process"],
)
def test_the_model_does_not_read_these(other: dict[str, Any]) -> None:
    given = {"instruction": "make dumplings", **other}
    with stub(says(GOOD)) as server:
        assert meaning_of(given.pop("instruction"), server, **given).source == "grammar"
    assert server.asked == []


def test_a_supervised_run_needs_a_meaning_that_survives_a_crash() -> None:
    with stub(says(FOLDED)) as server, pytest.raises(Exception, match="survives a crash"):
        meaning_of(FOLD, server, supervised=True)


def test_options_are_checked_before_the_model_is_asked() -> None:
    with stub(says(GOOD)) as server, pytest.raises(UsageError):
        meaning_of("make dumplings", server, llm_model=None)
    assert server.asked == []


@pytest.mark.parametrize(
    ("task", "reason"),
    [
        ("make_dumpling", "there is no task `make_dumpling`; did you mean `make_dumplings`?"),
        ("qqq", "there is no task `qqq`; `aeros tasks` lists the tasks"),
        ("make", "there is no task `make`; `aeros tasks` lists the tasks"),
    ],
)
def test_a_name_that_is_no_task_is_not_read_as_english(task: str, reason: str) -> None:
    asked = argparse.Namespace(
        instruction=task, task=[task], planner=None, goal=None, resume=False, serve_plant=False
    )
    for option in ("llm_url", "llm_model", "pddl_engine", "planning_timeout", "composition"):
        setattr(asked, option, None)
    with pytest.raises(InstructionError) as refused:
        find_meaning(asked, reference(), cast("RegistryGovernor", NobodyElse()))
    assert refused.value.reason == reason
