"""Keys, from the bytes that terminals send."""

from __future__ import annotations

import os
import pty
import signal
import termios
import threading
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.cli.top.keyboard import Keyboard, open_keyboard, parse_keys
from tests.hypothesis_profiles import examples


@pytest.mark.parametrize(
    ("data", "keys"),
    [
        (b"q", ["q"]),
        (b"\x1b[A\x1b[B", ["up", "down"]),
        (b"\x1b[5~s", ["page up", "s"]),
        (b"\x1bOFy", ["end", "y"]),
        (b"\x1b[1;5Cq", ["unknown", "q"]),
        (b"\x1b[200~", ["unknown"]),
        (b"\x1bs", ["unknown"]),
        (b"\x1b", ["unknown"]),
        (b"\x1b[", ["unknown"]),
        (b"\xc3\xa9", ["Ã", "©"]),
    ],
)
def test_keys_are_named(data: bytes, keys: list[str]) -> None:
    assert parse_keys(data) == keys


@examples(50)
@given(st.text("0123456789;", max_size=8), st.sampled_from("sqpykjABCDEFGH~"), st.text("sqpyx", max_size=5))
def test_no_letter_of_a_sequence_is_a_key(middle: str, last: str, after: str) -> None:
    keys = parse_keys(f"\x1b[{middle}{last}{after}".encode())
    assert keys[len(keys) - len(after) :] == list(after)
    assert not {"s", "q", "p", "y", "k", "j"} & set(keys[: len(keys) - len(after)])


def test_it_waits_for_keys_and_wakes_at_signals() -> None:
    source, keys = os.pipe()
    wake, signals = os.pipe()
    keyboard = Keyboard(source, wake)
    assert keyboard.wait(0.0) == []
    os.write(signals, b"\x1c")
    assert keyboard.wait(60.0) == []
    os.write(keys, b"p\x1b[A")
    assert keyboard.wait(60.0) == ["p", "up"]
    os.write(keys, b"sy")  # a person presses one after the other: this is pasted text
    assert keyboard.wait(60.0) == ["unknown"]
    os.close(keys)
    assert keyboard.wait(60.0) == []
    assert not keyboard.is_there
    for one in (source, wake, signals):
        os.close(one)


def test_a_sequence_that_comes_in_parts_is_one_key() -> None:
    source, keys = os.pipe()
    wake, signals = os.pipe()
    keyboard = Keyboard(source, wake)
    sender = threading.Thread(target=send_in_parts, args=(keys, (b"\x1b", b"[", b"5", b"~")))
    sender.start()
    assert keyboard.wait(60.0) == ["page up"]
    sender.join()
    for one in (keys, wake, signals, source):
        os.close(one)


def send_in_parts(into: int, parts: tuple[bytes, ...]) -> None:
    for part in parts:
        os.write(into, part)
        time.sleep(0.005)


@pytest.mark.parametrize(
    ("begin", "later", "keys"),
    [
        (b"\x1b[1;5", b"sq", ["unknown", "q"]),
        (b"\x1b[", b"As", ["up", "s"]),
        (b"\x1bO", b"Fq", ["end", "q"]),
        (b"\x1b", b"q", ["q"]),  # Escape, and q after it
        (b"q\x1b[", b"~", ["unknown"]),
    ],
)
def test_no_letter_of_a_sequence_that_comes_late_is_a_key(
    begin: bytes, later: bytes, keys: list[str]
) -> None:
    source, sender = os.pipe()
    wake, signals = os.pipe()
    keyboard = Keyboard(source, wake)
    os.write(sender, begin)
    assert keyboard.wait(60.0)[-1] == "unknown"
    os.write(sender, later)
    assert keyboard.wait(60.0) == keys
    for one in (sender, wake, signals, source):
        os.close(one)


def test_the_terminal_gives_single_keys_and_is_restored(monkeypatch: pytest.MonkeyPatch) -> None:
    master, slave = pty.openpty()
    before = termios.tcgetattr(slave)
    with open(slave, closefd=False) as stream:
        monkeypatch.setattr("sys.stdin", stream)
        handler = signal.getsignal(signal.SIGWINCH)
        with open_keyboard() as keyboard:
            os.write(master, b"s")
            assert keyboard.wait(60.0) == ["s"]
            os.write(master, b"\x1a")  # Ctrl-Z does not suspend it
            assert keyboard.wait(60.0) == ["\x1a"]
            os.kill(os.getpid(), signal.SIGWINCH)
            assert keyboard.wait(60.0) == []
        assert termios.tcgetattr(slave) == before
        assert signal.getsignal(signal.SIGWINCH) == handler
    os.close(master)
    os.close(slave)


def test_without_a_terminal_there_are_no_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", None)
    with open_keyboard() as keyboard:
        assert not keyboard.is_there
        assert keyboard.wait(0.0) == []
