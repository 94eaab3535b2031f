"""Imported behaviour trees run their leaves in the order of BehaviorTree.CPP, whatever the outcomes are.

BehaviorTree.CPP (by `behaviortreepy`) is the reference.  Trees of supported nodes are drawn; each is
imported, written as a manifest, elaborated, and run by the agent's executor, with the same outcomes of each
action.  What is exported of it is imported again, and runs the same.
"""

from __future__ import annotations

from collections import Counter
from itertools import count
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
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
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

    def __init__(self, draw: st.DrawFn) -> None:
        self.draw = draw
        self.numbers = count()

    def leaf(self) -> str:
        forms = [*["action"] * 9, "condition", "not", "AlwaysSuccess", "AlwaysFailure"]
        form = self.draw(st.sampled_from(forms))
        condition = f'<Condition ID="{self.draw(st.sampled_from(CONDITIONS))}"/>'
        if form == "condition":
            return condition
        if form == "not":
            return f"<Inverter>{condition}</Inverter>"
        return f"<{form}/>" if form != "action" else self.action()

    def action(self) -> str:
        number = next(self.numbers)
        if number >= MOST_ACTIONS:
            return "<AlwaysSuccess/>"
        return f'<Action ID="a{number}"/>'

    def tree(self, depth: int) -> str:
        if not depth:
            return self.leaf()
        tags = ["Sequence", "Sequence", "Fallback", "Fallback", "AsyncSequence", "Parallel", "IfThenElse"]
        tags += ["RetryUntilSuccessful", "ForceSuccess", "ForceFailure", "Repeat", "SubTree", "leaf"]
        tag = self.draw(st.sampled_from(tags))
        if tag == "leaf":
            return self.leaf()
        if tag == "SubTree":
            return self.tree(depth - 1)
        if tag == "Parallel":
            branches = "".join(f"<Sequence>{self.action()}{self.leaf()}</Sequence>" for _ in range(2))
            return f'<Parallel success_count="-1" failure_count="1">{branches}</Parallel>'
        if tag == "IfThenElse":
            other = self.draw(st.sampled_from(["", self.tree(depth - 1)]))
            condition = f'<Condition ID="{self.draw(st.sampled_from(CONDITIONS))}"/>'
            return f"<IfThenElse>{condition}{self.tree(depth - 1)}{other}</IfThenElse>"
        if tag == "Repeat":
            return f'<Repeat num_cycles="{self.draw(st.integers(1, 2))}">{self.tree(depth - 1)}</Repeat>'
        if tag == "RetryUntilSuccessful":
            tries = self.draw(st.integers(1, 3))
            return f'<{tag} num_attempts="{tries}">{self.tree(depth - 1)}</{tag}>'
        if tag in ("ForceSuccess", "ForceFailure"):
            return f"<{tag}>{self.tree(depth - 1)}</{tag}>"
        inner = "".join(self.tree(depth - 1) for _ in range(self.draw(st.sampled_from([2, 3, 1]))))
        return f"<{tag}>{inner}</{tag}>"


@st.composite
def trees(draw: st.DrawFn) -> str:
    drawer = Trees(draw)
    body = drawer.tree(3)
    return body if "<Action" in body else f"<Sequence>{body}{drawer.action()}</Sequence>"


def file_of(body: str) -> str:
    return f'<root BTCPP_format="4"><BehaviorTree ID="Tree">{body}</BehaviorTree></root>'


class Outcomes:
    """Outcomes of each action in the order of its runs, two of three a success."""

    def __init__(self, seed: int) -> None:
        self._drawn = {
            f"a{number}": Random(f"{seed} {number}")  # noqa: S311 - outcomes of a test
            for number in range(MOST_ACTIONS)
        }

    def next(self, action: str) -> bool:
        return self._drawn[action].random() < 0.65


def reference_run(xml: str, seed: int, truths: dict[str, bool]) -> tuple[bool, list[str]]:
    """Run a tree by BehaviorTree.CPP, each action for one tick; return its success and the starts."""
    outcomes, started = Outcomes(seed), list[str]()
    factory = bt.BehaviorTreeFactory()

    def status(is_success: bool) -> Any:
        return bt.NodeStatus.SUCCESS if is_success else bt.NodeStatus.FAILURE

    def add(name: str) -> None:
        def start(_: Any) -> Any:
            started.append(name)
            return bt.NodeStatus.RUNNING

        factory.register_simple_stateful_action(name, start, lambda _: status(outcomes.next(name)))

    for number in range(MOST_ACTIONS):
        add(f"a{number}")
    for name, truth in truths.items():
        factory.register_simple_condition(name, lambda _, truth=truth: status(truth))
    tree = factory.create_tree_from_text(xml)
    while True:
        found = tree.tick_exactly_once()
        if found != bt.NodeStatus.RUNNING:
            return found == bt.NodeStatus.SUCCESS, started


def own_run(module: Ecm, site: Site, seed: int, truths: dict[str, bool]) -> tuple[bool, list[str]]:
    """Run the imported composition by the agent's executor; return its success and the starts."""
    outcomes = Outcomes(seed)
    runtime = FakeRuntime(
        {module.id: module},
        chance=lambda skill, _: "done" if outcomes.next(skill) else "failed",
        at=site,
    )
    runtime.state = {**dict.fromkeys((f"ended_{number}" for number in range(MOST_ACTIONS)), False), **truths}
    runtime.state |= {"stop_pressed": False}
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


def test_leaves_run_in_the_order_of_the_reference() -> None:
    SEEN.clear()
    with TemporaryDirectory() as folder:
        yard = Yard(Path(folder))

        @examples(150, report_multiple_bugs=False)
        @given(trees(), st.lists(st.integers(0, 10**6), min_size=3, max_size=3), st.data())
        def same(body: str, streams: list[int], data: st.DataObject) -> None:
            module = imported(yard, file_of(body))
            (composition,) = module.compositions.values()
            exported = export_tree(module, composition).replace('"tree"', '"Tree"')
            again = imported(yard, exported)
            for seed in streams:
                truths = {name: data.draw(st.booleans()) for name in CONDITIONS}
                expected = reference_run(file_of(body), seed, truths)
                assert own_run(module, yard.site, seed, truths) == expected
                assert own_run(again, yard.site, seed, truths) == expected
                if "StateCondition" not in exported.partition("<TreeNodesModel>")[0]:
                    assert reference_run(exported, seed, truths) == expected
                    SEEN["exported"] += 1
                SEEN["succeeds" if expected[0] else "fails"] += 1
                SEEN["several"] += len(expected[1]) > 2

        same()
    assert min(SEEN[kind] for kind in ("succeeds", "fails", "several", "exported")) > 20, SEEN


def test_an_import_in_another_order_is_noticed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    yard = Yard(tmp_path)
    body = file_of(
        '<Fallback><Sequence><Action ID="a0"/><Action ID="a1"/></Sequence><Action ID="a2"/></Fallback>'
    )
    truths = dict.fromkeys(CONDITIONS, False)
    expected = [reference_run(body, seed, truths) for seed in range(8)]
    assert [own_run(imported(yard, body), yard.site, seed, truths) for seed in range(8)] == expected
    monkeypatch.setattr(tree_import, "SEQUENCES", ("Sequence", "Fallback"))
    assert [own_run(imported(yard, body), yard.site, seed, truths) for seed in range(8)] != expected
