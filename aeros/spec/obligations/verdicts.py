"""Verdicts on claims, conclusions of reports, and claims that are settled when they are made.

Imports no formulas, so that reports can be read without them.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from aeros.spec.diagnostics.codes import Diagnostic, Severity

if TYPE_CHECKING:
    from aeros.spec.obligations.claim_id import ClaimId


class Verdict(Enum):
    """Result of a claim.  It has no truth value on purpose: callers compare."""

    PROVED = "PROVED"
    REFUTED = "REFUTED"
    VACUOUS = "VACUOUS"
    UNKNOWN = "UNKNOWN"

    def __bool__(self) -> bool:
        raise TypeError("a verdict has no truth value; compare it")


class Conclusion(Enum):
    """Result of a report.  It has no truth value on purpose: callers compare."""

    PROVED = "proved"
    REJECTED = "rejected"
    UNDECIDED = "undecided"

    def __bool__(self) -> bool:
        raise TypeError("a conclusion has no truth value; compare it")


@dataclass(frozen=True)
class StaticClaim:
    """A claim over finite sets that needs no solver: it is settled when it is made.

    Attributes:
        id: identity of the claim.
        diagnostic: report of the failure or a warning; None iff nothing is to be reported.
        engine: what decided it and its version, where it is neither AEROS's own reading nor the solver.
        runtime_checked_rule: what is checked at run time instead; None where nothing is.
    """

    id: ClaimId
    diagnostic: Diagnostic | None
    engine: str = ""
    runtime_checked_rule: str | None = None

    @property
    def verdict(self) -> Verdict:
        """REFUTED iff its diagnostic is an error; a warning informs and refutes nothing.

        UNKNOWN where it was not decided (AE509), or is left to a check at run time.
        """
        if self.runtime_checked_rule is not None or (self.diagnostic and self.diagnostic.code == "AE509"):
            return Verdict.UNKNOWN
        refuted = self.diagnostic is not None and self.diagnostic.severity is Severity.ERROR
        return Verdict.REFUTED if refuted else Verdict.PROVED
