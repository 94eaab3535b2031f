"""Text about measurements that failed: a perceiver or a tool gave no values that could be used."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

RecordEvent = Callable[[str, Mapping[str, Any]], object]
"""Writes an event of perceivers or tools, with its details, into the audit record."""

PERCEIVER_FAILED: Final = "perceiver-failed"
PERCEIVER_UNSURE: Final = "perceiver-unsure"
TOOL_FAILED: Final = "tool-failed"


def failure_text(event: str, details: Mapping[str, Any]) -> str:
    """Describe a failed measurement in one line.

    Args:
        event: kind of the event.
        details: its data.

    Returns:
        The line; empty for an event of another kind.
    """
    if event == PERCEIVER_UNSURE:
        values = details.get("uncertainties")
        listed = [f"{name} to {text}" for name, text in values.items()] if isinstance(values, Mapping) else []
        source = f"perceiver `{details.get('module')}.{details.get('perceiver')}`"
        return f"{source} is less certain than declared, so unknown: {'; '.join(listed)}" if listed else ""
    if event == PERCEIVER_FAILED:
        source = f"perceiver `{details.get('module')}.{details.get('perceiver')}`"
    elif event == TOOL_FAILED:
        source = f"tool `{details.get('tool')}`"
    else:
        return ""
    names = details.get("unknown")
    unknown = ", ".join(map(str, names)) if isinstance(names, list) else ""
    return f"{source} failed: {details.get('reason')}" + (f"; unknown: {unknown}" if unknown else "")
