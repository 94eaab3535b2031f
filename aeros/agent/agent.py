"""The persistent agent: holds its state folder, accepts instructions and pursues their goals.

The agent proposes and cannot act. It knows only the port of the runtime, and the gate decides every action
of every skill that it proposes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from aeros.agent.errands import ErrandPosition, attending, barred_skills, combined_report
from aeros.agent.errors import AgentError
from aeros.agent.execution.journal import Journal, Observer
from aeros.agent.execution.report import RunReport
from aeros.agent.execution.step_attempt import StepRunner
from aeros.agent.identity import Identity, acquire_identity, new_identity
from aeros.agent.instructions.meaning import Errand, Spoken, Understanding
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.understand import settle_meaning
from aeros.agent.memory.recall import recalled_places
from aeros.agent.memory.schema import IN_MEMORY
from aeros.agent.memory.store import Memory, open_memory
from aeros.agent.planning.base import Planner, RulePlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.recovery.checkpoint import CheckpointStore, TaskCheckpoint, UnusableCheckpointError
from aeros.agent.recovery.lifecycle import Lifecycle, LifecycleEvent, Phase
from aeros.agent.recovery.origin import events_since_checkpoint
from aeros.agent.recovery.quarantine import Quarantine
from aeros.agent.task_loop import AskForHelp, TaskLoop
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
        self._seed, self._within = seed, planning_timeout
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

    ask_for_help: AskForHelp | None = None
    """Asks a person for help before a task is given up; None if nobody is to be asked."""

    is_cancelled: Callable[[], bool] | None = None
    """Returns True once the client of the task has cancelled it; None if nobody can."""

    def run(
        self, instruction: Spoken, timeout: float | None = None, goal: ActionCondition | None = None
    ) -> RunReport:
        """Pursue `instruction` until its goal is reached or the run gives up, as `task_loop.py` defines.

        Tasks that an instruction asks for are pursued in order, until one is not reached.

        Args:
            instruction: words of the user, understood whole by the active tasks, or their meaning.
            timeout: plant time (s) after which running steps are cancelled; None for no limit.
            goal: goal that replaces the goal of the only task.

        Returns:
            The steps that were run, whether the goals were reached and, if not, the reason.

        Raises:
            InstructionError: the instruction is not understood, or `goal` is given for several tasks.

        Errors while writing the audit record or memory propagate.
        """
        meaning = self._understand(instruction, goal)
        self._forget()
        with attending(meaning, self._runtime, self._planner):
            return self._pursue_all(meaning, timeout)

    def resume(
        self, instruction: Spoken, timeout: float | None = None, goal: ActionCondition | None = None
    ) -> RunReport:
        """Continue `instruction` where an earlier session left it; the arguments are those of that `run`.

        If that session finished the task, its report is returned and nothing is done. If it never started the
        task, this does the same as `run`.

        Args:
            instruction: words that the earlier session was given, or their meaning.
            timeout: plant time limit (s) for a run that starts anew; a resumed run keeps its earlier
                deadline.
            goal: goal that replaced the task's own goal.

        Returns:
            The report of the run, with the steps of the earlier session.

        Raises:
            AgentError: the checkpoints that exist cannot be resumed from.
            InstructionError: the instruction is not understood, or `goal` is given for several tasks.
        """
        meaning = self._understand(instruction, goal)
        found = self._load_checkpoint(meaning)
        if found is not None and (ended := found[0].final_report) is not None:
            task = f"{ended.module}.{ended.task}"
            text = f"{task} had ended: {ended.outcome}"
            self._journal.record("run-already-ended", text, task=task, **_summary(ended))
            return ended
        with attending(meaning, self._runtime, self._planner):
            return self._pursue_all(meaning, timeout, found)

    def set_paused(self, *, is_paused: bool) -> None:
        """Record that the operator paused or resumed; the runtime obeys that by itself.

        Args:
            is_paused: True after a pause, False after a resume.
        """
        change = LifecycleEvent.PAUSE if is_paused else LifecycleEvent.RESUME
        if self.lifecycle.is_allowed(change):
            self.lifecycle.apply(change)

    def _pursue_all(
        self,
        meaning: Understanding,
        timeout: float | None,
        resumed: tuple[TaskCheckpoint, Sequence[AuditEvent]] | None = None,
    ) -> RunReport:
        """Pursue the errands in order, from that of the checkpoint on, and save the end of the last."""
        first = 0 if resumed is None else resumed[0].errand
        reports = [] if resumed is None else list(resumed[0].earlier_reports)
        deadline = None if timeout is None else self._runtime.now() + timeout
        for number, errand in enumerate(meaning.errands[first:], first):
            if number > first:
                self._record_selection(meaning, number)
            self._runtime.set_parameters(errand.routed.variables)
            self._runtime.set_memories(self._recalled())
            remaining = None if deadline is None else max(0.0, deadline - self._runtime.now())
            barred = barred_skills(meaning, errand, self._runtime.active_modules())
            position = ErrandPosition(number, tuple(reports), barred, errand.proposed_plan)
            steps_before = len(resumed[0].steps) if resumed is not None and number == first else 0
            loop = self._task_loop(errand.routed, remaining, position)
            if resumed is not None and number == first:
                loop.resume(*resumed)
            report = self._pursue(loop, meaning.instruction, errand)
            reports.append(report)
            if report.has_failed or number + 1 == len(meaning.errands):
                break
        whole = combined_report(meaning.instruction, reports)
        halted = (one.status is StepStatus.HALTED for one in report.steps[steps_before:])
        was_stopped = self._runtime.is_stopped or any(halted)
        if not whole.has_failed or not was_stopped:
            # Last of all: as long as the final checkpoint is not written, the run can be resumed.
            loop.save_final(whole)
        return whole

    def _recalled(self) -> Mapping[str, Mapping[str, Any]]:
        remembered = self._memory.remembered_values().values()
        modules = self._runtime.active_modules().values()
        return recalled_places(remembered, modules, datetime.now(UTC), self._memory.session)

    def _task_loop(self, routed: RoutedTask, timeout: float | None, position: ErrandPosition) -> TaskLoop:
        attempts = StepRunner(self._runtime, self._memory, self._journal, str(routed), self._seed)
        attempts.waiting.is_cancelled = self.is_cancelled
        return TaskLoop(
            self._runtime,
            self._planner,
            attempts,
            self._journal,
            routed,
            timeout,
            self._checkpoints,
            str(self.identity.id),
            position,
            planning_timeout=self._within,
            ask_for_help=self.ask_for_help,
        )

    def _pursue(self, loop: TaskLoop, instruction: str, errand: Errand) -> RunReport:
        self.lifecycle.apply(LifecycleEvent.BEGIN)
        routed = errand.routed
        try:
            report = loop.run(instruction, errand)
        except KeyboardInterrupt:
            self._journal.record("run-interrupted", f"{routed} was interrupted", task=str(routed))
            raise
        self.lifecycle.apply(LifecycleEvent.END)
        self._record_result(routed, report)
        return report

    def _forget(self) -> None:
        if self._checkpoints is not None:
            self._checkpoints.delete()

    def _load_checkpoint(self, meaning: Understanding) -> tuple[TaskCheckpoint, Sequence[AuditEvent]] | None:
        """Return the newest usable checkpoint and the runtime events since it; None if there is none.

        Raises:
            AgentError: steps of the task have begun, and no usable checkpoint of it is left.
        """
        problems = []
        for kept in () if self._checkpoints is None else self._checkpoints.read():
            try:
                if isinstance(kept, UnusableCheckpointError):
                    raise kept
                return kept, events_since_checkpoint(kept, str(self.identity.id), meaning, self._runtime)
            except UnusableCheckpointError as unusable:
                problems.append(str(unusable))
                self._journal.record("checkpoint-rejected", str(unusable), reason=str(unusable))
        if problems:
            raise AgentError(f"the task cannot be resumed: {'; '.join(problems)}; start it again")
        if any(one.event == "step-began" for one in self._runtime.events_since(EMPTY_LOG_HEAD) or ()):
            raise AgentError("the task cannot be resumed: its checkpoint is gone; start it again")
        return None

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

    def _understand(self, spoken: Spoken, goal: ActionCondition | None) -> Understanding:
        try:
            meaning = settle_meaning(spoken, self._runtime.active_modules(), goal)
        except InstructionError as error:
            self._journal.record("task-not-found", error.reason, instruction=str(spoken), reason=error.reason)
            raise
        self._record_selection(meaning, 0)
        return meaning

    def _record_selection(self, meaning: Understanding, number: int) -> None:
        errand, words = meaning.errands[number], meaning.instruction
        routed = errand.routed
        text = f"“{words}” → {'; then '.join(meaning.formal_lines)}" if number == 0 else errand.formal_text
        self._journal.record(
            "task-selected",
            text,
            instruction=words,
            task=str(routed),
            understood=list(meaning.formal_lines),
            source=meaning.source,
            account=list(meaning.account),
            number=number + 1,
        )

    def _record_result(self, routed: RoutedTask, report: RunReport) -> None:
        summary = _summary(report)
        self._journal.record("run-ended", f"{routed}: {report.outcome}", task=str(routed), **summary)
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
        "skipped": report.skipped,
    }


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
    plant: str = "",
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
        plant: name of the plant; results on plants of other names are no evidence.

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
        open_memory(folder / MEMORY_FILE, identity, plant) as memory,
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
