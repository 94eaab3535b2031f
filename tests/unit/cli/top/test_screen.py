"""The screen of `aeros top`: what is shown after which keys."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len

from aeros.cli.top.screen import ScreenAction, Style, StyledLine, TopScreen
from tests.hypothesis_profiles import examples

LINES = [StyledLine(f"line {number}") for number in range(100)]


def shown(screen: TopScreen, columns: int = 80, rows: int = 12) -> list[str]:
    text = screen.render(LINES, columns, rows).removeprefix("\x1b[H").removesuffix("\x1b[J")
    return [one.removesuffix("\x1b[K") for one in text.split("\n")]


def screen_of(*, has_colours: bool = False) -> TopScreen:
    return TopScreen(has_keys=True, has_colours=has_colours)


def test_a_stop_is_asked_for_and_any_key_but_y_is_no() -> None:
    screen = screen_of()
    assert screen.press("s") is None
    assert "y: yes" in shown(screen)[-1]
    assert screen.press("n") is None
    assert shown(screen)[-1] == "not stopped"
    for other in ("s", "unknown"):
        screen.press("s")
        assert screen.press(other) is None
        assert screen.press("y") is None
    screen.press("s")
    assert screen.press("y") is ScreenAction.STOP


def test_a_pause_and_the_end_are_not_asked_for() -> None:
    screen = screen_of()
    assert screen.press("p") is ScreenAction.PAUSE
    assert screen.press("q") is ScreenAction.QUIT


@pytest.mark.parametrize(
    ("keys", "first"),
    [
        ([], 0),
        (["down", "down", "up"], 1),
        (["page down"], 10),
        (["end"], 90),
        (["end", "page up", "home", "up"], 0),
    ],
)
def test_keys_scroll(keys: list[str], first: int) -> None:
    screen = screen_of()
    shown(screen)
    for key in keys:
        screen.press(key)
        shown(screen)
    assert shown(screen)[0] == f"line {first}"


def test_a_message_stays_until_the_next_key() -> None:
    screen = screen_of()
    screen.set_message("stopped")
    assert shown(screen)[-1] == "stopped"
    screen.press("down")
    assert shown(screen)[-1].startswith("q quit")


def test_colours_are_shown_if_there_are_any() -> None:
    lines = [StyledLine("broken", Style.BAD)]
    assert "\x1b[1;31mbroken\x1b[0m" in screen_of(has_colours=True).render(lines, 80, 5)
    assert "\x1b[1;31m" not in screen_of().render(lines, 80, 5)


@examples(50)
@given(
    st.lists(
        st.sampled_from(["up", "down", "page up", "page down", "home", "end", "s", "n", "x"]), max_size=20
    ),
    st.integers(1, 200),
    st.integers(1, 120),
    st.lists(st.text(max_size=50), max_size=30),
)
def test_every_screen_fits_the_terminal(keys: list[str], columns: int, rows: int, texts: list[str]) -> None:
    screen = screen_of()
    for key in keys:
        screen.press(key)
        text = screen.render([StyledLine(one) for one in texts], columns, rows)
        lines = text.removeprefix("\x1b[H").removesuffix("\x1b[J").split("\n")
        assert len(lines) <= max(1, rows)
        for line in lines:
            bare = line.removesuffix("\x1b[K")
            assert cell_len(bare) < max(2, columns)
            assert "\x1b" not in bare
