"""Settings of a module: open or not, and the command that sets what is open."""

from __future__ import annotations

import pytest

from aeros.spec.elaborate.module.settings import Setting, configure_command

SUITS = Setting("surface", "bench", ("bench", "table"), False, "set", "a volume")
UNBOUND = Setting("eye", "", ("top", "side"), False, "", "a camera")
UNSUITED = Setting("go", "move", ("travel",), False, "set", "an action kind")
MISSING = Setting("foot", "", (), False, "", "its base")
DEFAULT = Setting("force", "6 N", (), True, "default", "", "1 to 8 N")
UNSET = Setting("count", "", (), True, "default", "", "int")


@pytest.mark.parametrize(
    ("one", "is_open"),
    [(SUITS, False), (UNBOUND, True), (UNSUITED, True), (MISSING, True), (DEFAULT, False), (UNSET, True)],
)
def test_a_setting_is_open_without_a_value_that_suits(one: Setting, is_open: bool) -> None:
    assert one.is_open == is_open


def test_the_command_sets_what_is_open_and_has_a_choice() -> None:
    listed = (SUITS, UNBOUND, UNSUITED, MISSING, DEFAULT, UNSET)
    command = "aeros configure tidy --bind eye=top --bind go=travel --set count=…"
    assert configure_command("tidy", listed) == command


def test_there_is_no_command_if_it_would_set_nothing() -> None:
    assert configure_command("tidy", (SUITS, MISSING, DEFAULT)) == ""
