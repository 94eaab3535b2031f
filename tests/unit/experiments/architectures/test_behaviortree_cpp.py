"""The tree on BehaviorTree.CPP has its tests beside its twin, in `test_expert_tree.py`; here its errors."""

from __future__ import annotations

import pytest

pytest.importorskip("behaviortreepy", reason="needs `pip install '.[experiments]'`")

from aeros.experiments.architectures.behaviortree_cpp import BehaviorTreeCpp
from aeros.runtime.ports import StepHandle, StepRequest, StepResult
from tests.unit.agent.fake_runtime import FakeRuntime
from tests.unit.experiments.support.dumpling_trials import Trial


def test_an_error_of_a_leaf_passes_through_the_library_unchanged_and_nothing_runs_after_it() -> None:
    class Failing(FakeRuntime):
        def start(self, request: StepRequest) -> StepHandle | StepResult:
            self.started += 1
            raise ZeroDivisionError("in a leaf")

    runtime = Failing()
    with pytest.raises(ZeroDivisionError, match="in a leaf"):
        BehaviorTreeCpp(max_tries=5, max_starts=5).pursue(Trial(runtime=runtime).context)
    assert runtime.started == 1
