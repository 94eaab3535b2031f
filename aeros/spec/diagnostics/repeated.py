"""Diagnostics with one cause, which are told once."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from typing import Final, TypeVar

from aeros.spec.diagnostics.codes import Diagnostic

_Cause = TypeVar("_Cause", bound=Hashable)

MAX_USES: Final = 5
"""Places of one cause that are marked."""


def merge_repeated(
    diagnostics: Iterable[Diagnostic],
    cause: Callable[[Diagnostic], _Cause | None],
    merge: Callable[[_Cause, list[Diagnostic]], Diagnostic],
) -> tuple[Diagnostic, ...]:
    """Merge diagnostics of one cause into one, where the first of them was.

    Args:
        diagnostics: diagnostics, in order.
        cause: finds the cause of a diagnostic; None if it stands for itself.
        merge: merges two or more diagnostics of one cause.

    Returns:
        The diagnostics, one for each cause.
    """
    listed = tuple(diagnostics)
    groups: dict[_Cause, list[Diagnostic]] = {}
    for found in listed:
        key = cause(found)
        if key is not None:
            groups.setdefault(key, []).append(found)
    merged = {id(group[0]): merge(key, group) for key, group in groups.items() if len(group) > 1}
    dropped = {id(found) for group in groups.values() for found in group[1:]}
    return tuple(merged.get(id(found), found) for found in listed if id(found) not in dropped)
