"""Trials of tasks: what is measured is what is exact, within chance, and the same for the same seed."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.experiments.plant_cache import PlantTraceCache
from aeros.experiments.statistics import wilson
from aeros.experiments.trial_kinds import Findings
from aeros.experiments.trials.task import KIND
from tests.unit.experiments.support.common import comparable_findings, condition, premises


def trials(seeds: range, **changed: Any) -> list[Findings]:
    with KIND.open(condition(**changed), premises()) as trial:
        return [trial(seed) for seed in seeds]


@pytest.mark.parametrize("architecture", ["flat", "behaviour_tree", "progprompt", "aeros"])
def test_measured_values_agree_with_exact_values(architecture: str) -> None:
    changed = {"architecture": architecture, "task": "fetch_object"}
    found = trials(range(60), **changed)
    exact = KIND.expected_values(condition(**changed), premises())
    assert not isinstance(exact, str)
    low, high = wilson(sum(one["reached"] for one in found), len(found))
    assert low <= exact["success"] <= high
    steps = sum(one["steps"] for one in found) / len(found)
    assert steps == pytest.approx(exact["invocations"], rel=0.1)


def test_findings_of_a_seed_do_not_depend_on_earlier_runs() -> None:
    both = trials(range(6), architecture="aeros")
    assert [comparable_findings(one) for one in trials(range(3, 6), architecture="aeros")] == [
        comparable_findings(one) for one in both[3:]
    ]


def test_architectures_have_the_same_draws_with_a_seed() -> None:
    flat, tree = (trials(range(20), architecture=name) for name in ("flat", "behaviour_tree"))
    for one, other in zip(flat, tree, strict=True):
        assert one["reached"] <= other["reached"]
        assert one["reached"] == (other["retries"] == 0)


def test_a_gate_that_lets_everything_pass_changes_nothing_where_nothing_is_denied() -> None:
    governed, open_ = (trials(range(5), architecture="aeros", policy=policy) for policy in (True, False))
    assert [comparable_findings(one) for one in governed] == [comparable_findings(one) for one in open_]
    assert all(one["denied"] == 0 for one in governed)


def test_a_variant_leaves_out_what_it_says() -> None:
    variant = {"task": "clean_table", "architecture": "aeros"}
    single = trials(range(12), **variant, options={"retries": 0, "recovery": False, "replans": 0})
    assert {(one["retries"], one["recoveries"], one["replans"]) for one in single} == {(0, 0, 0)}
    assert any(not one["reached"] and "after 0 re-plans" in one["reason"] for one in single)
    retried = trials(range(12), **variant, options={"recovery": False})
    assert all(one["reached"] for one in retried)
    assert any(one["retries"] for one in retried)
    assert not any(one["recoveries"] for one in retried)


def test_an_agent_gives_up_what_chance_does_not_explain_as_is_predicted() -> None:
    changed = {"architecture": "aeros", "rate": "1"}
    (found,) = trials(range(1), **changed)
    assert 1 + found["replans"] + found["retries"] == 8
    assert "failed again as before in the same state" in found["reason"]
    exact = KIND.expected_values(condition(**changed), premises())
    assert not isinstance(exact, str)
    assert 1 + exact["replans"] + exact["retries"] == 8


@pytest.mark.deep
def test_in_place_of_a_plan_that_is_late_the_rest_of_the_one_before_is_followed() -> None:
    options = {"retries": 0, "recovery": False, "replans": 2, "planning_timeout": 3.0, "replan_delay_s": 6.5}
    changed = {"architecture": "aeros", "rate": "1", "options": options}
    (found,) = trials(range(1), **changed)
    # Laid out, and then folded three times: as often as with plans that are in time.
    in_time = trials(range(1), **{**changed, "options": {**options, "replan_delay_s": 0.0}})
    assert (found["late"], found["replans"]) == (2, 2)
    assert (in_time[0]["late"], in_time[0]["replans"], in_time[0]["steps"]) == (0, 2, found["steps"])
    assert "the rest of the previous plan" in str(KIND.expected_values(condition(**changed), premises()))


def test_a_plan_made_in_the_background_is_followed_like_one_made_in_place() -> None:
    changed = {"architecture": "aeros", "rate": "0"}
    options = {"planning_timeout": 6.0, "first_plan_delay_s": 0.0, "replan_delay_s": 0.0}
    (here,), (in_background,) = (trials(range(1), **changed, options=one) for one in ({}, options))
    assert in_background["steps"] == here["steps"]
    assert KIND.expected_values(condition(**changed, options=options), premises()) == KIND.expected_values(
        condition(**changed), premises()
    )


def test_without_a_first_plan_no_step_begins_as_predicted() -> None:
    options = {"replans": 1, "planning_timeout": 0.3, "first_plan_delay_s": 5.0, "replan_delay_s": 5.0}
    changed = {"architecture": "aeros", "options": options}
    (found,) = trials(range(1), **changed)
    expected = KIND.expected_values(condition(**changed), premises())
    assert not isinstance(expected, str)
    assert (found["reached"], found["steps"], found["replans"], found["late"]) == (False, 0, 1, 2)
    assert (expected["success"], expected["invocations"], expected["replans"]) == (0.0, 0.0, 1.0)
    assert "stands still" in found["reason"]


@pytest.mark.parametrize("is_true", [True, False])
def test_where_the_truth_is_known_it_counts_and_the_belief_stands_beside_it(
    is_true: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    changed = {"architecture": "aeros", "rate": "0"}
    (unrefereed,) = trials(range(1), **changed)
    assert (unrefereed["reached"], "believed" in unrefereed) == (True, False)
    # A cache of its own, as a trace keeps the truth.
    monkeypatch.setattr(
        "aeros.experiments.plant_cache.truth_of", lambda _: {"dumplings_cooked": int(is_true)}
    )
    monkeypatch.setattr(KIND, "_traces", PlantTraceCache())
    (found,) = trials(range(1), **changed)
    assert (found["reached"], found["believed"], found["false_claim"]) == (is_true, True, not is_true)


@pytest.mark.parametrize(
    ("name", "why"), [("Raising", "ZeroDivisionError: mine"), ("Endless", "calls without finishing")]
)
def test_an_architecture_that_raises_or_does_not_end_has_failed(name: str, why: str) -> None:
    (found,) = trials(range(1), architecture=f"tests.unit.experiments.support.entered:{name}")
    assert found["reached"] is False
    assert why in found["reason"]


def test_an_architecture_that_only_claims_success_has_none() -> None:
    (found,) = trials(range(1), architecture="tests.unit.experiments.support.entered:Boastful")
    assert (found["reached"], found["steps"], found["raised"]) == (False, 0, "")


@pytest.mark.parametrize("budget", [{"tries": 1}, {"seconds": 20.0}])
def test_a_budget_ends_the_trial_and_its_findings_say_so(budget: dict[str, float]) -> None:
    changed = {"architecture": "aeros", "rate": "1", "budget": budget}
    (found,) = trials(range(1), **changed)
    assert not found["reached"]
    assert found["reason"] == "the budget of the trial is spent"
    assert "retries" not in found  # nobody counted them
    assert not found["raised"]


def test_a_goal_that_is_reached_after_the_time_does_not_count() -> None:
    (whole,) = trials(range(1), architecture="aeros", rate="0")
    assert whole["reached"]
    late = {"seconds": whole["simulated_s"] - 0.5}  # the last step began before it
    (found,) = trials(range(1), architecture="aeros", rate="0", budget=late)
    assert (found["reached"], found["steps"]) == (False, whole["steps"])
    in_time = {"seconds": whole["simulated_s"]}
    (found,) = trials(range(1), architecture="aeros", rate="0", budget=in_time)
    assert found["reached"]
