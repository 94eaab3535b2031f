"""Missing permissions told once: uses of one sensor, actuator or action that is not permitted have one cure.

The error is at the first use, and the others are marked.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Final

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.repeated import MAX_USES, merge_repeated

_CURE: Final = "`permissions."
"""Start of the name of the field to change, in the help of an error about a whole module."""
_CODES: Final = ("AE401", "AE402", "AE405")


def merge_missing_access(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Merge the errors that one more entry under a module's `permissions` would cure into one.

    Args:
        diagnostics: diagnostics of a module, in order.

    Returns:
        The diagnostics with one error for each missing entry, where its first one was.
    """
    return merge_repeated(diagnostics, _cure, lambda _, group: _merge(group))


def _cure(found: Diagnostic) -> tuple[str, tuple[str, ...]] | None:
    """Return code and help of an error that another entry would cure."""
    is_one = found.code in _CODES and found.help and _CURE in found.help[0] and not found.secondary
    return (found.code, found.help) if is_one else None


def _merge(group: list[Diagnostic]) -> Diagnostic:
    spans = dict.fromkeys(found.primary.span for found in group if found.primary is not None)
    return replace(group[0], secondary=tuple(SpanLabel(span, "and here") for span in [*spans][1:MAX_USES]))
