"""Judgement of a run by truth: each request's goal at the moment at which the request ended."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from aeros.agent.execution.journal import AgentEvent
from aeros.agent.execution.report import RunReport
from aeros.agent.instructions.meaning import Understanding
from aeros.sim.referee import GoalJudgement, join_judgements, judge_goal, truth_of
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.task_parameters import arguments_in_force


@dataclass
class RunReferee:
    """Keeps what was true when each request of an instruction ended: a later one may undo it.

    Attributes:
        meaning: the requests.
        modules: all modules.
        plant: the plant, once it is open; None before.
    """

    meaning: Understanding
    modules: Collection[Ecm]
    plant: object | None = None
    _number: int | None = None
    _truths: dict[int, Mapping[str, int]] = field(default_factory=dict)
    _skipped: set[int] = field(default_factory=set)

    def observe(self, event: AgentEvent) -> None:
        """Take note of an event of the agent.

        Args:
            event: the event, in the order of time.
        """
        if event.kind == "task-selected":
            self._number = int(event.details["number"]) - 1
        elif self._number is not None and event.kind == "errand-skipped":
            self._skipped.add(self._number)
        elif self._number is not None and event.kind == "run-ended":
            self._truths[self._number] = truth_of(self.plant)

    def judge(self, report: RunReport) -> GoalJudgement | None:
        """Judge the whole run at its end.

        A request whose end another session saw, before a crash, is judged by what is true now; if it had a
        condition, it is not refereed, as it may have been skipped.

        Args:
            report: the agent's report.

        Returns:
            Belief and truth; None if the plant knows no truth, or all requests were skipped.
        """
        now = truth_of(self.plant)
        judgements = []
        for number, errand in enumerate(self.meaning.errands):
            if number in self._skipped or self._is_other_branch(number):
                continue
            is_known = number in self._truths or errand.condition is None
            truth = self._truths.get(number, now) if is_known else {}
            routed = errand.routed
            arguments = arguments_in_force(self.modules, routed.variables)
            judgements.append(judge_goal(routed.task.goal, report.reached, truth, routed.module, arguments))
        return join_judgements(judgements) if now and judgements else None

    def _is_other_branch(self, number: int) -> bool:
        """Return True for a request after `otherwise` if the one before was begun."""
        was_pursued = number - 1 in self._truths and number - 1 not in self._skipped
        return self.meaning.errands[number].is_otherwise and was_pursued
