from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.usage import Usage
from aeros.spec.model import Quota
from aeros.spec.obligations.quotas import implies
from aeros.spec.source import Source

HERE = Source("site.yaml", "").span(0, 0)
TICK = 1 / 16
"""Fine enough that as many windows fit beside each other as would if time had no ticks."""


def quota(id_: str, at_most: int, within: int, *kinds: str) -> Quota:
    return Quota(id_, frozenset(kinds or ("grip",)), at_most, Fraction(within), HERE)


def most_within(one: Quota, window: int) -> int:
    """The most actions that the gate's own counting lets through in `window` seconds."""
    usage, executed = Usage([one]), 0
    for tick in range(int(window / TICK) + 1):
        while usage.count(tick * TICK)[one.id] < one.at_most:
            usage.executed("grip", tick * TICK)
            executed += 1
    return executed


@given(st.integers(1, 3), st.integers(1, 4), st.integers(1, 9), st.integers(1, 8))
def test_a_quota_implies_another_iff_the_gate_never_finds_the_other_used_up_first(
    at_most: int, within: int, other_at_most: int, other_within: int
) -> None:
    one, other = quota("one", at_most, within), quota("other", other_at_most, other_within)
    assert implies(one, other) == (most_within(one, other_within) <= other_at_most)


@pytest.mark.parametrize(
    ("kinds", "implied"), [(("grip",), True), (("grip", "move"), False), (("move",), False)]
)
def test_a_quota_says_nothing_of_what_it_does_not_count(kinds: tuple[str, ...], implied: bool) -> None:
    assert implies(quota("one", 1, 60), quota("other", 1, 60, *kinds)) is implied
