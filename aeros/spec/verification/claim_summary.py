"""What a report tells of claims: a claim and its proof may be large, this is not."""

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
    """A claim by its identity, and what became of it.

    guard: the invariant that the gate decides each time, where that is what became of it.
    boundary: what has to hold for the gate then to allow an action.
    witness: the values that settled it, a line for each; None where there are none.
    diagnostic: what there is to say of it by itself.
    """

    id: ClaimId
    verdict: Verdict
    runtime_checked_rule: str | None = None
    boundary: str = ""
    witness: tuple[str, ...] | None = None
    diagnostic: Diagnostic | None = None


def summarize_static_claim(settled: StaticClaim) -> ClaimSummary:
    """A claim that was settled when it was made."""
    return ClaimSummary(settled.id, settled.verdict, diagnostic=settled.diagnostic)


def diagnostics_of(claims: Iterable[ClaimSummary]) -> tuple[Diagnostic, ...]:
    """What there is to say of `claims`."""
    return tuple(one.diagnostic for one in claims if one.diagnostic is not None)


@dataclass(frozen=True, slots=True)
class ClaimCounts:
    """What a line of text says of claims.

    guarded: each rule that the gate decides with the way it then reads, and of how many claims, in order.
    """

    claims: int
    runtime_checked: tuple[tuple[str, str, int], ...] = ()


class OwnClaims(Protocol):
    """The claims about a module by itself, tallied before they are read."""

    @property
    def tally(self) -> ClaimCounts: ...  # noqa: D102

    def read(self) -> tuple[tuple[ClaimSummary, ...], tuple[ClaimSummary, ...]]:
        """Return those that come before and those that come after the claims about other modules."""


class ListedClaims:
    """The claims about a module by itself; see `OwnClaims`."""

    def __init__(self, before: tuple[ClaimSummary, ...] = (), after: tuple[ClaimSummary, ...] = ()) -> None:
        self._before = before
        self._after = after

    @property
    def tally(self) -> ClaimCounts:
        """Counts of all of them."""
        return Claims.from_claims((*self._before, *self._after)).tally

    def read(self) -> tuple[tuple[ClaimSummary, ...], tuple[ClaimSummary, ...]]:
        """Return them; see `OwnClaims`."""
        return self._before, self._after


class Claims(Sequence[ClaimSummary]):
    """Claims in order, tallied before they are read: of what was kept, most runs need no more."""

    def __init__(self, tally: ClaimCounts, read: Callable[[], Iterable[ClaimSummary]]) -> None:
        self.tally = tally
        self._read = read

    @classmethod
    def from_claims(cls, claims: Iterable[ClaimSummary]) -> Claims:
        """These claims."""
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
