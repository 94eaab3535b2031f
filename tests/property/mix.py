"""Comparison of verdicts with enumeration, and a check that both kinds were met often enough."""

from __future__ import annotations

from collections import Counter, defaultdict


class Mix:
    """Compares verdicts, and counts by code how often a proof and how often a refutation was right."""

    def __init__(self) -> None:
        self._seen: defaultdict[str, Counter[bool]] = defaultdict(Counter)

    def compare(self, code: str, *, proved: bool, expected: bool) -> None:
        """No false proof, no false refutation."""
        assert proved is expected, f"{code} is {'proved' if proved else 'refuted'}"
        self._seen[code][expected] += 1

    def count(self, code: str) -> int:
        """Count the cases of the rarer verdict."""
        return min(self._seen[code][True], self._seen[code][False])

    def assert_both(self, *codes: str, at_least: int = 5) -> None:
        """A generator that gives all but nothing of one kind would show nothing."""
        assert sorted(codes) == sorted(self._seen), self._seen.keys()
        lopsided = {
            code: dict(seen) for code, seen in self._seen.items() if min(seen[True], seen[False]) < at_least
        }
        assert not lopsided, lopsided
