"""A worker answers each question once, in plain data, with the question's token; all else is words."""

from __future__ import annotations

import socket
import sys
from collections.abc import Callable
from threading import Thread
from typing import Any

import pytest

from aeros.runtime.isolation import worker as module
from aeros.runtime.isolation.layers import IsolationLayer
from aeros.runtime.isolation.protocol import (
    MAX_RESPONSE_BYTES,
    ActionRequested,
    CloseSkill,
    LoadSkill,
    ResumeSkill,
    SkillClosed,
    SkillDenied,
    SkillFinished,
    SkillLoaded,
    SkillRaised,
    SkillRejected,
    WorkerConnection,
    WorkerResponse,
)
from aeros.runtime.isolation.worker import serve
from aeros.runtime.skills.code import CodeFile

SKILL = """
from aeros.skill import act

def lift(observed, inputs):
    try:
        again = yield act("move", height=inputs["height"], seen=observed["near"])
        yield act("move", seen=again["near"])
        return {"found": True}
    finally:
        BODY
"""


@pytest.fixture
def locked(monkeypatch: pytest.MonkeyPatch) -> list[list[IsolationLayer]]:
    """The layers that workers put on; none is put on this process, whose search path comes back."""
    found: list[list[IsolationLayer]] = []
    monkeypatch.setattr(module, "apply_layers", lambda layers, *_: found.append(layers))
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setattr(sys, "path_importer_cache", dict(sys.path_importer_cache))
    return found


class Talk:
    """A conversation with a worker that runs in a thread of this process."""

    def __init__(self) -> None:
        ours, theirs = socket.socketpair()
        self._theirs = theirs
        self.thread = Thread(target=serve, args=(theirs.fileno(),), daemon=True)
        self.thread.start()
        self._ours = WorkerConnection(ours)

    def ask(self, question: Callable[[bytes], Any]) -> WorkerResponse:
        return self._ours.request(question(self._ours.token()), 20.0)

    def load(self, source: str, function: str = "lift", layers: tuple[str, ...] = ()) -> WorkerResponse:
        content = source.encode()
        return self.ask(
            lambda token: LoadSkill(
                token, layers, CodeFile("m", "skills.py", "/m/skills.py", content), function, {"height": 0.1}
            )
        )

    def resume(self, near: float = 1.0, denial: str = "") -> WorkerResponse:
        return self.ask(lambda token: ResumeSkill(token, {"near": near}, denial))

    def end(self) -> None:
        self._ours.close()
        self.thread.join(20.0)
        assert not self.thread.is_alive()
        self._theirs.close()


@pytest.fixture
def talk(locked: list[list[IsolationLayer]]) -> Any:
    made = Talk()
    yield made
    made.end()


def lifting(body: str = "pass") -> str:
    return SKILL.replace("BODY", body)


def test_a_skill_is_run_action_by_action_to_its_outputs(
    talk: Talk, locked: list[list[IsolationLayer]]
) -> None:
    layer = next(iter(IsolationLayer)).value
    assert isinstance(talk.load(lifting(), layers=(layer,)), SkillLoaded)
    assert locked == [[IsolationLayer(layer)]]
    assert sys.path == []
    first, second = talk.resume(1.5), talk.resume(2.5)
    assert isinstance(first, ActionRequested)
    assert (first.kind, first.parameters) == ("move", {"height": 0.1, "seen": 1.5})
    assert isinstance(second, ActionRequested)
    assert second.parameters == {"seen": 2.5}
    last = talk.resume()
    assert isinstance(last, SkillFinished)
    assert last.outputs == {"found": True}


def test_a_denial_that_the_skill_does_not_catch_is_its_last_answer(talk: Talk) -> None:
    talk.load(lifting())
    talk.resume()
    denied = talk.resume(denial="too near")
    assert isinstance(denied, SkillDenied)
    assert denied.denials == 1


def test_after_its_last_answer_a_worker_is_over(talk: Talk) -> None:
    talk.load("def lift(observed, inputs):\n    return\n    yield")
    assert isinstance(talk.resume(), SkillFinished)
    talk.thread.join(20.0)
    assert not talk.thread.is_alive()


def test_without_a_layer_no_code_is_run(monkeypatch: pytest.MonkeyPatch, talk: Talk) -> None:
    def refused(*_: object) -> None:
        raise OSError(1, "Operation not permitted")

    monkeypatch.setattr(module, "apply_layers", refused)
    answer = talk.load("raise SystemExit")
    assert isinstance(answer, SkillRejected)
    assert answer.reason.startswith("a layer of isolation cannot be applied: ")


@pytest.mark.parametrize(
    ("source", "why"),
    [
        ("def lift(:", "SyntaxError"),
        ("raise KeyError('x')", "KeyError"),
        ("raise SystemExit", "SystemExit"),
        ("def other(observed, inputs):\n    yield", "lift"),
    ],
)
def test_code_that_cannot_be_loaded_is_refused_in_words(source: str, why: str, talk: Talk) -> None:
    answer = talk.load(source)
    assert isinstance(answer, SkillRejected)
    assert why in answer.reason


def test_before_a_skill_is_loaded_nothing_can_be_run(talk: Talk) -> None:
    answer = talk.resume()
    assert isinstance(answer, SkillRaised)
    assert answer.reason == "no skill is loaded"


@pytest.mark.parametrize(
    ("body", "why"),
    [
        ("raise KeyError('x')\n    yield", "KeyError"),
        ("raise SystemExit\n    yield", "SystemExit"),
        ("yield 3", "not an action"),
        ("yield act('move', what=object())", "an action that is not plain data"),
        (
            f"yield act('move', what='x' * {MAX_RESPONSE_BYTES})",
            f"an action of more than {MAX_RESPONSE_BYTES} bytes",
        ),
        ("return 3\n    yield", "outputs"),
        (
            f"return {{'x': 'y' * {MAX_RESPONSE_BYTES}}}\n    yield",
            f"outputs of more than {MAX_RESPONSE_BYTES} bytes",
        ),
    ],
)
def test_an_error_of_a_skill_is_described_in_words(body: str, why: str, talk: Talk) -> None:
    loaded = talk.load(f"from aeros.skill import act\ndef lift(observed, inputs):\n    {body}")
    assert isinstance(loaded, SkillLoaded)
    answer = talk.resume()
    assert isinstance(answer, SkillRaised)
    assert why in answer.reason


@pytest.mark.parametrize(("body", "complaint"), [("pass", None), ("raise KeyError('x')", "KeyError: 'x'")])
def test_closing_runs_the_skills_own_clean_up(body: str, complaint: str | None, talk: Talk) -> None:
    talk.load(lifting(body))
    talk.resume()
    answer = talk.ask(CloseSkill)
    assert isinstance(answer, SkillClosed)
    assert answer.error == complaint


def test_a_skill_that_never_began_has_nothing_to_clean_up(talk: Talk) -> None:
    talk.load(lifting("raise KeyError"))
    answer = talk.ask(CloseSkill)
    assert isinstance(answer, SkillClosed)
    assert answer.error is None
