"""Behaviour tree on py_trees: a static tree, ticked, with bounded retries.

The tree is the one that a user would write from the task's planning rules:

    → task
        ? the rule's `satisfied_condition` is measured
          ↻ Retry, up to this many failures
              the rule's skill
        ? …                             the next rule

The sequence remembers what has succeeded; a selector checks its condition at each tick.  With `recovery`
the skill that helps runs before each further try.  It is the rule's `between_tries`, or else its
`on_failure`: a tree makes no next plan, for which a recovery after the last try would help.  The paper's
table of baseline faithfulness (`tab:faithfulness`) has no recovery.
A leaf runs within one tick. What an expert would add, and what it gains, shows `expert_tree.py`.
"""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector, Sequence
from py_trees.decorators import Retry

from aeros.agent.planning.base import step_of_rule
from aeros.agent.planning.task_graph import PlanStep
from aeros.experiments.architecture import ArchitectureReport, TrialContext
from aeros.experiments.architectures.ticked_skill import is_measured_true
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import PlanningRule


class BehaviourTree:
    """Tree of the task's planning rules, ticked until it succeeds or fails.

    Args:
        max_tries: most tries of each skill; BehaviorTree.CPP and py_trees count them as failures.
        recovery: True if the skill that helps after a failure runs before a further try.
    """

    def __init__(self, max_tries: int = 3, *, recovery: bool = False) -> None:
        self._max_tries = max_tries
        self._recovery = recovery

    def pursue(self, context: TrialContext) -> ArchitectureReport:
        """Implement `Architecture.pursue`."""
        counters = _Counters()
        root = Sequence("task", memory=True)
        for number, rule in enumerate(context.task.task.rules):
            root.add_child(self._subtree(context, counters, f"{number} {rule.skill}", rule))
        while True:
            root.tick_once()
            if root.status is not Status.RUNNING:
                break
        return ArchitectureReport(counters.retries, counters.recoveries, 0, counters.reason)

    def _subtree(
        self, context: TrialContext, counters: _Counters, name: str, rule: PlanningRule
    ) -> Behaviour:
        step = step_of_rule(context.task.module, rule)
        helper = step.between_tries or step.on_failure
        attempt: Behaviour = _SkillNode(name, context, step, counters)
        if self._recovery and helper is not None:
            attempt = Sequence(f"{name}, helped", memory=True)
            attempt.add_children(
                [
                    _RecoveryNode(f"{name}, {helper.skill}", context, helper, counters),
                    _SkillNode(name, context, step, counters),
                ]
            )
        chosen = Selector(f"{name} or not needed", memory=False)
        chosen.add_children(
            [
                ConditionNode(name, context, rule.satisfied_condition),
                Retry(f"{name}, retried", attempt, self._max_tries),
            ]
        )
        return chosen


class _Counters:
    """Counters of what was done besides first tries, and the reason of the last failure."""

    def __init__(self) -> None:
        self.retries = 0
        self.recoveries = 0
        self.reason = ""


class ConditionNode(Behaviour):
    """Condition node: succeeds where a condition is measured as true.

    Args:
        name: name of the node that it guards.
        context: of the trial.
        term: the condition.
    """

    def __init__(self, name: str, context: TrialContext, term: t.Term) -> None:
        super().__init__(f"{name}: needless?")
        self._context, self._term = context, term

    def update(self) -> Status:
        """Implement `Behaviour.update`."""
        return Status.SUCCESS if is_measured_true(self._context, self._term) else Status.FAILURE


class _SkillNode(Behaviour):
    """Action node: runs a skill once, and succeeds if and only if a success outcome is measured."""

    def __init__(self, name: str, context: TrialContext, step: PlanStep, counters: _Counters) -> None:
        super().__init__(name)
        self._context, self._step, self._counters = context, step, counters
        self._tried = False

    def update(self) -> Status:
        self._counters.retries += self._tried
        self._tried = True
        assessment = self._context.run(self._step)
        self._counters.reason = f"{self._step.skill}: {assessment.reason}" if assessment.failed else ""
        return Status.FAILURE if assessment.failed else Status.SUCCESS


class _RecoveryNode(Behaviour):
    """Node that runs the recovery skill, but not before the first try.  Always succeeds."""

    def __init__(self, name: str, context: TrialContext, step: PlanStep, counters: _Counters) -> None:
        super().__init__(name)
        self._context, self._step, self._counters = context, step, counters
        self._is_first = True

    def update(self) -> Status:
        if not self._is_first:
            self._counters.recoveries += 1
            self._context.run(self._step)
        self._is_first = False
        return Status.SUCCESS
