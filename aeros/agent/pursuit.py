"""The closed loop of one task: plan, run, measure, and plan again until the goal is measured.

1.  Everything is judged on the measured world.  It is measured at the start, after every plan
    (planning may take long) and after every submission.  The goal is reached as soon as one of these
    measures it as true, even amid a plan; unknown is not reached.
2.  A plan is verified before its first step.  Its steps run in order; a step whose `unless` is
    measured as true when its turn comes is left out, unknown leaves it in.
3.  A try of a step: the skill is active, its precondition is measured as true, it is submitted.  It
    succeeds iff the skill ran to its end and the outcome that is measured is declared and no failure.
4.  A failed try is repeated at most `retry` times, `on_failure` (with default inputs) running before
    each further try; whether that recovery does any good is left to the next try's precondition.
    Where the step's `unless` is by then measured, the step is done.  Never repeated: a try that did
    not start, was refused or denied, or ended in an undeclared outcome.  A recovery that was submitted
    and refused, denied, or ended in an undeclared outcome ends its step likewise.
5.  A plan fails with the first step that failed for good.  It is also over when it is rejected, or
    exhausted without the goal.  Then the agent plans again, which is what `replans` counts; after
    `site.limits.replans` of them it gives up.
6.  It gives up at once when the gate denies the same request a second time in this run, or when
    two plans in a row are rejected for the same reasons: it would only ask again.

So a run submits at most (replans + 1) · Σ over a plan's steps of (1 + 2 · retry) skills.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

from aeros.agent.attempt import Attempt, Attempts
from aeros.agent.graph import Step, TaskGraph, verify_plan
from aeros.agent.journal import Journal
from aeros.agent.planner import Planner
from aeros.agent.report import Role, RunReport
from aeros.agent.routing import Routed
from aeros.agent.values import plain
from aeros.runtime.ports import Runtime


@dataclass(frozen=True, slots=True)
class _End:
    """Why a plan, or a step, went no further; `final` where planning again is no use."""

    reason: str
    final: bool = False


class Pursuit:
    """One run after one goal."""

    def __init__(
        self, runtime: Runtime, planner: Planner, attempts: Attempts, journal: Journal, routed: Routed
    ) -> None:
        self._runtime = runtime
        self._planner = planner
        self._attempts = attempts
        self._journal = journal
        self._routed = routed
        self._replans = 0
        self._rejected: list[str] = []
        self._denied: set[str] = set()

    def run(self, instruction: str) -> RunReport:
        """Pursue the goal to the end; the report says which."""
        reason = self._pursue()
        task = self._routed.task
        return RunReport(
            instruction=instruction,
            module=self._routed.module,
            task=task.id,
            goal=task.goal_text,
            reached=reason is None,
            measured=self._attempts.world.measured(task.goal),
            steps=tuple(self._attempts.records),
            replans=self._replans,
            reason=reason,
        )

    def _pursue(self) -> str | None:
        """None once the goal is measured, else why it will not be."""
        cap = self._runtime.site.limits.replans
        while not self._goal_is_measured():
            end = self._follow_a_plan()
            if self._goal_is_measured():
                break
            if end.final:
                return end.reason
            if self._replans >= cap:
                return f"the goal is not measured after {cap} re-plans; the last plan ended: {end.reason}"
            self._replans += 1
            self._journal.tell(
                "re-plan", f"re-plan {self._replans}: {end.reason}", number=self._replans, reason=end.reason
            )
        return None

    def _follow_a_plan(self) -> _End:
        graph = self._verified_plan()
        if isinstance(graph, _End):
            return graph
        for step in graph.steps:
            if self._goal_is_measured():
                break
            if self._is_needless(step):
                self._journal.tell("step-left-out", f"{step} is not needed any more", step=str(step))
                continue
            failure = self._try(step)
            if failure is not None:
                return failure
        return _End("the plan is exhausted, and the goal is not measured")

    def _verified_plan(self) -> TaskGraph | _End:
        try:
            graph = self._planner.plan(self._routed, self._attempts.world, self._runtime.active_modules())
            problems = verify_plan(graph, self._runtime.active_modules(), self._runtime.site)
        except Exception as error:
            # An untrusted planner may raise anything, and so may what it returned when it is looked at.
            return self._reject([f"the planner failed: {type(error).__name__}: {error}"])
        if problems:
            return self._reject(problems)
        self._attempts.observe()
        self._rejected = []
        steps = [str(step) for step in graph.steps]
        self._journal.tell(
            "plan", " → ".join(steps), planner=self._planner.name, task=str(self._routed), steps=steps
        )
        return graph

    def _reject(self, problems: list[str]) -> _End:
        self._attempts.observe()
        again, self._rejected = problems == self._rejected, problems
        reason = "the plan is rejected: " + "; ".join(problems)
        self._journal.tell("plan-rejected", reason, planner=self._planner.name, problems=problems)
        return _End(reason, final=again)

    def _try(self, step: Step) -> _End | None:
        """None once the step is done, else how it failed for good."""
        attempt = self._invoke(Role.STEP, step)
        for _ in range(step.retry):
            if not attempt.repeatable or self._is_done(step):
                break
            end = self._recover(step)
            if end is not None:
                return end
            if self._is_done(step):
                return None
            attempt = self._invoke(Role.RETRY, step)
        if not attempt.failed or (attempt.repeatable and self._is_done(step)):
            return None
        return self._end_of(step, attempt)

    def _recover(self, step: Step) -> _End | None:
        """Run `on_failure`; how the step ends if what came of that forbids another try."""
        if step.on_failure is None:
            return None
        recovery = Step(step.module, step.on_failure)
        attempt = self._invoke(Role.RECOVERY, recovery)
        # Not started is no obstacle: nothing moved, and the next try checks its own precondition.
        if not attempt.failed or attempt.repeatable or attempt.record is None:
            return None
        return self._end_of(recovery, attempt)

    def _invoke(self, role: Role, step: Step) -> Attempt:
        return self._attempts.invoke(role, step.module, step.skill, step.inputs)

    def _end_of(self, step: Step, attempt: Attempt) -> _End:
        name = f"`{step.module}.{step.skill}`"
        if not attempt.denied:
            return _End(f"{name} failed: {attempt.reason}")
        inputs = {key: plain(value) for key, value in step.inputs.items()}
        request = json.dumps([step.module, step.skill, inputs], sort_keys=True)
        if request in self._denied:
            return _End(f"{name} was denied a second time: {attempt.reason}", final=True)
        self._denied.add(request)
        return _End(f"{name} was denied: {attempt.reason}")

    def _goal_is_measured(self) -> bool:
        return self._attempts.world.evaluate(self._routed.task.goal) is True

    def _is_done(self, step: Step) -> bool:
        return self._goal_is_measured() or self._is_needless(step)

    def _is_needless(self, step: Step) -> bool:
        return step.unless is not None and self._attempts.world.evaluate(step.unless) is True
