"""The one reader of versions and version ranges, by PEP 440.

A version is text of a bounded length on one line, without spaces around it. So every version can be shown,
compared and stored as it is written, wherever it comes from: manifest, bundle, dependency or block.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from packaging.specifiers import SpecifierSet
    from packaging.version import Version

# Functions import `packaging` when they are called: it takes 15 ms, which cached modules need not.

MAX_VERSION: Final = 64
"""Limit on the characters of a version."""

MAX_RANGE: Final = 256
"""Limit on the characters of a version range."""


def parse_version(text: str) -> Version:
    """Parse a version.

    Args:
        text: a version, as in `1.0.0`.

    Returns:
        The version.

    Raises:
        ValueError: it is none, or is too long; the message completes “it …”.
    """
    from packaging.version import InvalidVersion, Version

    _check_form(text, MAX_VERSION)
    try:
        return Version(text)
    except InvalidVersion as error:
        raise ValueError("is not a version") from error


def parse_range(text: str) -> SpecifierSet:
    """Parse a version range.

    Args:
        text: version range, as in `>=1.0,<2`; no text includes every version.

    Returns:
        The range.

    Raises:
        ValueError: it is none, or is too long; the message completes “it …”.
    """
    from packaging.specifiers import InvalidSpecifier, SpecifierSet

    _check_form(text, MAX_RANGE)
    try:
        return SpecifierSet(text)
    except InvalidSpecifier as error:
        raise ValueError("is not a version range") from error


def _check_form(text: str, limit: int) -> None:
    if len(text) > limit:
        raise ValueError(f"has {len(text):,} characters; at most {limit} are allowed")
    if text != text.strip():
        raise ValueError("begins or ends with a space or a line break")
    if not (text.isascii() and text.isprintable()):
        raise ValueError("holds a character that is not a letter, digit or sign of ASCII")


@cache  # a thousand modules need the same few ranges
def is_compatible_version(specifier: str, version: str) -> bool:
    """Tell whether a version is in a version range; pre-releases count.

    Args:
        specifier: version range, such as `>=1.0,<2`.
        version: a version.

    Returns:
        True if the range contains the version.

    Raises:
        ValueError: the range or the version is none.
    """
    return parse_range(specifier).contains(parse_version(version), prereleases=True)


def suits(specifier: str, version: str) -> bool:
    """Tell whether a version is in a version range, where the proof of a manifest reports what is none.

    Args:
        specifier: text of a version range.
        version: text of a version.

    Returns:
        True if the range contains the version; False also if one of them is none.
    """
    try:
        return is_compatible_version(specifier, version)
    except ValueError:
        return False
