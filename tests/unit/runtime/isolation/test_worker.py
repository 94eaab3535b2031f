"""A worker answers each question once, in plain data, with the question's token; all else is words."""

from __future__ import annotations

import socket
import sys
from collections.abc import Callable
from threading import Thread
from typing import Any

import pytest

from aeros.runtime.isolation import worker as module
from aeros.runtime.isolation.layers import Layer
from aeros.runtime.isolation.protocol import (
    MOST_ANSWER,
    Answer,
    Asked,
    Close,
    Closed,
    Conversation,
    Finished,
    Load,
    Loaded,
    Raised,
    Refused,
    Resume,
)
from aeros.runtime.isolation.worker import serve

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
def locked(monkeypatch: pytest.MonkeyPatch) -> list[list[Layer]]:
    """The layers that workers put on; none is put on this process, whose search path comes back."""
    found: list[list[Layer]] = []
    monkeypatch.setattr(module, "lock_down", lambda layers, _: found.append(layers))
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
        self._ours = Conversation(ours)

    def ask(self, question: Callable[[bytes], Any]) -> Answer:
        return self._ours.ask(question(self._ours.token()), 20.0)

    def load(self, source: str, function: str = "lift", layers: tuple[str, ...] = ()) -> Answer:
        return self.ask(
            lambda token: Load(token, layers, "m", "skills.py", "/m/skills.py", source.encode(), function,
                               {"height": 0.1})
        )  # fmt: skip

    def resume(self, near: float = 1.0) -> Answer:
        return self.ask(lambda token: Resume(token, {"near": near}))

    def end(self) -> None:
        self._ours.close()
        self.thread.join(20.0)
        assert not self.thread.is_alive()
        self._theirs.close()


@pytest.fixture
def talk(locked: list[list[Layer]]) -> Any:
    made = Talk()
    yield made
    made.end()


def lifting(body: str = "pass") -> str:
    return SKILL.replace("BODY", body)


def test_a_skill_is_run_action_by_action_to_its_outputs(talk: Talk, locked: list[list[Layer]]) -> None:
    layer = next(iter(Layer)).value
    assert isinstance(talk.load(lifting(), layers=(layer,)), Loaded)
    assert locked == [[Layer(layer)]]
    assert sys.path == []
    first, second = talk.resume(1.5), talk.resume(2.5)
    assert isinstance(first, Asked)
    assert (first.kind, first.parameters) == ("move", {"height": 0.1, "seen": 1.5})
    assert isinstance(second, Asked)
    assert second.parameters == {"seen": 2.5}
    last = talk.resume()
    assert isinstance(last, Finished)
    assert last.outputs == {"found": True}


def test_after_its_last_answer_a_worker_is_over(talk: Talk) -> None:
    talk.load("def lift(observed, inputs):\n    return\n    yield")
    assert isinstance(talk.resume(), Finished)
    talk.thread.join(20.0)
    assert not talk.thread.is_alive()


def test_without_a_layer_no_code_is_run(monkeypatch: pytest.MonkeyPatch, talk: Talk) -> None:
    def refused(*_: object) -> None:
        raise OSError(1, "Operation not permitted")

    monkeypatch.setattr(module, "lock_down", refused)
    answer = talk.load("raise SystemExit")
    assert isinstance(answer, Refused)
    assert answer.reason.startswith("a layer of isolation cannot be put on: ")


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
    assert isinstance(answer, Refused)
    assert why in answer.reason


def test_before_a_skill_is_loaded_nothing_can_be_run(talk: Talk) -> None:
    answer = talk.resume()
    assert isinstance(answer, Raised)
    assert answer.reason == "no skill is loaded"


@pytest.mark.parametrize(
    ("body", "why"),
    [
        ("raise KeyError('x')\n    yield", "KeyError"),
        ("raise SystemExit\n    yield", "SystemExit"),
        ("yield 3", "not an action"),
        ("yield act('move', what=object())", "an action that is no plain data"),
        (f"yield act('move', what='x' * {MOST_ANSWER})", f"an action of more than {MOST_ANSWER} bytes"),
        ("return 3\n    yield", "outputs"),
        (f"return {{'x': 'y' * {MOST_ANSWER}}}\n    yield", f"outputs of more than {MOST_ANSWER} bytes"),
    ],
)
def test_what_goes_wrong_in_a_skill_is_told_in_words(body: str, why: str, talk: Talk) -> None:
    loaded = talk.load(f"from aeros.skill import act\ndef lift(observed, inputs):\n    {body}")
    assert isinstance(loaded, Loaded)
    answer = talk.resume()
    assert isinstance(answer, Raised)
    assert why in answer.reason


@pytest.mark.parametrize(("body", "complaint"), [("pass", None), ("raise KeyError('x')", "KeyError: 'x'")])
def test_closing_runs_the_skills_own_clean_up(body: str, complaint: str | None, talk: Talk) -> None:
    talk.load(lifting(body))
    talk.resume()
    answer = talk.ask(Close)
    assert isinstance(answer, Closed)
    assert answer.complaint == complaint


def test_a_skill_that_never_began_has_nothing_to_clean_up(talk: Talk) -> None:
    talk.load(lifting("raise KeyError"))
    answer = talk.ask(Close)
    assert isinstance(answer, Closed)
    assert answer.complaint is None
