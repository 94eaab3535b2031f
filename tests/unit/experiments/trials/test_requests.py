"""Requests at the real gate: each is decided as the condition expects, and never without the gate."""

from __future__ import annotations

from dataclasses import replace
from math import isnan
from random import Random
from typing import Any

import pytest

from aeros.experiments.catalogue import read_data
from aeros.experiments.condition import TrialCondition
from aeros.experiments.trial_kinds import Findings
from aeros.experiments.trials.requests import KIND, _is_allowed, _measured, _sample_value
from aeros.runtime.gate.gate import CompiledGate
from tests.unit.experiments.support.common import premises

REQUESTS: list[dict[str, Any]] = read_data("requests.toml")["request"]


def trials(seeds: range, requests: list[dict[str, Any]], *, policy: bool) -> list[Findings]:
    condition = TrialCondition.create("requests", "symbolic", {"policy": policy, "requests": requests})
    with KIND.open(condition, premises()) as trial:
        return [trial(seed) for seed in seeds]


def test_there_are_18_of_which_half_are_invalid_and_say_why() -> None:
    assert len({one["name"] for one in REQUESTS}) == 18
    assert sum(one["allowed"] for one in REQUESTS) == 9
    assert all(("why" in one) is not one["allowed"] for one in REQUESTS)


def test_the_gate_decides_each_request_as_expected() -> None:
    for found in trials(range(20), REQUESTS, policy=True):
        assert (found["wrong"], found["reached"]) == ([], True)
        assert (found["blocked"], found["accepted"], found["rejected"]) == (9, 0, 0)


def test_without_the_gate_everything_passes() -> None:
    (found,) = trials(range(1), REQUESTS, policy=False)
    assert (found["blocked"], found["accepted"], found["rejected"]) == (0, 9, 0)


@pytest.mark.parametrize("one", [one for one in REQUESTS if "risk" in one or "blocked" in one])
def test_risk_and_block_are_optional(one: dict[str, Any]) -> None:
    plain = {name: value for name, value in one.items() if name not in ("risk", "blocked")} | {
        "allowed": True
    }
    (found,) = trials(range(1), [plain], policy=True)
    assert found["wrong"] == []


def test_a_wrong_decision_is_reported() -> None:
    turned = [{**one, "allowed": not one["allowed"]} for one in REQUESTS]
    (found,) = trials(range(1), turned, policy=True)
    assert found["wrong"] == [one["name"] for one in REQUESTS]
    assert not found["reached"]


def test_a_value_that_is_no_number_is_denied() -> None:
    grip = next(one for one in REQUESTS if one["kind"] == "grip" and one["allowed"])
    broken = {**grip, "parameters": {**grip["parameters"], "force": "nan"}, "allowed": False}
    (found,) = trials(range(1), [broken], policy=True)
    assert found["wrong"] == []


# Requests made up here.

GRIP = next(one for one in REQUESTS if one["kind"] == "grip" and one["allowed"])


def found(one: dict[str, Any], **changed: Any) -> Findings:
    (only,) = trials(range(1), [{**one, **changed}], policy=True)
    return only


def test_parameters_are_drawn_by_seed_and_request() -> None:
    drawn = [_sample_value([1.0, 2.0], Random(f"{seed} a")) for seed in (0, 0, 1)]  # noqa: S311 - no secret
    assert drawn[0] == drawn[1] != drawn[2]
    assert all(1.0 <= one <= 2.0 for one in drawn)


@pytest.mark.parametrize(
    ("value", "sampled"),
    [
        (3, 3.0),
        (0.5, 0.5),
        ("open", "open"),
        ([1.0, 1.0], 1.0),
        ([1, [2.0, 2.0], 3], (1.0, 2.0, 3.0)),
    ],
)
def test_a_value_is_a_number_a_range_a_vector_or_a_word(value: Any, sampled: Any) -> None:
    assert _sample_value(value, Random(0)) == sampled  # noqa: S311 - no secret
    assert type(_sample_value(value, Random(0))) is type(sampled)  # noqa: S311 - no secret


def test_a_sampled_value_can_be_no_number() -> None:
    assert isnan(_sample_value("nan", Random(0)))  # noqa: S311 - no secret


def test_a_blocked_skill_and_one_of_higher_risk_are_denied() -> None:
    assert found(GRIP, blocked=True)["rejected"] == 1
    assert found(GRIP, risk="high")["rejected"] == 1


def test_a_block_is_of_one_skill_and_no_other() -> None:
    other = {**GRIP, "name": "other", "skill": "boil" if GRIP["skill"] != "boil" else "wrap"}
    (both,) = trials(range(1), [{**GRIP, "blocked": True, "allowed": False}, other], policy=True)
    assert (both["wrong"], both["blocked"], both["valid"]) == ([], 1, 1)


def test_a_module_that_is_not_there_may_do_nothing() -> None:
    nobody = found(GRIP, module="nobody", allowed=False)
    assert (nobody["blocked"], nobody["invalid"], nobody["valid"], nobody["wrong"]) == (1, 1, 0, [])


@pytest.mark.parametrize(("policy", "blocked", "accepted"), [(True, 1.0, 0.0), (False, 0.0, 1.0)])
def test_an_enforced_policy_is_to_block_what_it_does_not_allow(
    blocked: float, accepted: float, *, policy: bool
) -> None:
    condition = TrialCondition.create("requests", "symbolic", {"policy": policy, "requests": []})
    expected = KIND.expected_values(condition, premises())
    assert expected == {"blocked": blocked, "accepted": accepted, "rejected": 0.0}


def test_a_request_is_the_first_of_its_quota() -> None:
    """A quota of one leaves room for it: nothing was requested before."""
    known = premises()
    site = known.configuration.site
    once = tuple(replace(quota, max_count=1) for quota in site.quotas)
    assert [quota for quota in once if GRIP["kind"] in quota.kinds]
    configuration = replace(known.configuration, site=replace(site, quotas=once))
    measured = _measured(configuration, GRIP["module"])
    assert _is_allowed(CompiledGate(configuration), configuration, GRIP, measured, 0)
