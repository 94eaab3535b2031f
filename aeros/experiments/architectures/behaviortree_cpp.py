"""The expert's tree on BehaviorTree.CPP itself, by its Python binding.  Sole importer of behaviortreepy.

The tree is that of `expert_tree.py` in the nodes of BehaviorTree.CPP 4: `ReactiveFallback`, `Fallback`,
`RetryUntilSuccessful`, `Inverter`, and stateful actions (https://www.behaviortree.dev/docs/nodes-library/).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any
from xml.sax.saxutils import quoteattr

import behaviortreepy as bt

from aeros.agent.planning.base import step_of_rule
from aeros.agent.planning.task_graph import PlanStep
from aeros.experiments.architecture import ArchitectureReport, TrialContext
from aeros.experiments.architectures.ticked_skill import TickedSkill, TreeCounters, is_measured_true


class BehaviorTreeCpp:
    """Tree of the task's planning rules, which BehaviorTree.CPP ticks.

    Args:
        max_tries: most attempts of a rule before the tree starts again.
        max_starts: most starts of the whole tree.
    """

    def __init__(self, max_tries: int = 3, max_starts: int = 11) -> None:
        self._max_tries, self._max_starts = max_tries, max_starts

    def pursue(self, context: TrialContext) -> ArchitectureReport:
        """Implement `Architecture.pursue`."""
        nodes = _Nodes(context)
        tree = nodes.factory.create_tree_from_text(self._xml(context, nodes))
        found = bt.NodeStatus.RUNNING
        while found == bt.NodeStatus.RUNNING:
            found = tree.tick_exactly_once()
            if nodes.error is not None:
                raise nodes.error
        return nodes.counters.report(is_success=found == bt.NodeStatus.SUCCESS)

    def _xml(self, context: TrialContext, nodes: _Nodes) -> str:
        retried = f'<RetryUntilSuccessful num_attempts="{self._max_tries}">'
        parts = []
        for rule in context.task.task.rules:
            step = step_of_rule(context.task.module, rule)
            attempt = nodes.helped(nodes.action(step), step.between_tries)
            tried = nodes.helped(f"{retried}{attempt}</RetryUntilSuccessful>", step.on_failure)
            condition = nodes.condition(partial(is_measured_true, context, rule.satisfied_condition))
            parts.append(f"<ReactiveFallback>{condition}{tried}</ReactiveFallback>")
        return (
            '<root BTCPP_format="4" main_tree_to_execute="Task"><BehaviorTree ID="Task">'
            f'<RetryUntilSuccessful num_attempts="{self._max_starts}">'
            f"<Sequence>{nodes.start()}{''.join(parts)}</Sequence></RetryUntilSuccessful></BehaviorTree></root>"
        )


class _Nodes:
    """Leaves of a tree; an error in one ends all, and is kept: it must not cross the library's own code."""

    def __init__(self, context: TrialContext) -> None:
        self.factory = bt.BehaviorTreeFactory()
        self.counters = TreeCounters()
        self.error: BaseException | None = None
        self._context = context
        self._count = 0

    def start(self) -> str:
        """Make the leaf that counts starts of the tree."""

        def count() -> bool:
            self.counters.starts += 1
            return True

        return self.condition(count)

    def condition(self, holds: Callable[[], bool]) -> str:
        """Make a condition node."""
        name = self._name("condition")
        self.factory.register_simple_condition(name, lambda _: self._status(holds))
        return f"<Condition ID={quoteattr(name)}/>"

    def action(self, step: PlanStep, *, is_recovery: bool = False) -> str:
        """Make the leaf of a skill."""
        name = self._name(step.skill)
        skill = TickedSkill(self._context, step, self.counters, is_recovery=is_recovery)

        def tick(_: Any) -> Any:
            return self._status(skill.tick)

        self.factory.register_simple_stateful_action(name, tick, tick, lambda _: self._status(skill.halt))
        return f"<Action ID={quoteattr(name)}/>"

    def helped(self, tried: str, helper: PlanStep | None) -> str:
        """Make what fails only after another skill has run, if there is one that helps."""
        if helper is None:
            return tried
        return f"<Fallback>{tried}<Inverter>{self.action(helper, is_recovery=True)}</Inverter></Fallback>"

    def _name(self, of: str) -> str:
        self._count += 1
        return f"{of}_{self._count}"

    def _status(self, do: Callable[[], bool | None]) -> Any:
        """Do something and return its end as a status of BehaviorTree.CPP."""
        try:
            found = do() if self.error is None else False
        except BaseException as error:
            self.error, found = error, False
        if found is None:
            return bt.NodeStatus.RUNNING
        return bt.NodeStatus.SUCCESS if found else bt.NodeStatus.FAILURE
