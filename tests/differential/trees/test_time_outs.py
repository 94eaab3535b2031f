"""Imported time-outs end the same leaves as BehaviorTree.CPP's, whose timer runs in real time.

An action is either done at the next tick, or never by itself.  So the order of leaves depends on no speed, as
long as 0.2 s suffice for some ticks.
"""

from __future__ import annotations

import time
from collections import Counter
from itertools import count
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import behaviortreepy as bt
from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.execution.journal import Journal
from aeros.agent.execution.plan_executor import PlanExecutor
from aeros.agent.execution.step_attempt import StepRunner
from aeros.agent.planning.compositions import composition_to_graph
from aeros.apps.trees.tree_export import export_tree
from aeros.runtime.ports import EndedStep, StepResult, StepStatus
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from tests.differential.real_loop import Forgetful
from tests.differential.trees.test_leaf_order import MOST_ACTIONS, Yard, file_of, imported
from tests.hypothesis_profiles import examples
from tests.unit.agent.fake_runtime import FakeRuntime

SECONDS = 0.2
LONG = 3600
SEEN = Counter[str]()
Ends = dict[str, bool | None]
"""Of each action its success; None if it never ends by itself."""


@st.composite
def timed_trees(draw: st.DrawFn) -> tuple[str, Ends]:
    """Draw a tree with at most two time-outs that pass, and the end of each action."""
    numbers, passing = count(), count()
    ends: Ends = {}

    def action(may_hang: bool) -> str:
        number = next(numbers)
        if number >= MOST_ACTIONS:
            return "<AlwaysSuccess/>"
        options = [True, True, False] + ([None, None] if may_hang else [])
        ends[f"a{number}"] = draw(st.sampled_from(options))
        return f'<Action ID="a{number}"/>'

    def timed() -> str:
        passes = next(passing) < 2
        tag = draw(st.sampled_from(["Sequence", "Fallback"]))
        inner = "".join(action(passes) for _ in range(draw(st.integers(1, 3))))
        if "Action" not in inner:
            return inner.partition("/>")[0] + "/>"
        time_ = int((SECONDS if passes else LONG) * 1000)
        return f'<Timeout msec="{time_}"><{tag}>{inner}</{tag}></Timeout>'

    def tree(depth: int) -> str:
        tag = draw(st.sampled_from(["Sequence", "Fallback", "Fallback", "ForceSuccess", "timed", "retry"]))
        if not depth or tag == "timed":
            return timed() if draw(st.booleans()) or depth else action(False)
        if tag == "retry":
            return f'<RetryUntilSuccessful num_attempts="2">{tree(depth - 1)}</RetryUntilSuccessful>'
        if tag == "ForceSuccess":
            return f"<{tag}>{tree(depth - 1)}</{tag}>"
        return f"<{tag}>{tree(depth - 1)}{tree(depth - 1)}</{tag}>"

    return f"<Sequence>{action(False)}{tree(2)}</Sequence>", ends


def reference_run(xml: str, ends: Ends) -> tuple[bool, list[str]]:
    started, running = list[str](), set[str]()
    factory = bt.BehaviorTreeFactory()

    def add(name: str) -> None:
        def start(_: Any) -> Any:
            started.append(name)
            running.add(name)
            return bt.NodeStatus.RUNNING

        def go_on(_: Any) -> Any:
            if ends[name] is None:
                return bt.NodeStatus.RUNNING
            running.discard(name)
            return bt.NodeStatus.SUCCESS if ends[name] else bt.NodeStatus.FAILURE

        factory.register_simple_stateful_action(name, start, go_on, lambda _: running.discard(name))

    for name in ends:
        add(name)
    tree = factory.create_tree_from_text(xml)
    while True:
        found = tree.tick_exactly_once()
        if found != bt.NodeStatus.RUNNING:
            return found == bt.NodeStatus.SUCCESS, started
        if any(ends[name] is None for name in running):
            time.sleep(SECONDS / 20)


class Quick(FakeRuntime):
    """A runtime in which an action is done at once, or never by itself."""

    def __init__(self, module: Ecm, site: Site, ends: Ends) -> None:
        super().__init__({module.id: module}, at=site)
        self._ends = ends
        self.state = dict.fromkeys((f"ended_{number}" for number in range(MOST_ACTIONS)), False)
        self.state |= {"stop_pressed": False} | dict.fromkeys(("c0", "c1", "c2"), False)

    def wait(self, until: float = inf) -> EndedStep | None:
        (handle,) = self.under_way
        skill = self.under_way[handle].skill
        if handle in self.cancelled:
            del self.under_way[handle]
            return EndedStep(handle, StepResult(StepStatus.CANCELLED, self.cancelled[handle]))
        if self._ends[skill] is None:
            assert until < inf
            SEEN["late"] += 1
            self.clock = until
            return None
        del self.under_way[handle]
        self.clock += 0.001
        self.state["ended_" + skill.removeprefix("a")] = self._ends[skill]
        return EndedStep(handle, StepResult(StepStatus.FINISHED, ""))


def own_run(module: Ecm, site: Site, ends: Ends) -> tuple[bool, list[str]]:
    runtime = Quick(module, site, ends)
    memory = Forgetful()
    journal = Journal(runtime, memory, None)
    engine = PlanExecutor(StepRunner(runtime, memory, journal, "task"), journal, lambda: False)
    (composition,) = module.compositions.values()
    end = engine.run(composition_to_graph(composition, module.id).body)
    started = [note["skill"].partition(".")[2] for kind, note in runtime.notes if kind == "step-started"]
    return end is None, started


def test_time_outs_end_the_same_leaves() -> None:
    SEEN.clear()
    with TemporaryDirectory() as folder:
        yard = Yard(Path(folder))

        @examples(25, report_multiple_bugs=False)
        @given(timed_trees())
        def same(drawn: tuple[str, Ends]) -> None:
            body, ends = drawn
            module = imported(yard, file_of(body))
            (composition,) = module.compositions.values()
            exported = export_tree(module, composition).replace('"tree"', '"Tree"')
            expected = own_run(module, yard.site, ends)
            assert reference_run(file_of(body), ends) == expected
            assert own_run(imported(yard, exported), yard.site, ends) == expected
            SEEN["succeeds" if expected[0] else "fails"] += 1

        same()
    assert min(SEEN[kind] for kind in ("succeeds", "fails", "late")) > 2, SEEN
