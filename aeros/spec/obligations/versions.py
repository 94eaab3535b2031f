"""Whether a version is among those that somebody works with, as PEP 440 has it."""

from __future__ import annotations

from functools import cache


@cache  # a thousand modules ask for the same few
def is_compatible_version(specifier: str, version: str) -> bool:
    """Whether `version`, which may be one before a release, is among those that `specifier` names."""
    from packaging.specifiers import SpecifierSet  # 15 ms, which modules that were kept need not pay

    return SpecifierSet(specifier).contains(version, prereleases=True)
