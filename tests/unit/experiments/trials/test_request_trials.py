"""Requests at the real gate: each is decided as it is said that it should be, and not without the gate."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.experiments.catalogue import read_data
from aeros.experiments.condition import TrialCondition
from aeros.experiments.trial_kinds import Findings
from aeros.experiments.trials.requests import KIND
from tests.unit.experiments.common import premises

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
def test_what_is_said_besides_is_what_it_is_denied_for(one: dict[str, Any]) -> None:
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
