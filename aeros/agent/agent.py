"""The persistent agent: holds its state folder, accepts instructions and pursues their goals.

The agent proposes and cannot act. It knows only the port of the runtime, and the gate decides every action
of every skill that it proposes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from aeros.agent.errors import AgentError
from aeros.agent.execution.journal import Journal, Observer
from aeros.agent.execution.report import RunReport
from aeros.agent.execution.step_attempt import StepRunner
from aeros.agent.identity import Identity, acquire_identity, new_identity
from aeros.agent.memory.schema import IN_MEMORY
from aeros.agent.memory.store import Memory, open_memory
from aeros.agent.planning.base import Planner, RulePlanner
from aeros.agent.planning.routing import RoutedTask, RoutingError, route
from aeros.agent.recovery.checkpoint import CheckpointStore, TaskCheckpoint, UnusableCheckpointError
from aeros.agent.recovery.lifecycle import Lifecycle, LifecycleEvent, Phase
from aeros.agent.recovery.quarantine import Quarantine
from aeros.agent.task_loop import TaskLoop
from aeros.runtime.ports import EMPTY_LOG_HEAD, AuditEvent, Runtime, StepStatus
from aeros.spec.model.ecm import ActionCondition

MEMORY_FILE: Final = "memory.sqlite3"
"""The file of the agent's memory, in its folder."""


class Agent:
    """An awake agent. Only `start_agent` makes one with a folder: its lock ensures that there is no other.

    With `folder=None` the agent leaves nothing on disk.
    """

    def __init__(
        self,
        folder: Path | None,
        identity: Identity,
        runtime: Runtime,
        memory: Memory,
        planner: Planner,
        on_event: Observer | None,
        seed: int = 0,
        planning_timeout: float | None = None,
    ) -> None:
        self._seed = seed
        self._within = planning_timeout
        self.identity = identity
        self._runtime = runtime
        self._memory = memory
        self._planner = planner
        self._journal = Journal(runtime, memory, on_event)
        self._checkpoints = None if folder is None else CheckpointStore(folder)
        self.lifecycle = Lifecycle(folder, self._record_transition)
        for skill in memory.mark_interrupted():
            self._journal.record(
                "step-interrupted", f"{skill} was under way when the agent ended", skill=skill
            )

    def run(
        self, instruction: str, timeout: float | None = None, goal: ActionCondition | None = None
    ) -> RunReport:
        """Pursue `instruction` until its goal is reached or the run gives up, as `task_loop.py` defines.

        Args:
            instruction: words of the user, which must name exactly one active task.
            timeout: plant time (s) after which running steps are cancelled; None for no limit.
            goal: goal that replaces the task's own goal.

        Returns:
            The steps that were run, whether the goal was reached and, if not, the reason.

        Raises:
            RoutingError: the instruction names no task, or several.

        Errors while writing the audit record or memory propagate.
        """
        routed = self._route(instruction, goal)
        self._forget()
        return self._pursue(instruction, routed, timeout)

    def resume(
        self, instruction: str, timeout: float | None = None, goal: ActionCondition | None = None
    ) -> RunReport:
        """Continue `instruction` where an earlier session left it; the arguments are those of that `run`.

        If that session finished the task, its report is returned and nothing is done. If it never started the
        task, this does the same as `run`.

        Args:
            instruction: words that the earlier session was given.
            timeout: plant time limit (s) for a run that starts anew; a resumed run keeps its earlier
                deadline.
            goal: goal that replaced the task's own goal.

        Returns:
            The report of the run, with the steps of the earlier session.

        Raises:
            AgentError: the checkpoints that exist cannot be resumed from.
            RoutingError: the instruction names no task, or several.
        """
        routed = self._route(instruction, goal)
        found = self._load_checkpoint(instruction, routed)
        if found is not None and (ended := found[0].final_report) is not None:
            text = f"{routed} had ended: {_outcome_text(ended)}"
            self._journal.record("run-already-ended", text, task=str(routed), **_summary(ended))
            return ended
        return self._pursue(instruction, routed, timeout, found)

    def set_paused(self, *, is_paused: bool) -> None:
        """Record that the operator paused or resumed; the runtime obeys that by itself.

        Args:
            is_paused: True after a pause, False after a resume.
        """
        change = LifecycleEvent.PAUSE if is_paused else LifecycleEvent.RESUME
        if self.lifecycle.is_allowed(change):
            self.lifecycle.apply(change)

    def _pursue(
        self,
        instruction: str,
        routed: RoutedTask,
        timeout: float | None,
        resumed: tuple[TaskCheckpoint, Sequence[AuditEvent]] | None = None,
    ) -> RunReport:
        self.lifecycle.apply(LifecycleEvent.BEGIN)
        try:
            attempts = StepRunner(self._runtime, self._memory, self._journal, str(routed), self._seed)
            pursuit = TaskLoop(
                self._runtime,
                self._planner,
                attempts,
                self._journal,
                routed,
                timeout,
                self._checkpoints,
                str(self.identity.id),
                planning_timeout=self._within,
            )
            if resumed is not None:
                pursuit.resume(*resumed)
            report = pursuit.run(instruction)
        except KeyboardInterrupt:
            self._journal.record("run-interrupted", f"{routed} was interrupted", task=str(routed))
            raise
        self.lifecycle.apply(LifecycleEvent.END)
        self._record_result(routed, report)
        new_steps = report.steps[0 if resumed is None else len(resumed[0].steps) :]
        was_stopped = self._runtime.is_stopped or any(one.status is StepStatus.HALTED for one in new_steps)
        if report.reached or not was_stopped:
            # Last of all: as long as the final checkpoint is not written, the run can be resumed.
            pursuit.save_final(report)
        return report

    def _forget(self) -> None:
        if self._checkpoints is not None:
            self._checkpoints.delete()

    def _load_checkpoint(
        self, instruction: str, routed: RoutedTask
    ) -> tuple[TaskCheckpoint, Sequence[AuditEvent]] | None:
        """Return the newest usable checkpoint and the runtime events since it; None if there is none.

        Raises:
            AgentError: steps of the task have begun, and no usable checkpoint of it is left.
        """
        problems = []
        for kept in () if self._checkpoints is None else self._checkpoints.read():
            try:
                if isinstance(kept, UnusableCheckpointError):
                    raise kept
                return kept, self._events_since(kept, instruction, routed)
            except UnusableCheckpointError as unusable:
                problems.append(str(unusable))
                self._journal.record("checkpoint-rejected", str(unusable), reason=str(unusable))
        if problems:
            raise AgentError(f"the task cannot be resumed: {'; '.join(problems)}; start it again")
        if any(one.event == "step-began" for one in self._runtime.events_since(EMPTY_LOG_HEAD) or ()):
            raise AgentError("the task cannot be resumed: its checkpoint is gone; start it again")
        return None

    def _events_since(
        self, kept: TaskCheckpoint, instruction: str, routed: RoutedTask
    ) -> Sequence[AuditEvent]:
        """Return the runtime events since the checkpoint.

        Raises:
            UnusableCheckpointError: the checkpoint is of another agent, task or plant.
        """
        now, task = self._runtime.now(), routed.task
        if kept.agent != str(self.identity.id):
            raise UnusableCheckpointError("the checkpoint belongs to another agent")
        if (kept.instruction, kept.task, kept.goal) != (instruction, str(routed), task.goal_text):
            raise UnusableCheckpointError(
                f"the checkpoint is of another task: “{kept.instruction}”, {kept.task}"
            )
        events = self._runtime.events_since(kept.earliest_head)
        if events is None or self._runtime.events_since(kept.audit_head) is None:
            raise UnusableCheckpointError(
                "the audit record does not hold the record at which the checkpoint was made"
            )
        latest = max([kept.time, *(one.details.get("time", kept.time) for one in events)])
        if now < latest and kept.final_report is None:
            raise UnusableCheckpointError(
                f"the plant's clock is at {now:g} s, and was at {latest:g} s: it is another plant"
            )
        return events

    def _record_transition(self, phase: Phase, change: LifecycleEvent, then: Phase) -> None:
        abandoned = self.identity.crashed_holder if change is LifecycleEvent.CRASH else None
        whose = "" if abandoned is None else f": {abandoned}"
        # People see that a task begins or ends; no text is needed for that.
        is_plain = change in (LifecycleEvent.BEGIN, LifecycleEvent.END)
        crashed = (
            f", as its last session ended without a report{whose}" if change is LifecycleEvent.CRASH else ""
        )
        self._journal.record(
            "lifecycle",
            "" if is_plain else f"the agent is {then.value}{crashed}",
            before=phase.value,
            change=change.value,
            after=then.value,
            abandoned=abandoned,
        )

    def _route(self, instruction: str, goal: ActionCondition | None) -> RoutedTask:
        try:
            routed = route(instruction, self._runtime.active_modules())
        except RoutingError as error:
            self._journal.record("task-not-found", error.reason, instruction=instruction, reason=error.reason)
            raise
        self._journal.record(
            "task-selected", f"“{instruction}” → {routed}", instruction=instruction, task=str(routed)
        )
        if goal is not None:
            return replace(routed, task=replace(routed.task, goal=goal.term, goal_text=goal.text))
        return routed

    def _record_result(self, routed: RoutedTask, report: RunReport) -> None:
        summary = _summary(report)
        self._journal.record("run-ended", f"{routed}: {_outcome_text(report)}", task=str(routed), **summary)
        self._memory.set_fact(f"last run of {routed}", summary, source=f"session {self.identity.sessions}")


def _summary(report: RunReport) -> dict[str, Any]:
    return {
        "reached": report.reached,
        "goal": report.goal,
        "measured": dict(report.measured),
        "steps": len(report.steps),
        "retries": report.retries,
        "recoveries": report.recoveries,
        "replans": report.replans,
        "reason": report.reason,
    }


def _outcome_text(report: RunReport) -> str:
    return "goal reached" if report.reached else str(report.reason)


@contextmanager
def start_agent(
    folder: Path,
    name: str,
    runtime: Runtime,
    planner: Planner | None = None,
    on_event: Observer | None = None,
    seed: int = 0,
    within: float | None = None,
    purpose: str = "",
) -> Iterator[Agent]:
    """Start the robot's one agent, with identity and memory in `folder`.

    The session is closed in memory and the lock is released however the block ends.

    Args:
        folder: state folder of the robot.
        name: name of the agent, if it is created now.
        runtime: port of the runtime that decides and executes.
        planner: planner to ask; by default the task's planning rules.
        on_event: called with each event of the agent.
        seed: seed of the choices between providers of a capability.
        within: wall time (s) for each plan, made in a separate process; by default plans are made in place.
        purpose: text shown to others who want the folder's lock.

    Yields:
        The awake agent.

    Raises:
        AgentError: another agent is awake, this one is in quarantine, or its memory cannot be trusted.
    """
    quarantined = Quarantine(folder).reason()
    if quarantined is not None:
        raise AgentError(quarantined)
    with (
        acquire_identity(folder, name, purpose) as identity,
        open_memory(folder / MEMORY_FILE, identity) as memory,
    ):
        yield Agent(
            folder,
            identity,
            runtime,
            memory,
            planner or RulePlanner(),
            on_event,
            seed,
            planning_timeout=within,
        )


@contextmanager
def open_temporary_agent(
    name: str,
    runtime: Runtime,
    planner: Planner | None = None,
    on_event: Observer | None = None,
    seed: int = 0,
    within: float | None = None,
) -> Iterator[Agent]:
    """Start an agent that exists for this block only, with its memory in RAM.

    For trials, each of which has to start like the first. Otherwise the same as `start_agent`.

    Args:
        name: name of the agent.
        runtime: port of the runtime that decides and executes.
        planner: planner to ask; by default the task's planning rules.
        on_event: called with each event of the agent.
        seed: seed of the choices between providers of a capability.
        within: wall time (s) for each plan, made in a separate process; by default plans are made in place.

    Yields:
        The awake agent.
    """
    identity = new_identity(name)
    with open_memory(IN_MEMORY, identity) as memory:
        yield Agent(None, identity, runtime, memory, planner or RulePlanner(), on_event, seed, within)
