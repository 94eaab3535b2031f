"""Imported behaviour trees run their leaves in the order of BehaviorTree.CPP, whatever the outcomes are.

BehaviorTree.CPP (by `behaviortreepy`) is the reference.  Trees of supported nodes are drawn; each is
imported, written as a manifest, elaborated, and run by the agent's executor, with the same outcomes and
durations of each action, and conditions that change meanwhile.  What is exported of it is imported again, and
runs the same.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from math import inf
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

import behaviortreepy as bt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.execution.journal import Journal
from aeros.agent.execution.plan_executor import PlanExecutor
from aeros.agent.execution.step_attempt import StepRunner
from aeros.agent.planning.compositions import composition_to_graph
from aeros.agent.planning.task_graph import verify_plan
from aeros.apps.trees import tree_import
from aeros.apps.trees.composition_text import composition_text
from aeros.apps.trees.leaves import ImportSettings
from aeros.apps.trees.library import collect_trees
from aeros.apps.trees.tree_export import export_tree
from aeros.apps.trees.tree_import import import_tree
from aeros.apps.trees.tree_xml import parse_tree
from aeros.runtime.ports import EndedStep, StepHandle, StepRequest, StepResult, StepStatus
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from tests.differential.real_loop import Forgetful
from tests.hypothesis_profiles import examples
from tests.unit.agent.fake_runtime import FakeRuntime

CONDITIONS = ("c0", "c1", "c2")
MOST_ACTIONS = 8
SEEN = Counter[str]()
_CORPUS = Path(__file__).parents[2] / "corpus"


def _site_text() -> str:
    names = [*CONDITIONS, *(f"ended_{number}" for number in range(MOST_ACTIONS))]
    text = (_CORPUS / "site" / "table.yaml").read_text()
    variables = "".join(f"  {name}: {{type: bool, sensor: camera, max_age: 200 ms}}\n" for name in names)
    return text.replace("state:\n", f"state:\n{variables}", 1)


def _manifest(composition: str) -> str:
    skills = "".join(
        f"  a{number}:\n    description: one\n    entry: skills:tidy\n    outcomes:\n"
        f"      done: {{effects: {{ended_{number}: true}}}}\n"
        f"      failed: {{effects: {{ended_{number}: false}}, failure: true}}\n"
        "    envelope: {wait: duration <= 10 s}\n    risk: medium\n    timeout: 30 s\n"
        for number in range(MOST_ACTIONS)
    )
    return (
        "schema: aeros/ecm/2\nid: imported\nversion: 1.0.0\ndescription: A tree.\nlicense: Apache-2.0\n"
        f"skills:\n{skills}compositions:\n{composition}"
        "permissions: {sensors: [camera], actions: {wait: true}}\n"
        'dependencies: {aeros: ">=0.1"}\n'
    )


class Yard:
    """Site, and modules made of compositions."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "imported").mkdir()
        (folder / "imported" / "skills.py").write_bytes(
            (_CORPUS / "accepted" / "step_by_a_composition" / "skills.py").read_bytes()
        )
        (folder / "site.yaml").write_text(_site_text())
        sink = Diagnostics()
        site = load_site(folder / "site.yaml", sink)
        assert site is not None, list(sink)
        self.site: Site = site

    def module(self, composition: str) -> Ecm:
        (self.folder / "imported" / "ecm.yaml").write_text(_manifest(composition))
        sink = Diagnostics()
        loaded = load_ecm(self.folder / "imported", self.site, sink)
        assert loaded is not None, [one.headline for one in sink]
        assert not sink.has_errors, [one.headline for one in sink]
        return loaded.ecm


class Trees:
    """Drawer of trees; each action stands at one place."""

    def __init__(self, seed: int) -> None:
        self._random = Random(seed)  # noqa: S311 - trees of a test
        self.used = 0

    def pick(self, options: Sequence[Any]) -> Any:
        return self._random.choice(options)

    def leaf(self) -> str:
        forms = [*["action"] * 9, "condition", "not", "AlwaysSuccess", "AlwaysFailure"]
        form = self.pick(forms)
        condition = f'<Condition ID="{self.pick(CONDITIONS)}"/>'
        if form == "condition":
            return condition
        if form == "not":
            return f"<Inverter>{condition}</Inverter>"
        return f"<{form}/>" if form != "action" else self.action()

    def action(self) -> str:
        if self.used >= MOST_ACTIONS:
            return "<AlwaysSuccess/>"
        self.used += 1
        return f'<Action ID="a{self.used - 1}"/>'

    def guard(self) -> str:
        condition = self.pick(CONDITIONS)
        return str(self.pick([f"<{condition}/>", f"<Inverter><{condition}/></Inverter>"]))

    def reactive(self, tag: str, depth: int) -> str:
        guards = 1 if tag == "WhileDoElse" else self.pick([1, 1, 2, 0])
        before = "".join(self.guard() for _ in range(guards))
        after = "" if tag == "WhileDoElse" else self.pick(["", "", self.guard()])
        action = self.pick([*["action"] * 5, ""]) and self.action()
        # BehaviorTree.CPP reads no explicit leaf there.
        return f"<{tag}>{before}<Sequence>{self.tree(depth - 1)}{action}</Sequence>{after}</{tag}>"

    def tree(self, depth: int) -> str:
        if not depth:
            return self.leaf()
        tags = ["Sequence", "Sequence", "Fallback", "Fallback", "AsyncSequence", "Parallel", "IfThenElse"]
        tags += ["RetryUntilSuccessful", "ForceSuccess", "ForceFailure", "Repeat", "SubTree", "leaf"]
        tags += ["ReactiveSequence", "ReactiveSequence", "ReactiveFallback", "WhileDoElse"]
        tag = self.pick(tags)
        if tag == "leaf" or (tag == "Parallel" and self.used + 3 > MOST_ACTIONS):
            return self.leaf()
        if tag == "SubTree":
            return self.tree(depth - 1)
        if tag in ("ReactiveSequence", "ReactiveFallback", "WhileDoElse"):
            return self.reactive(tag, depth)
        if tag == "Parallel":
            idle = self.pick(["", f"<ForceSuccess><Inverter>{self.guard()}</Inverter></ForceSuccess>"])
            branches = "".join(f"<Sequence>{self.action()}{self.leaf()}</Sequence>" for _ in range(2))
            return f'<Parallel success_count="-1" failure_count="1">{idle}{branches}</Parallel>'
        if tag == "IfThenElse":
            other = self.pick(["", self.tree(depth - 1)])
            condition = f'<Condition ID="{self.pick(CONDITIONS)}"/>'
            return f"<IfThenElse>{condition}{self.tree(depth - 1)}{other}</IfThenElse>"
        if tag == "Repeat":
            return f'<Repeat num_cycles="{self.pick((1, 2))}">{self.tree(depth - 1)}</Repeat>'
        if tag == "RetryUntilSuccessful":
            tries = self.pick((1, 2, 3))
            return f'<{tag} num_attempts="{tries}">{self.tree(depth - 1)}</{tag}>'
        if tag in ("ForceSuccess", "ForceFailure"):
            return f"<{tag}>{self.tree(depth - 1)}</{tag}>"
        inner = "".join(self.tree(depth - 1) for _ in range(self.pick([2, 3, 1])))
        return f"<{tag}>{inner}</{tag}>"


def tree_of(seed: int) -> str:
    drawer = Trees(seed)
    body = drawer.tree(3)
    return body if "<Action" in body else f"<Sequence>{body}{drawer.action()}</Sequence>"


def reactive_tree_of(seed: int) -> str:
    drawer = Trees(seed)
    tag = drawer.pick(["ReactiveSequence", "ReactiveFallback", "WhileDoElse"])
    return f"<Fallback>{drawer.reactive(tag, 2)}{drawer.tree(1)}{drawer.action()}</Fallback>"


# Small trees are what Hypothesis draws most.
trees = st.integers(0, 10**9).map(tree_of)
reactive_trees = st.integers(0, 10**9).map(reactive_tree_of)


def file_of(body: str) -> str:
    leaves = "".join(f'<Condition ID="{name}"/>' for name in CONDITIONS)
    return (
        f'<root BTCPP_format="4"><BehaviorTree ID="Tree">{body}</BehaviorTree>'
        f"<TreeNodesModel>{leaves}</TreeNodesModel></root>"
    )


MOMENTS = 12
Truths = dict[str, list[bool]]
"""Of each condition its value at each moment; the last one lasts."""


class Outcomes:
    """Duration and outcome of each action in the order of its runs, two of three a success."""

    def __init__(self, seed: int) -> None:
        self._drawn = {
            f"a{number}": Random(f"{seed} {number}")  # noqa: S311 - outcomes of a test
            for number in range(MOST_ACTIONS)
        }

    def next(self, action: str) -> tuple[int, bool]:
        """Draw the number of moments that a run takes, and its success."""
        drawn = self._drawn[action]
        return drawn.choice([1, 1, 2, 3]), drawn.random() < 0.65


class World:
    """Conditions that change from moment to moment, and a moment that passes while an action runs."""

    def __init__(self, truths: Truths) -> None:
        self.truths = truths
        self.moment = 0

    def holds(self, name: str) -> bool:
        values = self.truths[name]
        return values[min(self.moment, len(values) - 1)]

    def values(self) -> dict[str, bool]:
        return {name: self.holds(name) for name in self.truths}


def reference_run(xml: str, seed: int, truths: Truths) -> tuple[bool, list[str]]:
    """Run a tree by BehaviorTree.CPP; return its success and the starts.

    A tick in which no action runs takes no time: nodes that leave one between two children would else see
    another moment.
    """
    outcomes, started, world = Outcomes(seed), list[str](), World(truths)
    left: dict[str, tuple[int, bool]] = {}
    factory = bt.BehaviorTreeFactory()

    def status(is_success: bool) -> Any:
        return bt.NodeStatus.SUCCESS if is_success else bt.NodeStatus.FAILURE

    def add(name: str) -> None:
        def start(_: Any) -> Any:
            started.append(name)
            left[name] = outcomes.next(name)
            return bt.NodeStatus.RUNNING

        def go_on(_: Any) -> Any:
            moments, is_success = left.pop(name)
            if moments > 1:
                left[name] = moments - 1, is_success
                return bt.NodeStatus.RUNNING
            return status(is_success)

        def halt(_: Any) -> None:
            left.pop(name, None)

        factory.register_simple_stateful_action(name, start, go_on, halt)

    for number in range(MOST_ACTIONS):
        add(f"a{number}")
    for name in truths:
        factory.register_simple_condition(name, lambda _, name=name: status(world.holds(name)))
    tree = factory.create_tree_from_text(xml)
    while True:
        world.moment += bool(left)
        found = tree.tick_exactly_once()
        if found != bt.NodeStatus.RUNNING:
            return found == bt.NodeStatus.SUCCESS, started


class Moments(FakeRuntime):
    """A runtime in which a moment is a second; of steps that end together, the tree's first is first."""

    def __init__(self, module: Ecm, site: Site, seed: int, truths: Truths) -> None:
        super().__init__({module.id: module}, at=site)
        self._outcomes, self._world = Outcomes(seed), World(truths)
        self._left: dict[StepHandle, tuple[int, bool]] = {}
        self._due: list[StepHandle] = []
        self.state = dict.fromkeys((f"ended_{number}" for number in range(MOST_ACTIONS)), False)
        self.state |= {"stop_pressed": False, **self._world.values()}

    def start(self, request: StepRequest) -> StepHandle | StepResult:
        handle = super().start(request)
        assert not isinstance(handle, StepResult)
        self._left[handle] = self._outcomes.next(request.skill)
        return handle

    def wait(self, until: float = inf) -> EndedStep | None:
        while True:
            for handle in self.cancelled:
                if self.under_way.pop(handle, None) is not None:
                    return EndedStep(handle, StepResult(StepStatus.CANCELLED, self.cancelled[handle]))
            while self._due:
                ended = self._ended(self._due.pop(0))
                if ended is not None:
                    return ended
            if not self.under_way or self.clock + 1 > until:
                self.clock = max(self.clock, until)
                return None
            self.clock += 1
            self._world.moment += 1
            self.state |= self._world.values()
            self._due = sorted(self.under_way, key=lambda one: (self.under_way[one].skill, one))

    def _ended(self, handle: StepHandle) -> EndedStep | None:
        request = self.under_way.get(handle)
        if request is None:
            return None
        for place, one in enumerate(request.held):
            if not is_true(one.term, self.state):
                del self.under_way[handle]
                SEEN["lost"] += 1
                return EndedStep(handle, StepResult(StepStatus.CANCELLED, "lost", lost_hold=place))
        moments, is_success = self._left[handle]
        self._left[handle] = moments - 1, is_success
        if moments > 1:
            return None
        del self.under_way[handle]
        self.state["ended_" + request.skill.removeprefix("a")] = is_success
        return EndedStep(handle, StepResult(StepStatus.FINISHED, ""))


def own_run(module: Ecm, site: Site, seed: int, truths: Truths) -> tuple[bool, list[str]]:
    """Run the imported composition by the agent's executor; return its success and the starts."""
    runtime = Moments(module, site, seed, truths)
    memory = Forgetful()
    journal = Journal(runtime, memory, None)
    engine = PlanExecutor(StepRunner(runtime, memory, journal, "task"), journal, lambda: False)
    (composition,) = module.compositions.values()
    graph = composition_to_graph(composition, module.id)
    assert verify_plan(graph, {module.id: module}, site) == []
    end = engine.run(graph.body)
    started = [note["skill"].partition(".")[2] for kind, note in runtime.notes if kind == "step-started"]
    return end is None, started


def imported(yard: Yard, xml: str) -> Ecm:
    library = collect_trees([parse_tree(xml.encode(), "tree.xml")])
    found = import_tree(library, "Tree", ImportSettings())
    assert found.part is not None, [(one.node, one.reason) for one in found.refused]
    return yard.module(composition_text("tree", "a tree", found.part))


def truths_of(seed: int) -> Truths:
    drawn = Random(f"{seed} truths")  # noqa: S311 - values of a test
    often = drawn.choice([0.2, 0.5, 0.8, 0.9])
    moments = drawn.choice([1, MOMENTS, MOMENTS])
    return {name: [drawn.random() < often for _ in range(moments)] for name in CONDITIONS}


def _compare(yard: Yard, body: str, streams: list[int]) -> None:
    module = imported(yard, file_of(body))
    (composition,) = module.compositions.values()
    exported = export_tree(module, composition).replace('"tree"', '"Tree"')
    again = imported(yard, exported)
    for seed in streams:
        truths = truths_of(seed)
        expected = reference_run(file_of(body), seed, truths)
        assert own_run(module, yard.site, seed, truths) == expected
        assert own_run(again, yard.site, seed, truths) == expected
        if "StateCondition" not in exported.partition("<TreeNodesModel>")[0]:
            assert reference_run(exported, seed, truths) == expected
            SEEN["exported"] += 1
        SEEN["succeeds" if expected[0] else "fails"] += 1
        SEEN["several"] += len(expected[1]) > 2


_STREAMS = st.lists(st.integers(0, 10**6), min_size=3, max_size=3)


def test_leaves_run_in_the_order_of_the_reference() -> None:
    SEEN.clear()
    with TemporaryDirectory() as folder:
        yard = Yard(Path(folder))

        @examples(90, report_multiple_bugs=False)
        @given(trees, _STREAMS)
        def same(body: str, streams: list[int]) -> None:
            _compare(yard, body, streams)

        same()
    assert min(SEEN[kind] for kind in ("succeeds", "fails", "several")) > 10, SEEN
    assert SEEN["exported"] > 3, SEEN


def test_leaves_are_stopped_where_those_of_the_reference_are() -> None:
    SEEN.clear()
    with TemporaryDirectory() as folder:
        yard = Yard(Path(folder))

        @examples(100, report_multiple_bugs=False)
        @given(reactive_trees, _STREAMS)
        def same(body: str, streams: list[int]) -> None:
            _compare(yard, body, streams)

        same()
    assert min(SEEN[kind] for kind in ("succeeds", "fails", "several", "lost")) > 5, SEEN


def test_an_import_in_another_order_is_noticed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    yard = Yard(tmp_path)
    body = file_of(
        '<Fallback><Sequence><Action ID="a0"/><Action ID="a1"/></Sequence><Action ID="a2"/></Fallback>'
    )
    truths = {name: [False] for name in CONDITIONS}
    expected = [reference_run(body, seed, truths) for seed in range(8)]
    assert [own_run(imported(yard, body), yard.site, seed, truths) for seed in range(8)] == expected
    monkeypatch.setattr(tree_import, "SEQUENCES", ("Sequence", "Fallback"))
    assert [own_run(imported(yard, body), yard.site, seed, truths) for seed in range(8)] != expected
