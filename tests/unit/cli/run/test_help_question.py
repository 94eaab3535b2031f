"""A person at a terminal is asked for help; a script is not."""

from __future__ import annotations

import io
import sys

import pytest

from aeros.cli.run.help_question import help_asker


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(
    ("answer", "helped"), [("\n", True), ("done\n", True), ("q\n", False), ("", False), ("No\n", False)]
)
def test_enter_goes_on_and_q_or_the_end_of_input_gives_up(
    monkeypatch: pytest.MonkeyPatch, answer: str, *, helped: bool
) -> None:
    monkeypatch.setattr(sys, "stdin", Terminal(answer))
    shown = Terminal()
    monkeypatch.setattr(sys, "stderr", shown)
    ask = help_asker()
    assert ask is not None
    assert ask("no room for a hand") is helped
    assert "I cannot go on: no room for a hand" in shown.getvalue()


def test_a_script_is_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("\n"))
    assert help_asker() is None
