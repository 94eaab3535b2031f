"""A demand of SafeAgentBench, as a rule of a site, denies a step exactly where the demand forbids it."""

from __future__ import annotations

from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.diagnostics.errors import InternalError
from benchmarks.external.safe_agent_bench.demands import (
    OTHER_STEP,
    Demand,
    DemandGate,
    counts,
    read_demands,
    site_text,
)
from tests.hypothesis_profiles import examples

DEMANDS = read_demands()
DEADLINES = [one for one in DEMANDS if one.kind == "deadline"]


@cache
def _title(demand: Demand) -> str:
    return f"{demand.task} {demand.condition}"


def test_each_task_has_a_demand() -> None:
    assert sorted({one.task for one in DEMANDS}) == list(range(50))
    assert counts(DEMANDS) == {"order": 25, "deadline": 22, "eventual": 3}


@pytest.mark.parametrize("demand", [one for one in DEMANDS if one.kind == "order"], ids=_title)
def test_an_action_is_denied_where_its_condition_does_not_hold(demand: Demand) -> None:
    gate = DemandGate(demand)
    wanted = {name: f"not {name}" not in demand.condition for name in demand.names}
    assert not gate.allows(demand.actions[0])
    gate.measure(wanted)
    assert gate.allows(demand.actions[0])
    for name in demand.names:
        gate.measure({**wanted, name: not wanted[name]})
        assert not gate.allows(demand.actions[0])
        assert gate.allows(OTHER_STEP)


@pytest.mark.parametrize("demand", DEADLINES, ids=_title)
def test_after_a_deadline_only_the_actions_that_end_it_are_allowed(demand: Demand) -> None:
    gate = DemandGate(demand)
    gate.measure(dict.fromkeys(demand.names, False))
    for number in range(1, demand.steps + 2):
        gate.measure(dict.fromkeys(demand.names, True))
        assert gate.allows(OTHER_STEP) is (number < demand.steps)
        assert all(map(gate.allows, demand.actions))
    gate.measure(dict.fromkeys(demand.names, False))
    assert gate.allows(OTHER_STEP)


@examples(40)
@given(steps=st.integers(1, 4), trace=st.lists(st.booleans(), min_size=1, max_size=12))
def test_a_window_of_seconds_counts_the_steps_of_a_deadline(steps: int, trace: list[bool]) -> None:
    gate = DemandGate(Demand(0, "deadline", "faucet_on", ("turn_off_faucet",), steps))
    gate.measure({"faucet_on": False})
    running = 0
    for is_on in trace:
        gate.measure({"faucet_on": is_on})
        running = running + 1 if is_on else 0
        assert gate.allows(OTHER_STEP) is (running < steps)


def test_an_unknown_predicate_denies() -> None:
    gate = DemandGate(DEADLINES[0])
    gate.measure({})
    assert not gate.allows(OTHER_STEP)


def test_a_demand_without_a_bound_is_no_rule() -> None:
    demand = next(one for one in DEMANDS if one.kind == "eventual")
    with pytest.raises(InternalError, match="no rule"):
        site_text(demand)
