"""The one persistent agent: awake in its state folder, it takes instructions and pursues them.

It can propose and cannot act: of the runtime it knows the port, and every action of every skill
it proposes is decided by the gate.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final

from aeros.agent.attempt import Attempts
from aeros.agent.identity import Identity, born, sole_identity
from aeros.agent.journal import Journal, Observer
from aeros.agent.memory import Memory, open_memory
from aeros.agent.memory_schema import IN_RAM
from aeros.agent.planner import Planner, RulePlanner
from aeros.agent.pursuit import Pursuit
from aeros.agent.report import RunReport
from aeros.agent.routing import Routed, RoutingError, route
from aeros.runtime.ports import Runtime
from aeros.spec.model import Clause

MEMORY: Final = "memory.sqlite3"
"""The file of the agent's memory, in its folder."""


class Agent:
    """An awake agent; made by `awake`, which holds the lock that makes it the only one."""

    def __init__(
        self,
        identity: Identity,
        runtime: Runtime,
        memory: Memory,
        planner: Planner,
        on_event: Observer | None,
        seed: int = 0,
        within: float | None = None,
    ) -> None:
        self._seed = seed
        self._within = within
        self.identity = identity
        self._runtime = runtime
        self._memory = memory
        self._planner = planner
        self._journal = Journal(runtime, memory, on_event)
        for skill in memory.interrupt():
            self._journal.tell("step-interrupted", f"{skill} was under way when the agent ended", skill=skill)

    def run(self, instruction: str, timeout: float | None = None, goal: Clause | None = None) -> RunReport:
        """Pursue `instruction` until its goal is measured, or say why not; semantics in `pursuit.py`.

        timeout: plant seconds after which what is under way is cancelled.
        goal: what to reach in place of the task's own goal.

        Raises `RoutingError` where the instruction names no task or several, and lets through what
        keeps the audit record or memory from being written.
        """
        routed = self._route(instruction)
        if goal is not None:
            routed = replace(routed, task=replace(routed.task, goal=goal.term, goal_text=goal.text))
        try:
            attempts = Attempts(self._runtime, self._memory, self._journal, str(routed), self._seed)
            pursuit = Pursuit(
                self._runtime, self._planner, attempts, self._journal, routed, timeout, within=self._within
            )
            report = pursuit.run(instruction)
        except KeyboardInterrupt:
            self._journal.tell("run-interrupted", f"{routed} was interrupted", task=str(routed))
            raise
        self._conclude(routed, report)
        return report

    def _route(self, instruction: str) -> Routed:
        try:
            routed = route(instruction, self._runtime.active_modules())
        except RoutingError as error:
            self._journal.tell("not-routed", error.reason, instruction=instruction, reason=error.reason)
            raise
        self._journal.tell("routed", f"“{instruction}” → {routed}", instruction=instruction, task=str(routed))
        return routed

    def _conclude(self, routed: Routed, report: RunReport) -> None:
        summary = {
            "reached": report.reached,
            "goal": report.goal,
            "measured": dict(report.measured),
            "steps": len(report.steps),
            "retries": report.retries,
            "recoveries": report.recoveries,
            "replans": report.replans,
            "reason": report.reason,
        }
        text = f"{routed}: " + ("the goal is measured" if report.reached else str(report.reason))
        self._journal.tell("run-ended", text, task=str(routed), **summary)
        self._memory.learn(f"last run of {routed}", summary, source=f"session {self.identity.sessions}")


@contextmanager
def awake(
    folder: Path,
    name: str,
    runtime: Runtime,
    planner: Planner | None = None,
    on_event: Observer | None = None,
    seed: int = 0,
    within: float | None = None,
) -> Iterator[Agent]:
    """The robot's one agent, whose identity and memory are in `folder`, with rules as the usual planner.

    seed: of its choices between skills.
    within: seconds for each plan, which is then made beside the plant's time; by default in place.

    Raises `RefusedError` where another agent is awake or memory cannot be trusted.  However the block
    ends, the session is closed in memory and the lock released.
    """
    with sole_identity(folder, name) as identity, open_memory(folder / MEMORY, identity) as memory:
        yield Agent(identity, runtime, memory, planner or RulePlanner(), on_event, seed, within=within)


@contextmanager
def awake_once(
    name: str,
    runtime: Runtime,
    planner: Planner | None = None,
    on_event: Observer | None = None,
    seed: int = 0,
) -> Iterator[Agent]:
    """An agent that is born for this block and remembers what it does in it, in RAM; nothing is left of it.

    For trials, each of which is to begin as the first: otherwise as `awake`.
    """
    identity = born(name)
    with open_memory(IN_RAM, identity) as memory:
        yield Agent(identity, runtime, memory, planner or RulePlanner(), on_event, seed)
