"""Versions in and out of a range, by PEP 440."""

from __future__ import annotations

import pytest

from aeros.spec.text.versions import (
    MAX_RANGE,
    MAX_VERSION,
    is_compatible_version,
    parse_range,
    parse_version,
    suits,
)


@pytest.mark.parametrize(
    ("specifier", "inside", "outside"),
    [
        (">=1.0,<2", ["1.0", "1.9.9", "1.0.post1", "1.5rc1"], ["0.9", "2.0", "1.0a1"]),
        ("==1.*", ["1.0", "1.7"], ["2.0"]),
        ("~=1.4", ["1.4", "1.9"], ["1.3", "2.0"]),
        ("", ["0.1", "3.0.dev1"], []),
    ],
)
def test_a_version_is_in_a_range_or_not(specifier: str, inside: list[str], outside: list[str]) -> None:
    assert [is_compatible_version(specifier, one) for one in inside] == [True] * len(inside)
    assert [is_compatible_version(specifier, one) for one in outside] == [False] * len(outside)


@pytest.mark.parametrize(
    "text", ["", "one", "1.0\n", " 1.0", "1.0\u00a0", "1.\u0661", "9" * 5000, "1.0+" + "a" * MAX_VERSION]
)
def test_a_version_is_one_short_line_of_ascii(text: str) -> None:
    with pytest.raises(ValueError, match=r"is not|has|begins|holds"):
        parse_version(text)


@pytest.mark.parametrize(
    "text", ["1.0", "<1.0\n", " <1", "<1,\n<2", "<" + "1" * 5000, ">=1," * MAX_RANGE + "<2"]
)
def test_a_range_is_one_short_line_of_ascii(text: str) -> None:
    with pytest.raises(ValueError, match=r"is not|has|begins|holds"):
        parse_range(text)


def test_the_longest_numbers_are_compared() -> None:
    longest = "9" * MAX_VERSION
    assert parse_version(longest) > parse_version("1")
    assert is_compatible_version(f"<={longest}", longest)


def test_where_a_range_or_a_version_is_none_nothing_suits() -> None:
    assert suits(">=1.0", "1.2")
    assert not suits(">=1.0", "0.9")
    assert not suits("one", "1.2")
    assert not suits(">=1.0", "one")
