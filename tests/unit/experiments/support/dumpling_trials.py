"""Trials of the dumpling task over a runtime in memory: contexts as architectures get them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import cast

from aeros.agent.planning.routing import RoutedTask
from aeros.experiments.architecture import NO_BUDGET, Budget
from aeros.experiments.trial_context import CountingRuntime, TrialContextImpl
from aeros.runtime.ports import Runtime
from aeros.spec.model.ecm import Task
from tests.unit.agent.dumplings import MAKE_DUMPLINGS
from tests.unit.agent.fake_runtime import Ending, FakeRuntime

WRAP = ("dumpling", "wrap")


class Trial:
    """A runtime, what counts at it, and the context."""

    def __init__(
        self,
        endings: Mapping[str, Sequence[Ending]] | None = None,
        runtime: FakeRuntime | None = None,
        task: Task = MAKE_DUMPLINGS,
        *,
        judge: bool = True,
        budget: Budget = NO_BUDGET,
    ) -> None:
        scripted = {name: list(listed) for name, listed in (endings or {}).items()}
        self.runtime = runtime or FakeRuntime(endings=scripted)
        self.counting = CountingRuntime(
            cast(Runtime, self.runtime), WRAP, judge_by_measurement=judge, budget=budget
        )
        self.context = TrialContextImpl(self.counting, RoutedTask("dumpling", task), 7)
