"""Failures in bursts: drawn as declared, and predicted with the channel in the chain."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import pytest

from aeros.experiments.architecture import build_architecture
from aeros.experiments.exact_prediction import predict
from aeros.experiments.failure_models import add_channel_state, burst_outcomes
from aeros.experiments.trials.task import KIND
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.markov_chain import Prediction
from tests.unit.experiments.support.common import FAILURES, condition, model, premises, settings

TASKS = sorted(FAILURES)


def exact(
    name: str, task: str, bursts: Mapping[str, str], options: Mapping[str, Any] | None = None
) -> dict[str, Fraction]:
    given = settings(task, bursts=bursts)
    total = dict.fromkeys(Prediction.__dataclass_fields__, Fraction(0))
    for share, one in add_channel_state(model(task=task), given):
        found = predict(lambda: build_architecture(name, options or {}), one)
        total = {field: value + share * getattr(found, field) for field, value in total.items()}
    return total


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize(("name", "tries"), [("flat", 1), ("behaviour_tree", 3), ("progprompt", 3)])
def test_so_many_attempts_fail_together_where_a_burst_lasts_as_long(task: str, name: str, tries: int) -> None:
    rate = Fraction(FAILURES[task][2])
    failing = rate * (1 - Fraction(1, 8)) ** (tries - 1)
    assert exact(name, task, {"mean_length": "8"})["success"] == 1 - failing


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("name", ["behaviour_tree", "aeros"])
def test_a_channel_without_memory_is_independence(task: str, name: str) -> None:
    without_memory = {"mean_length": str(1 / (1 - Fraction(FAILURES[task][2])))}
    independent = predict(lambda: build_architecture(name, {}), model(task=task))
    assert exact(name, task, without_memory) == {
        field: getattr(independent, field) for field in Prediction.__dataclass_fields__
    }


def enumerated(rate: Fraction, within: Fraction, between: Fraction, length: Fraction, tries: int) -> Fraction:
    """The chance of so many failures in a row, path by path through the channel's states."""
    bad = (rate - between) / (within - between)
    leaves = {True: 1 / length, False: bad / (1 - bad) / length}
    paths = [(True, bad * within), (False, (1 - bad) * between)]
    for _ in range(tries - 1):
        paths = [
            (now, chance * (leaves[was] if now != was else 1 - leaves[was]) * (within if now else between))
            for was, chance in paths
            for now in (True, False)
        ]
    return sum((chance for _, chance in paths), Fraction(0))


def test_failures_between_bursts_and_successes_within_are_counted_path_by_path() -> None:
    bursts = {"mean_length": "6", "within": "4/5", "between": "1/10"}
    failing = enumerated(Fraction(3, 10), Fraction(4, 5), Fraction(1, 10), Fraction(6), 3)
    assert exact("behaviour_tree", "make_dumplings", bursts)["success"] == 1 - failing


def test_without_recovery_so_many_plans_and_tries_are_so_many_attempts() -> None:
    found = exact("aeros", "clean_table", {"mean_length": "8"}, {"recovery": False, "replans": 2})
    assert found["success"] == 1 - Fraction(2, 5) * Fraction(7, 8) ** 5


def test_a_skill_that_helps_where_others_fail_is_not_predicted() -> None:
    given = settings(bursts={"mean_length": "8"}, skill="recover")
    with pytest.raises(StateSpaceError, match="`recover` also helps"):
        list(add_channel_state(model(), given))


def test_the_plant_of_a_condition_with_bursts_draws_by_its_channel() -> None:
    assert burst_outcomes(model().ecm, settings()) == {}
    (name, bursts), *none = burst_outcomes(model().ecm, settings(bursts={"mean_length": "8"})).items()
    assert (name, none) == ("make_dumplings.wrap", [])
    assert {one.id: share for one, share in bursts.good if share} == {"wrapped": 1}
    assert {one.id: share for one, share in bursts.bad if share} == {"not_sealed": 1}


def test_trials_agree_with_the_chain_that_has_the_channel_and_not_with_independence() -> None:
    changed = condition(architecture="behaviour_tree", bursts={"mean_length": "32"})
    with KIND.open(changed, premises()) as trial:
        found = [trial(seed) for seed in range(150)]
    expected = KIND.expected_values(changed, premises())
    assert not isinstance(expected, str)
    assert expected["independent_success"] == pytest.approx(0.973)
    assert expected["success"] == pytest.approx(1 - 0.3 * (31 / 32) ** 2)
    failed = sum(not one["reached"] for one in found) / len(found)
    spread = (expected["success"] * (1 - expected["success"]) / len(found)) ** 0.5
    assert abs(failed - (1 - expected["success"])) < 3 * spread
    assert abs(failed - (1 - expected["independent_success"])) > 5 * spread
    first = sum(one["first_failed"] for one in found) / len(found)
    assert abs(first - expected["first"]) < 3 * spread
