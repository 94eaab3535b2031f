"""Missing permissions told once: uses of one sensor, actuator or action that is not permitted have one cure.

The error is at the first use, and the others are marked.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Final

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel

_CURE: Final = "`permissions."
"""Start of the name of the field to change, in the help of an error about a whole module."""
_CODES: Final = ("AE401", "AE402", "AE405")
_MAX_USES: Final = 5  # that are marked


def merge_missing_access(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Merge the errors that one more entry under a module's `permissions` would cure into one.

    Args:
        diagnostics: diagnostics of a module, in order.

    Returns:
        The diagnostics with one error for each missing entry, where its first one was.
    """
    listed = tuple(diagnostics)
    uses: dict[tuple[str, tuple[str, ...]], list[Diagnostic]] = {}
    for found in listed:
        if found.code in _CODES and found.help and _CURE in found.help[0] and not found.secondary:
            uses.setdefault((found.code, found.help), []).append(found)
    merged = {id(group[0]): _merge(group) for group in uses.values()}
    dropped = {id(found) for group in uses.values() for found in group[1:]}
    return tuple(merged.get(id(found), found) for found in listed if id(found) not in dropped)


def _merge(group: list[Diagnostic]) -> Diagnostic:
    spans = dict.fromkeys(found.primary.span for found in group if found.primary is not None)
    return replace(group[0], secondary=tuple(SpanLabel(span, "and here") for span in [*spans][1:_MAX_USES]))
