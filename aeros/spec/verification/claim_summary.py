"""Summaries of claims for reports, small where a claim and its proof may be large."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol, overload

from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.obligations.verdicts import StaticClaim, Verdict

if TYPE_CHECKING:
    from aeros.spec.obligations.claim_id import ClaimId


@dataclass(frozen=True, slots=True)
class ClaimSummary:
    """A claim by its identity, and its result.

    Attributes:
        id: identity of the claim.
        verdict: verdict on it.
        runtime_checked_rule: the invariant that the gate decides each time, if the claim is left to the gate.
        boundary: condition under which the gate then allows an action.
        witness: the values that settled the claim, a line for each; None where there are none.
        diagnostic: report of this claim, if there is one.
        engine: what decided it and its version, where it is neither AEROS's own reading nor the solver.
    """

    id: ClaimId
    verdict: Verdict
    runtime_checked_rule: str | None = None
    boundary: str = ""
    witness: tuple[str, ...] | None = None
    diagnostic: Diagnostic | None = None
    engine: str = ""


def summarize_static_claim(settled: StaticClaim) -> ClaimSummary:
    """Summarize a claim that was settled when it was made.

    Args:
        settled: the claim.

    Returns:
        Its summary.
    """
    return ClaimSummary(
        settled.id,
        settled.verdict,
        settled.runtime_checked_rule,
        diagnostic=settled.diagnostic,
        engine=settled.engine,
    )


def diagnostics_of(claims: Iterable[ClaimSummary]) -> tuple[Diagnostic, ...]:
    """Collect the diagnostics of claims.

    Args:
        claims: the claims.

    Returns:
        The diagnostics, in order; each once, also if several claims have it, as those of two skills that run
        one function.
    """
    found = (one.diagnostic for one in claims if one.diagnostic is not None)
    return tuple(dict.fromkeys(found))


@dataclass(frozen=True, slots=True)
class ClaimCounts:
    """Counts of claims for a line of text.

    Attributes:
        claims: number of claims.
        runtime_checked: each rule that the gate decides, its boundary, and the number of claims with both, in
            order.
    """

    claims: int
    runtime_checked: tuple[tuple[str, str, int], ...] = ()


class OwnClaims(Protocol):
    """The claims about a module by itself, counted before they are read."""

    @property
    def tally(self) -> ClaimCounts:
        """Counts of the claims."""

    def read(self) -> tuple[tuple[ClaimSummary, ...], tuple[ClaimSummary, ...]]:
        """Read the claims.

        Returns:
            Those listed before and those listed after the claims about other modules.
        """


class ListedClaims:
    """The claims about a module by itself, held in memory; implements `OwnClaims`."""

    def __init__(self, before: tuple[ClaimSummary, ...] = (), after: tuple[ClaimSummary, ...] = ()) -> None:
        self._before = before
        self._after = after

    @property
    def tally(self) -> ClaimCounts:
        """Counts of all of them."""
        return Claims.from_claims((*self._before, *self._after)).tally

    def read(self) -> tuple[tuple[ClaimSummary, ...], tuple[ClaimSummary, ...]]:
        """Implement `OwnClaims.read`."""
        return self._before, self._after


class Claims(Sequence[ClaimSummary]):
    """Claims in order, counted before they are read.

    Most runs need only the counts of cached claims, which are then never read.

    Args:
        tally: counts of the claims.
        read: reads the claims, at the first use.
    """

    def __init__(self, tally: ClaimCounts, read: Callable[[], Iterable[ClaimSummary]]) -> None:
        self.tally = tally
        self._read = read

    @classmethod
    def from_claims(cls, claims: Iterable[ClaimSummary]) -> Claims:
        """Make the sequence of claims that are in memory.

        Args:
            claims: the claims.

        Returns:
            The same claims with their counts.
        """
        listed = tuple(claims)
        guarded = Counter(
            (one.runtime_checked_rule, one.boundary) for one in listed if one.runtime_checked_rule is not None
        )
        return cls(ClaimCounts(len(listed), tuple((*pair, n) for pair, n in guarded.items())), lambda: listed)

    @cached_property
    def _read_all(self) -> tuple[ClaimSummary, ...]:
        return tuple(self._read())

    def __len__(self) -> int:
        return self.tally.claims

    @overload
    def __getitem__(self, index: int) -> ClaimSummary: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[ClaimSummary, ...]: ...
    def __getitem__(self, index: int | slice) -> ClaimSummary | tuple[ClaimSummary, ...]:
        return self._read_all[index]
