"""What a report tells of a claim: the claim and its proof may be large, this is not."""

from __future__ import annotations

from dataclasses import dataclass

from aeros.spec.diagnostics import Diagnostic
from aeros.spec.obligations.obligation import Verdict


@dataclass(frozen=True, slots=True)
class Told:
    """A claim by its id, and what became of it.

    guard: the invariant that the gate decides each time, where that is what became of it.
    boundary: what has to hold for the gate then to allow an action.
    witness: the values that settled it, a line for each; None where there are none.
    diagnostic: what there is to say of it by itself.
    """

    id: str
    verdict: Verdict
    guard: str | None = None
    boundary: str = ""
    witness: tuple[str, ...] | None = None
    diagnostic: Diagnostic | None = None
