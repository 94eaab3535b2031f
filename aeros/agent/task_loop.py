"""Closed loop of one task: plan, run, measure, and plan again until the goal is reached.

1.  The measured world alone decides. It is measured at the start, after every plan (planning may take
    long) and after every submission. The goal is reached as soon as one of these measurements makes it
    true, even in the middle of a plan. An unknown value never makes it true.
2.  A plan is verified before its first step (`plan_source.py`, which also says what is done while a plan is
    late), and then executed by `plan_executor.py`. A step whose `unless` is measured as true at its turn is
    skipped; if `unless` is unknown the step runs.
3.  A plan fails with the first step that fails for good. A plan also ends when it is rejected, or finished
    without the goal. Then the agent plans again (`replans` counts this), up to `site.limits.replans` times.
    If the failed plan took less than `RETRY_INTERVAL_S`, the agent waits that long first.
4.  A plan does not count as a re-plan if it failed because of what may change by itself: a person nearby, a
    silent sensor, a quantity that a condition reads, a quota whose window will free it. The agent waits
    `RETRY_INTERVAL_S`, or a tenth of a long wait, and plans again, at most as long as `waiting.py` says.
5.  The agent gives up at once when a skill ends twice with the same verdict, which says why no other try can
    succeed; when the gate denies the same request a second time for any other reason; when a step fails again
    and again in the same state and chance does not explain it (`repeats.py`, `failure_streak.py`), and
    nothing else provides the same; when the same plan leaves the same state more often than chance explains;
    when two plans in a row are rejected for the same reasons; when the time limit of the task has passed, or
    the operator has stopped everything. Before it gives up for any but the last two, it asks a person for
    help, if there is one to ask. After that, all that failed may be tried again.
6.  A checkpoint is written at every step boundary, before the step begins and after it has ended, and with
    every plan. A resumed run verifies that plan again and continues where it was. The end is kept, too.

Apart from waiting, a run submits at most (replans + 1) · Σ over a plan's steps of (2 + 2 · retry) skills: the
tries, what runs between two of them, and what runs after the last. A composition's handlers may be tried more
than once themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import inf
from typing import Final

from aeros.agent.errands import ErrandPosition
from aeros.agent.execution.attempt_journal import record_replan, record_unmet_definitions
from aeros.agent.execution.journal import Journal
from aeros.agent.execution.part_stops import PlanFailure
from aeros.agent.execution.plan_executor import PlanExecutor
from aeros.agent.execution.progress import PlanProgress
from aeros.agent.execution.report import RunReport
from aeros.agent.execution.step_attempt import StepRunner
from aeros.agent.execution.waiting import MAX_WAIT_S, Wait
from aeros.agent.instructions.meaning import Errand
from aeros.agent.plan_source import PlanSource
from aeros.agent.planning.base import Planner
from aeros.agent.planning.planner_client import PlannerClient
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import TaskGraph
from aeros.agent.recovery.checkpoint import CheckpointStore, TaskCheckpoint
from aeros.agent.recovery.recover import ProgressRecovery
from aeros.agent.world.definitions import definition_causes
from aeros.runtime.ports import AuditEvent, Runtime

RETRY_INTERVAL_S: Final = 1.0
"""Time between two requests for an action that may be allowed later, in plant seconds."""

LONG_WAIT_TRIES: Final = 10
"""Plans that are made at most while the agent waits for longer than `MAX_WAIT_S`."""

_ONLY_ERRAND: Final = ErrandPosition()

AskForHelp = Callable[[str], bool]
"""Says to a person why the task cannot go on, and returns True once the person has helped."""


class TaskLoop:
    """One run towards one goal, for at most `timeout` seconds of plant time.

    `planning_timeout` is the wall time (s) for each plan, which is then made in a separate process. Without
    `ask_for_help` nobody is asked.
    """

    _ask_for_help: AskForHelp | None = None

    def __init__(
        self,
        runtime: Runtime,
        planner: Planner,
        attempts: StepRunner,
        journal: Journal,
        routed: RoutedTask,
        timeout: float | None = None,
        checkpoints: CheckpointStore | None = None,
        agent: str = "",
        position: ErrandPosition = _ONLY_ERRAND,
        *,
        planning_timeout: float | None = None,
        ask_for_help: AskForHelp | None = None,
    ) -> None:
        self._ask_for_help = ask_for_help
        self._checkpoints = checkpoints
        self._agent = agent
        self._position = position
        self._is_resumed = False
        self._instruction = ""
        self._plan: TaskGraph | None = None
        self._progress = PlanProgress()
        self._timeout = timeout
        self._until = inf if timeout is None else runtime.now() + timeout
        self._engine = PlanExecutor(attempts, journal, self._is_goal_reached, self._until)
        self._waited = 0.0
        self._finished_plans = attempts.failure_rules.finished_plans
        self._runtime = runtime
        recall = attempts.planning_memory.recall
        proposals = PlannerClient(runtime, planner, planning_timeout, recall)
        barred, proposed = position.barred_skills, position.proposed_plan
        self._plans = PlanSource(runtime, proposals, attempts, journal, routed, barred, proposed)
        self._attempts = attempts
        self._journal = journal
        self._routed = routed
        self._replans = 0

    def run(self, instruction: str, errand: Errand | None = None) -> RunReport:
        """Pursue the goal until it is reached or the run gives up.

        A condition of the errand is measured first, unless the run is resumed, or the errand before has
        decided it. If it is false, nothing is done and the report says `skipped`.

        Args:
            instruction: words of the user, for the report and the checkpoints.
            errand: the request with its condition; None for no condition.

        Returns:
            The steps, the result and, if the goal was not reached, the reason.
        """
        self._instruction = instruction
        task = self._routed.task
        holds = True if errand is None else self._decide(errand)
        reason = self._run_until_goal() if holds is True else _skip(self._journal, errand, holds)
        skipped, world = holds is False, self._attempts.world
        if not skipped and world.truth_by_known_values(task.goal) is not True:
            behind = definition_causes(world, world.unmet_parts(task.goal), self._runtime.active_modules())
            record_unmet_definitions(self._journal, str(self._routed), behind)
        return RunReport(
            instruction=instruction,
            module=self._routed.module,
            task=task.id,
            goal=task.goal_text if errand is None else errand.goal_text,
            reached=reason is None and not skipped,
            measured=world.measured_values(task.goal, task.reported),
            steps=tuple(self._attempts.records),
            replans=self._replans,
            reason=reason,
            skipped=skipped,
        )

    def _decide(self, errand: Errand) -> bool | None:
        """Decide if an errand is done; None if that is unknown. One with a checkpoint was begun."""
        if errand.condition is None or self._is_resumed:
            return True
        if errand.is_otherwise:
            return self._position.earlier_reports[-1].skipped
        return self._attempts.observe().truth_by_known_values(errand.condition)

    def resume(self, checkpoint: TaskCheckpoint, events: Iterable[AuditEvent]) -> None:
        """Restore the run from a checkpoint, before `run` is called.

        Args:
            checkpoint: state of the run when the earlier session wrote it.
            events: events that the runtime recorded since.
        """
        self._replans, self._waited = checkpoint.replans, checkpoint.waited_s
        self._plans.last_problems = list(checkpoint.last_plan_problems)
        self._until = self._engine.until = inf if checkpoint.deadline is None else checkpoint.deadline
        self._engine.denied = set(checkpoint.denied_steps)
        self._attempts.restore(checkpoint.steps, checkpoint.planning_states, checkpoint.avoided_skills)
        # The record since this checkpoint may not include the steps that an earlier crash interrupted.
        self._attempts.bars.restore(checkpoint.uncertain_steps)
        self._attempts.failure_rules.repeats.restore(checkpoint.repeated_failures)
        progress = checkpoint.progress()
        modules, world = self._runtime.active_modules(), self._attempts.world
        recovery = ProgressRecovery(modules, world, self._attempts.bars, self._journal)
        recovery.recover(progress, events, checkpoint.audit_head.records)
        self._plan = checkpoint.plan if recovery.is_position_known else None
        self._progress = progress
        self._is_resumed = True
        position = "goes on with its plan" if self._plan is not None else "plans anew"
        task = str(self._routed)
        self._journal.record(
            "run-resumed",
            f"{task}: {position}",
            task=task,
            told=position,
            records=checkpoint.audit_head.records,
        )

    def save_final(self, report: RunReport) -> None:
        """Write the final checkpoint, which leaves nothing to resume.

        Args:
            report: result of the run.
        """
        if self._checkpoints is not None:
            self._checkpoints.write_final(self._checkpoint(report))

    def _save(self) -> None:
        if self._checkpoints is not None:
            self._checkpoints.write(self._checkpoint())

    def _checkpoint(self, ended: RunReport | None = None) -> TaskCheckpoint:
        attempts, progress, position = self._attempts, self._progress, self._position
        return TaskCheckpoint(
            agent=self._agent,
            instruction=self._instruction,
            task=str(self._routed),
            goal=self._routed.task.goal_text,
            time=self._runtime.now(),
            audit_head=self._runtime.log_head(),
            world=attempts.world.predicates,
            replans=self._replans,
            waited_s=self._waited,
            deadline=None if self._until == inf else self._until,
            denied_steps=tuple(sorted(self._engine.denied)),
            avoided_skills=tuple(sorted(attempts.dispatcher.denied)),
            uncertain_steps=attempts.bars.to_checkpoint,
            repeated_failures=attempts.failure_rules.repeats.to_checkpoint,
            last_plan_problems=tuple(self._plans.last_problems),
            planning_states=tuple(attempts.planned_in),
            steps=tuple(attempts.records),
            plan=self._plan,
            attempts=tuple(progress.attempts.items()),
            done_paths=tuple(sorted(progress.done_paths)),
            branch_choices=tuple(progress.branch_choices.items()),
            part_starts=tuple(progress.part_starts.items()),
            final_report=ended,
            errand=position.number,
            earlier_reports=position.earlier_reports,
        )

    def _run_until_goal(self) -> str | None:
        """Run plans until the goal is reached; return None then, else the reason to give up."""
        cap = self._runtime.site.limits.replans
        while not self._is_goal_reached():
            began = self._runtime.now()
            end = self._run_plan()
            if self._is_goal_reached():
                break
            if self._attempts.waiting.was_cancelled:
                return "cancelled by the client"
            if self._engine.timed_out or self._runtime.now() >= self._until:
                return f"{_timeout_text(self._timeout)}; the plan ended: {end.reason}"
            hopeless = _reason_to_give_up(end, self._waited, self._replans, cap)
            if hopeless:
                if not self._was_helped(hopeless):
                    return hopeless
                continue
            if end.wait is not None:
                self._wait(end.reason, end.wait)
                continue
            self._waited = 0.0
            self._replans += 1
            self._save()
            record_replan(self._journal, self._replans, end.reason, end.causes)
            # A plan that failed at once (for example while a sensor is silent) would fail again at once.
            failed_at_once = self._runtime.now() - began < RETRY_INTERVAL_S
            self._idle(max(end.pause_s, RETRY_INTERVAL_S if failed_at_once else 0.0))
        return None

    def _was_helped(self, reason: str) -> bool:
        """Ask a person for help, if there is one to ask; after help, everything may be tried again."""
        if self._ask_for_help is None or self._runtime.is_stopped:
            return False
        self._journal.record("help-asked", f"asks for help: {reason}", reason=reason)
        if not self._ask_for_help(reason):
            return False
        self._journal.record("help-given", "somebody has helped; goes on with a new look", reason=reason)
        self._attempts.failure_rules.forget()
        self._engine.denied.clear()
        self._plan, self._replans, self._waited = None, 0, 0.0
        self._attempts.observe()
        return True

    def _wait(self, reason: str, wait: Wait) -> None:
        # Steps before the one that waits may run again each time, so a long wait has long intervals.
        seconds = RETRY_INTERVAL_S if wait.limit_s <= MAX_WAIT_S else wait.limit_s / LONG_WAIT_TRIES
        self._waited += seconds
        self._save()
        self._journal.record("wait-started", f"waits until {wait.subject}", seconds=seconds, reason=reason)
        self._idle(seconds)

    def _idle(self, seconds: float) -> None:
        if seconds > 0.0:
            self._attempts.idle_until(min(self._until, self._runtime.now() + seconds))

    def _run_plan(self) -> PlanFailure:
        graph = self._next_plan()
        if isinstance(graph, PlanFailure):
            return graph
        self._plan, self._progress.on_change = graph, self._save
        self._save()
        end = self._engine.run(graph.body, self._progress)
        if end is None or not end.is_final:
            self._plan = None
        return end or self._finished(graph)

    def _finished(self, graph: TaskGraph) -> PlanFailure:
        """Return the failure of a plan that was carried out, if the goal is still not reached."""
        world, goal = self._attempts.world, self._routed.task.goal
        reason = "the plan is finished, but the goal is not reached"
        if self._is_goal_reached() or not self._finished_plans.is_useless(graph.body, world.predicates):
            return PlanFailure(reason)
        unmet = world.unmet_reason(goal)
        return PlanFailure(f"{reason}: the same plan left the same state each time; {unmet}", is_final=True)

    def _next_plan(self) -> TaskGraph | PlanFailure:
        """Return a new verified plan; a resumed run first returns its own plan, if it is still valid."""
        if self._plan is None:
            self._progress = PlanProgress()
            return self._plans.new_plan(self._until)
        plan, self._plan = self._plan, None
        return self._plans.kept_plan(plan)

    def _is_goal_reached(self) -> bool:
        return self._attempts.world.truth_by_known_values(self._routed.task.goal) is True


def _skip(journal: Journal, errand: Errand | None, holds: bool | None) -> str | None:
    """Record that an errand is not pursued; return the reason, None if its condition is false."""
    assert errand is not None  # noqa: S101 - without an errand there is no condition
    denied = "did not hold when the request before was begun" if errand.is_otherwise else "does not hold"
    state = f"{'is unknown' if holds is None else denied}: {errand.condition_text}"
    journal.record(
        "errand-skipped",
        f"{errand.routed} is not begun: its condition {state}",
        task=str(errand.routed),
        condition=errand.condition_text,
        measured=holds,
    )
    return None if holds is False else f"nothing was done, as the condition of the request {state}"


def _reason_to_give_up(end: PlanFailure, waited: float, replans: int, cap: int) -> str:
    """Return why another plan is of no use; empty if it may be of use.

    `waited` is in plant seconds, and `cap` is the greatest number of re-plans.
    """
    if end.is_final:
        return end.reason
    if end.wait is not None:
        spent = f"{waited:g} s of waiting until {end.wait.subject}"
        return f"{spent} did not help: {end.reason}" if waited >= end.wait.limit_s else ""
    if replans >= cap:
        return f"the goal is not reached after {cap} re-plans; the last plan ended: {end.reason}"
    return ""


def _timeout_text(limit: float | None) -> str:
    """Return the text; the deadline of a resumed run is kept without the limit that it comes from."""
    return "the time limit has passed" if limit is None else f"the time limit of {limit:g} s has passed"
