"""A channel is declared by what can be measured of it, and is refused where there is none."""

from __future__ import annotations

from fractions import Fraction

import pytest

from aeros.sim.gilbert_elliott import GilbertElliottModel
from aeros.spec.diagnostics.errors import MisuseError

THIRD, HALF, ONE = Fraction(1, 3), Fraction(1, 2), Fraction(1)


@pytest.mark.parametrize(
    "channel",
    [
        GilbertElliottModel(THIRD, Fraction(8)),
        GilbertElliottModel(Fraction(7, 10), Fraction(7, 3)),
        GilbertElliottModel(THIRD, Fraction(5), Fraction(4, 5), Fraction(1, 10)),
    ],
)
def test_it_stays_as_it_begins_and_keeps_its_rate(channel: GilbertElliottModel) -> None:
    bad = channel.bad_state_probability
    assert bad * (1 - channel.bad_to_good) + (1 - bad) * channel.good_to_bad == bad
    assert bad * channel.rate_in_bad + (1 - bad) * channel.rate_in_good == channel.rate
    assert 1 / channel.bad_to_good == channel.mean_burst_length
    assert 0 < channel.good_to_bad <= 1
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
def test_impossible_chain_parameters_are_refused(
    rate: Fraction, length: Fraction, within: Fraction, between: Fraction
) -> None:
    with pytest.raises(MisuseError, match="no Gilbert-Elliott chain"):
        GilbertElliottModel(rate, length, within, between)
