"""A module that is loaded while the agent is awake is used by it, and was refused before."""

from __future__ import annotations

from aeros.experiments.condition import TrialCondition
from aeros.experiments.trials.hot_swap import KIND
from tests.unit.experiments.support.common import premises, settings


def test_one_agent_does_what_it_could_not_before() -> None:
    tasks = {
        "first": settings("fetch_object", "aeros", rate="0"),
        "second": settings("clean_table", "aeros", rate="0"),
    }
    condition = TrialCondition.create("hot_swap", "symbolic", tasks)
    with KIND.open(condition, premises()) as trial:
        found = [trial(seed) for seed in range(2)]
    for one in found:
        assert one["refused_before"]
        assert one["swapped"]
        assert (one["first"], one["second"], one["reached"]) == (True, True, True)
        assert one["steps"] == 7
        assert one["swap_s"] > 0
    expected = KIND.expected_values(condition, premises())
    assert expected == {"swapped": 1.0, "second": 1.0, "success": 1.0, "invocations": 7.0}
