from __future__ import annotations

import io
import sys
from typing import cast

import pytest

from aeros.agent.instructions.refusals import AmbiguousInstructionError
from aeros.agent.reading.nearest import NearlyUnderstoodError
from aeros.cli.run.instruction import understand_or_ask
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.registry.registry_governor import RegistryGovernor
from tests.unit.agent.dumplings import build, module, site, task

MODULES = {"m": module("m", (), task("a", ("go",), "wrapper_aligned"), task("b", ("go",), "wrapper_aligned"))}

ONE_TASK = {"m": module("m", (), task("a", ("go",), "wrapper_aligned"))}


class Terminal(io.StringIO):
    def __init__(self, text: str = "", *, is_terminal: bool = True) -> None:
        super().__init__(text)
        self.is_terminal = is_terminal

    def isatty(self) -> bool:
        return self.is_terminal


class NobodyElse:
    def inactive_modules(self) -> dict[str, object]:
        return {}


def asked(
    monkeypatch: pytest.MonkeyPatch, instruction: str, typed: str, *, is_terminal: bool = True
) -> tuple[str, str]:
    screen = Terminal(is_terminal=is_terminal)
    monkeypatch.setattr(sys, "stdin", Terminal(typed, is_terminal=is_terminal))
    monkeypatch.setattr(sys, "stderr", screen)
    configuration = build(Configuration, site=site(), modules=MODULES)
    meaning = understand_or_ask(instruction, configuration, cast("RegistryGovernor", NobodyElse()))
    return str(meaning.first), screen.getvalue()


def test_at_a_terminal_the_user_chooses(monkeypatch: pytest.MonkeyPatch) -> None:
    chosen, shown = asked(monkeypatch, "go", "m.b\n")
    assert chosen == "m.b"
    assert "which? m.a, m.b" in shown


@pytest.mark.parametrize(
    ("instruction", "typed", "is_terminal"),
    [("go", "m.b\n", False), ("go", "\n", True), ("go", "m.c\n", True), ("go. go", "m.b\n", True)],
    ids=["in a script", "no answer", "another answer", "a part of an instruction"],
)
def test_otherwise_it_is_refused(
    monkeypatch: pytest.MonkeyPatch, instruction: str, typed: str, is_terminal: bool
) -> None:
    with pytest.raises(AmbiguousInstructionError):
        asked(monkeypatch, instruction, typed, is_terminal=is_terminal)


def test_at_a_terminal_the_user_confirms_what_is_understood_of_an_instruction(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    screen = Terminal()
    monkeypatch.setattr(sys, "stdin", Terminal("yes\n"))
    monkeypatch.setattr(sys, "stderr", screen)
    configuration = build(Configuration, site=site(), modules=ONE_TASK)
    meaning = understand_or_ask("zorble, go", configuration, cast("RegistryGovernor", NobodyElse()))
    assert str(meaning.first) == "m.a"
    assert meaning.instruction == "go"
    assert meaning.account == ("`zorble`: left out, as the operator at the terminal confirmed",)
    assert "without `zorble`: m.a: wrapper_aligned" in screen.getvalue()


@pytest.mark.parametrize(
    ("typed", "is_terminal"),
    [("yes\n", False), ("\n", True), ("y\n", True), ("", True)],
    ids=["in a script", "no answer", "another answer", "end of input"],
)
def test_a_meaning_that_nobody_confirms_is_refused_with_both_reasons(
    monkeypatch: pytest.MonkeyPatch, typed: str, is_terminal: bool
) -> None:
    monkeypatch.setattr(sys, "stdin", Terminal(typed, is_terminal=is_terminal))
    monkeypatch.setattr(sys, "stderr", Terminal(is_terminal=is_terminal))
    configuration = build(Configuration, site=site(), modules=ONE_TASK)
    with pytest.raises(NearlyUnderstoodError, match=r"`zorble`.*without `zorble`, it would be") as refused:
        understand_or_ask("zorble, go", configuration, cast("RegistryGovernor", NobodyElse()))
    assert "m.a: wrapper_aligned" in refused.value.reason
