"""Versions in and out of a range, by PEP 440."""

from __future__ import annotations

import pytest

from aeros.spec.text.versions import is_compatible_version


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
