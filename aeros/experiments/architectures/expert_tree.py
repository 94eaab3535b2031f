"""Behaviour tree as an expert of py_trees writes it: reactive guards, running leaves, recovery, new starts.

    ↻ Retry, as often as plans are made
        → task, with memory
            ? a rule, without memory: its condition is evaluated at each tick, also while the skill runs
                its `satisfied_condition` is measured
                ? all attempts, with memory
                    ↻ Retry
                        ? attempt, with memory
                            the rule's skill
                            ¬ its `between_tries`: another attempt follows its success
                    ¬ its `on_failure`: the tree starts again after its success
            ? …                         the next rule

Where all attempts of a rule have failed, the tree starts again at its first rule, as a planner would make
another plan: what holds already is skipped.

Sources: py_trees 2.6 (https://py-trees.readthedocs.io/en/release-2.6.x/: a selector without memory
interrupts its lower children; decorators `Retry` and `Inverter`); Colledanchise and Ögren, Behavior Trees
in Robotics and AI, 2018, sections 3.1 (explicit success conditions) and 3.5 (backchaining).
"""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector, Sequence
from py_trees.decorators import Inverter, Retry

from aeros.agent.planning.base import step_of_rule
from aeros.agent.planning.task_graph import PlanStep
from aeros.experiments.architecture import ArchitectureReport, TrialContext
from aeros.experiments.architectures.behaviour_tree import ConditionNode
from aeros.experiments.architectures.ticked_skill import TickedSkill, TreeCounters
from aeros.spec.model.ecm import PlanningRule


class ExpertTree:
    """Tree of the task's planning rules with guards, running leaves, recovery and new starts.

    Args:
        max_tries: most attempts of a rule before the tree starts again.
        max_starts: most starts of the whole tree.
    """

    def __init__(self, max_tries: int = 3, max_starts: int = 11) -> None:
        self._max_tries, self._max_starts = max_tries, max_starts

    def pursue(self, context: TrialContext) -> ArchitectureReport:
        """Implement `Architecture.pursue`."""
        counters = TreeCounters()
        task = _CountedSequence(counters)
        for number, rule in enumerate(context.task.task.rules):
            task.add_child(self._subtree(context, counters, f"{number} {rule.skill}", rule))
        root = Retry("task, started again", task, self._max_starts)
        while True:
            root.tick_once()
            if root.status is not Status.RUNNING:
                break
        return counters.report(is_success=root.status is Status.SUCCESS)

    def _subtree(
        self, context: TrialContext, counters: TreeCounters, name: str, rule: PlanningRule
    ) -> Behaviour:
        step = step_of_rule(context.task.module, rule)
        attempt: Behaviour = _Leaf(name, TickedSkill(context, step, counters))
        attempt = _helped(f"{name}, helped", attempt, context, step.between_tries, counters)
        tried: Behaviour = Retry(f"{name}, retried", attempt, self._max_tries)
        tried = _helped(f"{name}, given up", tried, context, step.on_failure, counters)
        return Selector(
            f"{name} or not needed",
            memory=False,
            children=[
                ConditionNode(name, context, rule.satisfied_condition),
                tried,
            ],
        )


def _helped(
    name: str, tried: Behaviour, context: TrialContext, helper: PlanStep | None, counters: TreeCounters
) -> Behaviour:
    """Return what fails only after another skill has run, if there is one that helps."""
    if helper is None:
        return tried
    skill = TickedSkill(context, helper, counters, is_recovery=True)
    recovery = Inverter(f"{name}, then again", _Leaf(f"{name}, {helper.skill}", skill))
    return Selector(name, memory=True, children=[tried, recovery])


class _CountedSequence(Sequence):
    """All rules in their order; it counts its starts."""

    def __init__(self, counters: TreeCounters) -> None:
        super().__init__("task", memory=True)
        self._counters = counters

    def initialise(self) -> None:
        self._counters.starts += 1


class _Leaf(Behaviour):
    """Leaf that runs a skill, and halts it when a guard interrupts it."""

    def __init__(self, name: str, skill: TickedSkill) -> None:
        super().__init__(name)
        self._skill = skill

    def update(self) -> Status:
        found = self._skill.tick()
        if found is None:
            return Status.RUNNING
        return Status.SUCCESS if found else Status.FAILURE

    def terminate(self, new_status: Status) -> None:
        if new_status is Status.INVALID:
            self._skill.halt()
