"""Plans for one task: asked of the planner, verified before their first step, recorded.

When a plan is late (`planner_client.py`), the rest of the previous plan is followed if a check shows that it
leads to the goal from the current state. Otherwise the robot stands still and the plan counts as failed.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from aeros.agent.errands import barred_steps
from aeros.agent.execution.journal import Journal
from aeros.agent.execution.part_stops import PlanFailure
from aeros.agent.execution.step_attempt import StepRunner
from aeros.agent.planning.planner_client import PlannerClient
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import TaskGraph, verify_plan
from aeros.agent.planning.time_limited import MOST_REASON, PlannerProcessError, PlanningTimeoutError
from aeros.agent.world.world import WorldModel
from aeros.descriptions import describe_exception
from aeros.runtime.ports import Runtime


class PlanSource:
    """Source of verified plans for one task.

    `last_problems` are the reasons why the last plan was rejected; empty if it was accepted. A second
    rejection in a row for the same reasons is final.
    """

    def __init__(
        self,
        runtime: Runtime,
        proposals: PlannerClient,
        attempts: StepRunner,
        journal: Journal,
        routed: RoutedTask,
        barred_skills: frozenset[str],
        proposed_plan: TaskGraph | None = None,
    ) -> None:
        self._runtime = runtime
        self._proposals = proposals
        self._attempts = attempts
        self._journal = journal
        self._routed = routed
        self._barred_skills = barred_skills
        self._proposed_plan = proposed_plan
        self._followed: TaskGraph | None = None
        self.last_problems: list[str] = []

    def new_plan(self, until: float) -> TaskGraph | PlanFailure:
        """Ask the planner for a plan and verify it.

        The first time, the plan that came with the instruction is used if its end leads to the goal.

        Args:
            until: plant time (s) at which the run ends.

        Returns:
            The plan, or the rest of the previous one if the new plan is late; else why there is none.
        """
        try:
            graph = self._usable_proposal(until) or self._proposals.plan(
                self._routed, self._attempts.planning_world(), until
            )
        except PlanningTimeoutError as late:
            return self._fall_back_to_previous_plan(str(late), until)
        except PlannerProcessError as failure:
            return self._reject_plan([f"the planner failed: {failure}"])
        try:
            problems = self._plan_problems(graph)
        except Exception as error:
            # An object that an untrusted planner returned may raise anything when it is read.
            reason = describe_exception(error, MOST_REASON, one_line=True)
            return self._reject_plan([f"the planner failed: {reason}"])
        if problems:
            return self._reject_plan(problems)
        graph = self._with_provider_choice(graph, self._attempts.observe(), until)
        self.last_problems, self._followed = [], graph
        text, details = _plan_event(graph)
        self._journal.record(
            "plan-accepted", text, planner=self._proposals.name, task=str(self._routed), **details
        )
        return graph

    def kept_plan(self, plan: TaskGraph) -> TaskGraph | PlanFailure:
        """Verify the plan of a resumed run again.

        Args:
            plan: plan of the checkpoint.

        Returns:
            The plan, or why it is rejected.
        """
        problems = self._plan_problems(plan)
        if problems:
            return self._reject_plan(problems)
        self._followed, self._proposed_plan = plan, None
        return plan

    def _usable_proposal(self, until: float) -> TaskGraph | None:
        """Return the end of the proposed plan that leads to the goal from the measured world, once."""
        proposed, self._proposed_plan = self._proposed_plan, None
        if proposed is None or verify_plan(proposed, self._runtime.active_modules(), self._runtime.site):
            return None
        world = self._attempts.planning_world()
        rest = self._proposals.remaining_plan(proposed, self._routed, world, until)
        if rest is None or self._plan_problems(rest):
            return None
        return replace(rest, remark="it came with the meaning of the instruction")

    def _with_provider_choice(self, graph: TaskGraph, world: WorldModel, until: float) -> TaskGraph:
        """Let the agent choose among the providers of a capability where the plan names one of them."""
        freer = self._proposals.with_provider_choice(graph, self._routed, world, self._barred_skills, until)
        if freer is graph:
            return graph
        self._attempts.observe()  # the check may take time
        return graph if self._plan_problems(freer) else freer

    def _fall_back_to_previous_plan(self, late: str, until: float) -> TaskGraph | PlanFailure:
        """Return the rest of the previous plan if it still leads to the goal, else a failure."""
        reason, world = f"the plan is late: {late}", self._attempts.observe()
        rest = None
        is_over = self._runtime.is_stopped or self._runtime.now() >= until
        if self._followed is not None and not is_over:
            rest = self._proposals.remaining_plan(self._followed, self._routed, world, until)
            is_as_then = self._attempts.observe().predicates == world.predicates
            if rest is not None and (not is_as_then or self._plan_problems(rest)):
                rest = None
        steps = [] if rest is None else [str(part) for part in rest.parts]
        does = f"goes on with {' → '.join(steps)}" if steps else "stands still"
        self._journal.record(
            "planning-timeout", f"{reason}; {does}", planner=self._proposals.name, reason=reason, steps=steps
        )
        return PlanFailure(f"{reason}; {does}", is_final=self._runtime.is_stopped) if rest is None else rest

    def _plan_problems(self, graph: TaskGraph) -> list[str]:
        """List the reasons not to start a plan; an untrusted planner's object may raise anything."""
        modules = self._runtime.active_modules()
        problems = verify_plan(graph, modules, self._runtime.site)
        return problems or barred_steps(graph, self._barred_skills, modules)

    def _reject_plan(self, problems: list[str]) -> PlanFailure:
        self._attempts.observe()
        again, self.last_problems = problems == self.last_problems, problems
        reason = "the plan is rejected: " + "; ".join(problems)
        self._journal.record("plan-rejected", reason, planner=self._proposals.name, problems=problems)
        return PlanFailure(reason, is_final=again)


def _plan_event(graph: TaskGraph) -> tuple[str, dict[str, Any]]:
    """Return text and details of the event for an accepted plan; an only module is not named in the text."""
    steps = [str(part) for part in graph.parts]
    text = "plan: " + " → ".join(steps)
    modules = {step.module for step in graph.steps}
    if len(modules) == 1:
        text = text.replace(f"{modules.pop()}.", "")
    if graph.remark:
        return f"{text} ({graph.remark})", {"steps": steps, "remark": graph.remark}
    return text, {"steps": steps}
