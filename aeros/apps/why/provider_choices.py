"""Explanation of a choice between providers of a capability, from its note in the audit record.

The log may come from another version of AEROS, so missing or unexpected fields are skipped.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from aeros.spec.model.cause import Cause


def explain_choice(details: Mapping[str, Any]) -> tuple[str, tuple[Cause, ...]]:
    """Explain a choice.

    Args:
        details: Details of a `provider-selected` note.

    Returns:
        The choice in one line, and a cause for each provider that was considered.
    """
    reason = details.get("reason") or "its record, no other reason is written down"
    text = f"{details.get('skill')} was chosen for `{details.get('capability')}`: {reason}"
    return text, tuple(_providers(details.get("options")))


def _providers(listed: Any) -> Iterator[Cause]:
    for one in listed if isinstance(listed, list) else ():
        if not isinstance(one, dict) or not isinstance(record := one.get("record"), dict):
            continue
        text = f"{record.get('successes')} successes and {record.get('failures')} failures in this context"
        if type(seconds := one.get("expected_seconds")) in (int, float):
            text += f", {seconds:.1f} s expected until success"
        if why_not := one.get("why_not"):
            text += f", not now: {why_not}"
        yield Cause("provider", str(one.get("skill")), text)
