"""Exceptions become bounded texts, whatever their classes do."""

from __future__ import annotations

from aeros.descriptions import describe_exception, type_name


class MuteError(Exception):
    """An exception whose text cannot be read."""

    def __str__(self) -> str:
        raise RuntimeError("no text")


class Masked(type):
    """A metaclass that gives its classes no name."""

    @property
    def __name__(cls) -> str:  # type: ignore[override]
        raise RuntimeError("no name")


def test_an_exception_is_described_by_its_type_and_message() -> None:
    assert describe_exception(ValueError("no\n such pose")) == "ValueError: no\n such pose"
    assert describe_exception(ValueError("no\n such pose"), one_line=True) == "ValueError: no such pose"


def test_the_message_is_bounded() -> None:
    assert describe_exception(ValueError("x" * 2000)) == f"ValueError: {'x' * 1000}"
    assert describe_exception(ValueError("x" * 2000), 3) == "ValueError: xxx"


def test_an_exception_without_a_readable_message_is_described() -> None:
    assert describe_exception(MuteError()) == "MuteError: (it has no message)"


def test_a_type_name_does_not_ask_the_metaclass() -> None:
    named = Masked("named", (), {})
    assert type_name(named()) == "named"
    assert len(type_name(type("x" * 500, (), {})())) == 100
