"""Faults of a layout in which two bodies overlap, for every plant that has bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.model.scene import SceneBody

MAX_OVERLAP: Final = 0.002
"""Greatest allowed overlap of two bodies, m: the robot's foot overlaps its table by 1.03 mm."""


def overlap_fault(first: str, second: str, declared: Sequence[SceneBody], depth: float) -> Diagnostic:
    """Describe two bodies that overlap.

    Args:
        first: one of them, for people.
        second: the other.
        declared: those of the two that a scene declares, in this order.
        depth: depth of the overlap, m.

    Returns:
        The fault, at the places of the declared bodies.
    """
    labels = [SpanLabel(body.span, f"`{body.name}` is placed here") for body in declared]
    millimetres = f"{1000.0 * depth:.1f} mm"
    return Diagnostic(
        "AE140",
        f"{first} and {second} overlap by {millimetres}",
        labels[0] if labels else None,
        tuple(labels[1:]),
        help=(f"move one of them, or make it smaller, by at least {millimetres}",) if labels else (),
    )
