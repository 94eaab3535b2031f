"""Random draws of a trial, and which other trials would draw the same."""

from __future__ import annotations

from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.experiments.failure_models import burst_outcomes, draw_equivalence, module_with_failure_rate
from aeros.experiments.random_stream import OutcomeRandomStream, RandomStream, SeedRandomStream
from aeros.experiments.trial_plants import OpenPlant
from aeros.runtime.ports import Plant
from aeros.sim.symbolic.outcomes import (
    DrawnOutcome,
    OutcomeSampler,
    draw_outcome,
    outcome_probabilities_by_skill,
)
from tests.unit.experiments.support.common import premises, settings

FAILING = "clean_table"


def opened(chance: Any) -> OpenPlant:
    return OpenPlant(cast(Plant, None), {}, chance)


def drawn_stream(seed: int, rate: str, **more: Any) -> tuple[OutcomeRandomStream, OutcomeSampler]:
    """Of a trial where the failing skill of a task fails at `rate`."""
    given = settings(FAILING, rate=rate, **more)
    ecm = premises().configuration.modules[premises().routed(FAILING).module]
    draws = OutcomeSampler(
        outcome_probabilities_by_skill([module_with_failure_rate(ecm, given)]),
        burst_outcomes(ecm, given),
        seed,
    )
    return OutcomeRandomStream(seed, draws, draw_equivalence(ecm, given)), draws


def had(draws: OutcomeSampler, runs: int, **more: Any) -> tuple[DrawnOutcome, ...]:
    """Return the outcomes of the failing skill's runs."""
    name = f"{FAILING}.{settings(FAILING, **more)['skill']}"
    return tuple(DrawnOutcome(name, run, draws.outcome(name, run).id) for run in range(runs))


def test_of_a_seed_alone_what_is_between_two_numbers_is_the_same() -> None:
    stream: RandomStream = SeedRandomStream(7, 0.3)
    assert stream.plant_group == SeedRandomStream(7, 0.5).plant_group != SeedRandomStream(8, 0.3).plant_group
    seen = stream.observed_draws(opened(lambda: (0.2, 0.4)))
    assert stream.equivalent_interval(seen) == (0.2, 0.4)
    would = {rate: SeedRandomStream(7, rate).reproduces(seen) for rate in (0.2, 0.21, 0.3, 0.39, 0.4)}
    assert would == {0.2: False, 0.21: True, 0.3: True, 0.39: True, 0.4: False}


def test_of_a_plant_that_does_not_say_only_the_same_number_is_the_same() -> None:
    stream: RandomStream = SeedRandomStream(7, 0.3)
    seen = stream.observed_draws(opened(None))
    assert stream.equivalent_interval(seen) == (0.3, 0.3)
    assert stream.reproduces(seen)
    assert not SeedRandomStream(7, 0.30001).reproduces(seen)


RATES = st.sampled_from([f"{n}/10" for n in range(1, 10)])


@given(st.integers(0, 200), RATES, st.integers(0, 200), RATES, st.integers(0, 12))
def test_seeds_would_do_the_same_as_long_as_they_draw_the_same(
    seed: int, rate: str, other: int, other_rate: str, runs: int
) -> None:
    stream, draws = drawn_stream(seed, rate)
    others, other_draws = drawn_stream(other, other_rate)
    assert stream.plant_group == others.plant_group
    seen = stream.observed_draws(opened(lambda: had(draws, runs)))
    assert stream.reproduces(seen)
    assert others.reproduces(seen) == (had(draws, runs) == had(other_draws, runs))


@given(st.integers(0, 200), st.integers(1, 99), st.integers(1, 99), st.integers(0, 12))
def test_between_the_numbers_that_are_alike_the_same_seed_does_the_same_and_beyond_not(
    seed: int, percent: int, other: int, runs: int
) -> None:
    stream, draws = drawn_stream(seed, f"{percent}/100")
    seen = stream.observed_draws(opened(lambda: had(draws, runs)))
    low, high = stream.equivalent_interval(seen)
    assert low < percent / 100 < high
    others, _ = drawn_stream(seed, f"{other}/100")
    assert others.reproduces(seen) == (low < other / 100 < high)


@given(st.integers(0, 200), st.integers(2, 40), st.integers(2, 40), st.integers(0, 12))
def test_so_do_bursts_between_mean_lengths(seed: int, length: int, other: int, runs: int) -> None:
    stream, draws = drawn_stream(seed, "3/10", bursts={"mean_length": str(length)})
    seen = stream.observed_draws(opened(lambda: had(draws, runs)))
    low, high = stream.equivalent_interval(seen)
    others, _ = drawn_stream(seed, "3/10", bursts={"mean_length": str(other)})
    if low < other < high:
        assert others.reproduces(seen)


@given(st.integers(0, 200), RATES, st.integers(1, 6), st.integers(0, 5))
def test_another_outcome_anywhere_would_not_be_the_same(seed: int, rate: str, runs: int, at: int) -> None:
    stream, draws = drawn_stream(seed, rate)
    seen = list(had(draws, runs))
    seen[at % runs] = seen[at % runs]._replace(outcome="otherwise")
    assert not stream.reproduces(tuple(seen))


@given(st.integers(0, 200), st.permutations(range(8)))
def test_outcomes_do_not_depend_on_the_order_in_which_they_are_asked_for(seed: int, order: list[int]) -> None:
    bursts = {"bursts": {"mean_length": "4"}}
    name = f"{FAILING}.{settings(FAILING)['skill']}"
    _, one = drawn_stream(seed, "3/10", **bursts)
    _, other = drawn_stream(seed, "3/10", **bursts)
    assert {run: other.outcome(name, run).id for run in order} == {
        run: one.outcome(name, run).id for run in range(8)
    }


def test_without_bursts_an_outcome_is_drawn_by_seed_and_run_alone() -> None:
    _, draws = drawn_stream(3, "1/2")
    given_settings = settings(FAILING, rate="1/2")
    ecm = premises().configuration.modules[FAILING]
    name = f"{FAILING}.{given_settings['skill']}"
    shares = outcome_probabilities_by_skill([module_with_failure_rate(ecm, given_settings)])[name]
    assert draws.outcome(name, 9) == draw_outcome(shares, 3, name, 9)
    with pytest.raises(KeyError):
        draws.outcome("of.nobody", 0)
