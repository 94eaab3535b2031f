from __future__ import annotations

import io
import sys

import pytest

from aeros.cli.terminal.questions import is_attended, is_confirmed


class Stream(io.StringIO):
    def __init__(self, text: str = "", *, is_terminal: bool = True) -> None:
        super().__init__(text)
        self.is_terminal = is_terminal

    def isatty(self) -> bool:
        return self.is_terminal


@pytest.mark.parametrize(("reads", "shows"), [(True, True), (True, False), (False, True), (False, False)])
def test_a_user_is_there_if_input_and_error_output_are_terminals(
    monkeypatch: pytest.MonkeyPatch, reads: bool, shows: bool
) -> None:
    monkeypatch.setattr(sys, "stdin", Stream(is_terminal=reads))
    monkeypatch.setattr(sys, "stderr", Stream(is_terminal=shows))
    assert is_attended() is (reads and shows)


@pytest.mark.parametrize(
    ("typed", "confirmed"),
    [("yes\n", True), (" yes \n", True), ("y\n", False), ("YES\n", False), ("\n", False), ("", False)],
)
def test_only_yes_confirms(monkeypatch: pytest.MonkeyPatch, typed: str, confirmed: bool) -> None:
    screen = Stream()
    monkeypatch.setattr(sys, "stdin", Stream(typed))
    monkeypatch.setattr(sys, "stderr", screen)
    assert is_confirmed() is confirmed
    assert screen.getvalue() == "carry this out? yes or no: "
