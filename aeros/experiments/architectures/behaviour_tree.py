"""A behaviour tree on py_trees: a static tree, ticked, with bounded retries.  Sole importer of py_trees.

The tree is the one that its user would write of the task's planning rules:

    → task
        ? the rule's `satisfied_condition` is measured
          ↻ Retry, so many failures at most
              the rule's skill
        ? …                             the next rule

The sequence remembers what has succeeded; a selector looks at its condition at each tick.  With `recovery`
a try is a sequence of its own: where the skill may not start, the skill that helps (`on_failure`) is run
first; the paper's table of baseline faithfulness (`tab:faithfulness`) has none.
Not modelled: a leaf that is under way over several ticks.  Nothing here runs beside anything, so nothing
would come of it.
"""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector, Sequence
from py_trees.decorators import Retry

from aeros.agent.planning.task_graph import PlanStep
from aeros.experiments.architecture import ArchitectureReport, TrialContext
from aeros.spec.expr import terms as t
from aeros.spec.model.model import PlanningRule


class BehaviourTree:
    """The tree of the task's rules, ticked until it has succeeded or failed.

    tries: of each skill, at most; what BehaviorTree.CPP and py_trees count as failures.
    """

    def __init__(self, max_tries: int = 3, *, recovery: bool = False) -> None:
        self._tries = max_tries
        self._recovers = recovery

    def pursue(self, means: TrialContext) -> ArchitectureReport:
        """See `Architecture`."""
        counted = _Counters()
        root = Sequence("task", memory=True)
        for number, rule in enumerate(means.task.task.rules):
            root.add_child(self._subtree(means, counted, f"{number} {rule.skill}", rule))
        while True:
            root.tick_once()
            if root.status is not Status.RUNNING:
                break
        return ArchitectureReport(counted.retries, counted.recoveries, 0, counted.reason)

    def _subtree(self, means: TrialContext, counted: _Counters, name: str, rule: PlanningRule) -> Behaviour:
        step = PlanStep(means.task.module, rule.skill, rule.inputs)
        attempt: Behaviour = _SkillNode(name, means, step, counted)
        if self._recovers and rule.on_failure is not None:
            attempt = Sequence(f"{name}, helped", memory=True)
            attempt.add_children(
                [
                    _RecoveryNode(
                        f"{name}, {rule.on_failure}", means, PlanStep(step.module, rule.on_failure), counted
                    ),
                    _SkillNode(name, means, step, counted),
                ]
            )
        chosen = Selector(f"{name} or not needed", memory=False)
        chosen.add_children(
            [
                _ConditionNode(name, means, rule.satisfied_condition),
                Retry(f"{name}, retried", attempt, self._tries),
            ]
        )
        return chosen


class _Counters:
    """What was done besides first tries, and what failed last."""

    def __init__(self) -> None:
        self.retries = 0
        self.recoveries = 0
        self.reason = ""


class _ConditionNode(Behaviour):
    """A condition: succeeds where `term` is measured as true."""

    def __init__(self, name: str, means: TrialContext, term: t.Term) -> None:
        super().__init__(f"{name}: needless?")
        self._means, self._term = means, term

    def update(self) -> Status:
        return Status.SUCCESS if self._means.world().evaluate(self._term) is True else Status.FAILURE


class _SkillNode(Behaviour):
    """An action: runs a skill once, and succeeds iff that is the outcome that is measured."""

    def __init__(self, name: str, means: TrialContext, step: PlanStep, counted: _Counters) -> None:
        super().__init__(name)
        self._means, self._step, self._counted = means, step, counted
        self._tried = False

    def update(self) -> Status:
        self._counted.retries += self._tried
        self._tried = True
        judged = self._means.run(self._step)
        self._counted.reason = f"{self._step.skill}: {judged.reason}" if judged.failed else ""
        return Status.FAILURE if judged.failed else Status.SUCCESS


class _RecoveryNode(Behaviour):
    """Runs a skill that helps, but for the first time: there nothing has failed yet.  Always succeeds."""

    def __init__(self, name: str, means: TrialContext, step: PlanStep, counted: _Counters) -> None:
        super().__init__(name)
        self._means, self._step, self._counted = means, step, counted
        self._is_first = True

    def update(self) -> Status:
        if not self._is_first:
            self._counted.recoveries += 1
            self._means.run(self._step)
        self._is_first = False
        return Status.SUCCESS
