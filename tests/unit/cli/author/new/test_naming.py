"""Names of what `aeros new` creates."""

from __future__ import annotations

import argparse

import pytest

from aeros.cli.author.new.naming import MOST_CHARACTERS, identifier, runtime_range


@pytest.mark.parametrize("name", ["cell", "cell_2", "a" * MOST_CHARACTERS])
def test_a_name_is_kept(name: str) -> None:
    assert identifier(name) == name


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("My-Cell", "or `my_cell`"),
        ("../cell", "is not a name"),
        ("", "is not a name"),
        ("true", "is reserved"),
        ("aeros", "is reserved"),
        ("a" * (MOST_CHARACTERS + 1), "at most 60 characters"),
        ("a\x1b[2J", "is not a name"),
    ],
)
def test_no_other_name_is_taken(name: str, reason: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match=reason) as refused:
        identifier(name)
    assert "\x1b" not in str(refused.value)


def test_a_new_module_is_for_this_minor_version() -> None:
    low, high = runtime_range().split(",")
    assert low.startswith(">=")
    assert high.startswith("<")
