"""Steps by a capability, against every run of the agent's own loop and every way to choose."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from random import Random
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.execution.journal import Journal
from aeros.agent.execution.report import RunReport
from aeros.agent.execution.step_attempt import StepRunner
from aeros.agent.memory.evidence import SkillId
from aeros.agent.memory.posterior import RecentRecord
from aeros.agent.planning.base import RulePlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.task_loop import TaskLoop
from aeros.spec.closed_loop.markov_chain import Prediction, predict
from aeros.spec.closed_loop.outcome_probabilities import outcome_probabilities
from aeros.spec.closed_loop.reachability import ReachableStates, explore_task
from aeros.spec.closed_loop.transition_system import LoopState, TransitionSystem
from tests.differential.planning.small_tasks import Case, cases, loops
from tests.differential.real_loop import Forgetful, Recording
from tests.hypothesis_profiles import examples
from tests.property.mix import Mix

SEEN = Mix()


@st.composite
def _capable(draw: st.DrawFn, of: st.SearchStrategy[Case], most_choices: int) -> Case:
    """A case whose rules run any of two or three skills that take the same inputs."""
    case = draw(of.filter(lambda case: len(case.ecm.skills) > 1))
    wanted = draw(st.lists(st.sampled_from(sorted(case.ecm.skills)), min_size=2, max_size=3, unique=True))
    changed = 0
    rules = []
    for rule in case.task.rules:
        alike = [one for one in wanted if case.ecm.skills[one].inputs == case.ecm.skills[rule.skill].inputs]
        able = alike == wanted and changed < most_choices
        changed += able
        rules.append(replace(rule, skill="capability") if able else rule)
    task = replace(case.task, rules=tuple(rules))
    ecm = replace(case.ecm, tasks={task.id: task}, capabilities={"capability": tuple(wanted)})
    return replace(case, ecm=ecm, task=task)


@dataclass
class Script:
    """Choices at each fork of a run, and the first one after them; `choices` counts each fork's ways."""

    given: list[int]
    choices: list[tuple[int, int]]
    probability: Fraction = Fraction(1)

    def fork(self, shares: list[Fraction]) -> int:
        at = len(self.choices)
        way = self.given[at] if at < len(self.given) else 0
        self.choices.append((way, len(shares)))
        self.probability *= shares[way]
        return way

    def next(self) -> list[int] | None:
        left = list(self.choices)
        while left and left[-1][0] + 1 == left[-1][1]:
            left.pop()
        return [way for way, _ in left[:-1]] + [left[-1][0] + 1] if left else None


class _Choosing(Forgetful):
    """A memory by which the providers are in an order, each order as likely as another."""

    def __init__(self, providers: tuple[str, ...], script: Script) -> None:
        self._orders = list(itertools.permutations(providers))
        self._script = script
        self.order: tuple[str, ...] = ()

    def recent_records(self, contexts: Mapping[SkillId, str]) -> Mapping[SkillId, RecentRecord]:
        return {one: _Drawn(self, one[1]) for one in contexts}

    def latest_episode(self) -> int:
        # Asked for once a choice, before anything is drawn.
        share = Fraction(1, len(self._orders))
        self.order = self._orders[self._script.fork([share] * len(self._orders))]
        return 0


class _Drawn(RecentRecord):
    """Draws by the place of its skill in the order that is due."""

    def __init__(self, memory: _Choosing, skill: str) -> None:
        super().__init__()
        object.__setattr__(self, "memory", memory)
        object.__setattr__(self, "skill", skill)

    memory: _Choosing
    skill: str

    def sample(self, random: Random) -> float:
        order = self.memory.order
        return order.index(self.skill) / 10 if self.skill in order else 0.5


def every_run(case: Case) -> list[tuple[Fraction, RunReport]]:
    """Every run of the agent's own loop, over outcomes and choices."""
    found: list[tuple[Fraction, RunReport]] = []
    given_: list[int] | None = []
    while given_ is not None:
        script = Script(given_, [])

        def chance(skill: str, _: list[str], script: Script = script) -> str:
            likely = [
                (one.id, p) for one, p in outcome_probabilities(case.ecm.skills[skill].outcomes.values()) if p
            ]
            return likely[script.fork([p for _, p in likely])][0]

        runtime = Recording(case.ecm, case.site, case.start, chance)
        memory = _Choosing(case.ecm.capabilities["capability"], script)
        journal = Journal(runtime, memory, None)
        routed = RoutedTask(case.ecm.id, case.task)
        attempts = StepRunner(runtime, memory, journal, str(routed))
        report = TaskLoop(runtime, RulePlanner(), attempts, journal, routed).run("compared")
        found.append((script.probability, report))
        given_ = script.next()
    return found


@examples(80)
@given(_capable(cases(most_rules=2, most_retries=1, most_replans=1), 1))
def test_the_prediction_is_the_mean_over_all_runs_and_choices(case: Case) -> None:
    runs = every_run(case)
    assert sum(share for share, _ in runs) == 1

    def mean(of: str) -> Fraction:
        return sum((share * int(getattr(run, of)) for share, run in runs), Fraction(0))

    system = TransitionSystem(case.ecm, case.task, case.site)
    found = predict(system, tuple(case.start[name] for name in system.names), case.site.limits.replans)
    invocations = sum((share * len(run.steps) for share, run in runs), Fraction(0))
    counts = (mean("retries"), mean("recoveries"), mean("replans"))
    assert found == Prediction(mean("reached"), invocations, *counts)


def resolved(explored: ReachableStates, choices: Mapping[LoopState, str]) -> set[LoopState]:
    """The nodes with a way to the goal where the agent always chooses so."""
    hopeful = {node for node in explored.graph if node.phase == "reached"}
    ways: dict[LoopState, list[LoopState]] = {
        node: [
            move.target
            for move in explored.system.transitions(node)
            if move.probability and move.choice == choices.get(node, move.choice)
        ]
        for node in explored.graph
    }
    while more := {node for node in ways if node not in hopeful and hopeful.intersection(ways[node])}:
        hopeful |= more
    return hopeful


def _choices(system: TransitionSystem, node: LoopState) -> list[str]:
    return sorted({move.choice for move in system.transitions(node)})


def test_a_way_to_the_goal_is_claimed_exactly_where_every_way_to_choose_has_one() -> None:
    _ways_are_judged()
    SEEN.assert_both("AE802")


@examples(80)
@given(_capable(st.one_of(loops(), cases(most_rules=3, most_retries=1, most_replans=0)), 3))
def _ways_are_judged(case: Case) -> None:
    start: dict[str, Any] = {name: case.start[name] for name in case.start}
    task = replace(case.task, initial=start)
    explored = explore_task(replace(case.ecm, tasks={task.id: task}), task, case.site)
    forks = {node: options for node in explored.graph if len(options := _choices(explored.system, node)) > 1}
    if len(forks) > 8:
        return
    stuck: set[LoopState] = set()
    for made in itertools.product(*forks.values()):
        hopeful = resolved(explored, dict(zip(forks, made, strict=True)))
        stuck |= {node for node in explored.graph if node.phase == "plan" and node not in hopeful}
    SEEN.compare("AE802", proved=not [*explored.nodes_that_can_miss_goal()], expected=not stuck)
    assert set(explored.nodes_that_can_miss_goal()) == stuck
