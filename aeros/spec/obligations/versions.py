"""Check of versions against version ranges, by PEP 440."""

from __future__ import annotations

from functools import cache


@cache  # a thousand modules need the same few ranges
def is_compatible_version(specifier: str, version: str) -> bool:
    """Tell whether a version is in a version range; pre-releases count.

    Args:
        specifier: version range, such as `>=1.0,<2`.
        version: a version.

    Returns:
        True if the range contains the version.
    """
    from packaging.specifiers import SpecifierSet  # takes 15 ms to import, which cached modules need not

    return SpecifierSet(specifier).contains(version, prereleases=True)
