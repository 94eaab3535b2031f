"""Keeps something for its next invocation."""

from __future__ import annotations

import builtins

from aeros.skill import Inputs


def attack(inputs: Inputs) -> object:
    if hasattr(builtins, "kept"):
        return builtins.kept
    builtins.kept = "from before"  # type: ignore[attr-defined]
    raise PermissionError("nothing kept")
