"""A channel is declared by what can be measured of it, and is refused where there is none."""

from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.sim.gilbert_elliott import Channel
from aeros.spec.diagnostics.errors import MisuseError

THIRD, HALF, ONE = Fraction(1, 3), Fraction(1, 2), Fraction(1)


@pytest.mark.parametrize(
    "channel",
    [
        Channel(THIRD, Fraction(8)),
        Channel(Fraction(7, 10), Fraction(7, 3)),
        Channel(THIRD, Fraction(5), Fraction(4, 5), Fraction(1, 10)),
    ],
)
def test_it_stays_as_it_begins_and_keeps_its_rate(channel: Channel) -> None:
    bad = channel.share_bad
    assert bad * (1 - channel.mends) + (1 - bad) * channel.worsens == bad
    assert bad * channel.within + (1 - bad) * channel.between == channel.rate
    assert 1 / channel.mends == channel.mean_length
    assert 0 < channel.worsens <= 1
    assert channel.process().rate == pytest.approx(float(channel.rate))


@pytest.mark.parametrize(
    ("rate", "length", "within", "between"),
    [
        (Fraction(7, 10), ONE, ONE, Fraction(0)),  # so much of the time cannot be spent in bursts so short
        (THIRD, HALF, ONE, Fraction(0)),
        (THIRD, ONE, THIRD, Fraction(0)),
        (THIRD, ONE, ONE, THIRD),
        (THIRD, ONE, Fraction(2), Fraction(0)),
        (THIRD, ONE, ONE, Fraction(-1)),
        (ONE, Fraction(2), ONE, Fraction(0)),
    ],
)
def test_where_there_is_none_it_is_refused(
    rate: Fraction, length: Fraction, within: Fraction, between: Fraction
) -> None:
    with pytest.raises(MisuseError, match="there is no channel"):
        Channel(rate, length, within, between)
