"""Carries out steps: skill → gate → motion → record → plant → observation, in this order and no other.

- No motion without a decision on readings taken just before, and no decision acted on before its
  record is durable.
- However a step ends, by itself, denied, stopped, late, or because something here is broken, the same
  clean-up runs once: the plant is stopped unless the skill finished, the generator is closed, the
  plant hears that the skill ended, the end is recorded.
- What a skill, a planner or a caller gets wrong is a `StepResult`.  What is wrong with AEROS itself
  (`InternalError` from the gate, a plant that raises) or with the record (`AuditError`) is raised,
  after the clean-up.

An isolated skill is interrupted at any time; one that runs in this process, not while its own code runs.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from typing import Any, Final

from aeros.runtime.audit import AuditError, AuditLog, DecisionCounts
from aeros.runtime.configuration import Configuration
from aeros.runtime.decision import Caller, Decision, Verdict
from aeros.runtime.gate import Gate
from aeros.runtime.governor import Command, Fixed, Governor
from aeros.runtime.history import Histories
from aeros.runtime.inputs import InputError, settle_inputs
from aeros.runtime.monitor import MonitorFactory
from aeros.runtime.observation import observation_for
from aeros.runtime.ports import (
    Completion,
    Monitor,
    Plan,
    Plant,
    Readings,
    StepRequest,
    StepResult,
    StepStatus,
)
from aeros.runtime.records import (
    caller_details,
    decision_details,
    motion_details,
    session_details,
    spell_reasons,
)
from aeros.runtime.skill_code import SkillRefusedError, told
from aeros.runtime.skill_run import Ending, OpenRun, Run
from aeros.runtime.trajectory import MotionDecider, motion_digest
from aeros.runtime.usage import ClockError, Usage, denied_by_clock
from aeros.skill import Action
from aeros.spec.errors import InternalError
from aeros.spec.model import Ecm, Site, Skill

_LOOK_EVERY: Final = 0.01  # s, while paused
MOST_ACTIONS: Final = 10_000
"""Actions of one step beyond which a skill floods; a zero-time action could otherwise repeat for ever."""


class _RefusedError(Exception):
    """The step never starts; the message says why."""


@dataclass
class _Step:
    """One step under way."""

    ecm: Ecm
    caller: Caller
    run: Run
    deadline: float
    ending: Ending | None = None
    counts: DecisionCounts = field(default_factory=DecisionCounts)

    @property
    def name(self) -> str:
        return f"{self.caller.module}.{self.caller.skill}"

    @property
    def finished(self) -> bool:
        return self.ending is not None and self.ending.status is StepStatus.FINISHED


class Executor:
    """The runtime as the agent sees it (`ports.Runtime`), for one configuration and one plant.

    Runs one step at a time.  It owns neither plant nor log: whoever made them closes them.
    governor: says which configuration is in force; without one, `configuration` is so for good.
    """

    def __init__(
        self,
        configuration: Configuration,
        gate: Gate,
        plant: Plant,
        audit: AuditLog,
        open_run: OpenRun,
        governor: Governor | None = None,
    ) -> None:
        self._governor = Fixed(configuration) if governor is None else governor
        # Of no generation yet: what was loaded before may have changed since, so the first look follows.
        self._generation: int | None = None
        self._configuration = configuration
        self._gate = gate
        self._plant = plant
        self._audit = audit
        self._open_run = open_run
        self._histories = Histories(configuration.site)
        self._monitors = MonitorFactory(configuration.site, self._histories)
        self._motions = MotionDecider(configuration.site.motion)
        self._usage = Usage(configuration.site.quotas)
        audit.append("session-opened", session_details(configuration))

    @property
    def site(self) -> Site:
        """The site whose policy governs."""
        return self._configuration.site

    def active_modules(self) -> Mapping[str, Ecm]:
        """The certified, active modules by name."""
        self._follow()
        return self._configuration.modules

    def now(self) -> float:
        """Seconds on the plant's clock."""
        return self._plant.now()

    def observe(self) -> Readings:
        """Everything that is measured now."""
        return self._plant.observe()

    def note(self, event: str, details: Mapping[str, Any]) -> None:
        """Put an event of the agent's into the record, as a note, so it cannot pass for one of ours."""
        self._audit.append("note", {"event": event, "details": dict(details)})

    def submit(self, request: StepRequest) -> StepResult:
        """Run one skill to its end, every action decided by the gate; never raises for a bad request."""
        self._follow()
        asked = {"module": request.module, "skill": request.skill, "inputs": request.inputs}
        try:
            step = self._prepare(request)
        except _RefusedError as refusal:
            self._audit.append("step-refused", {"reason": str(refusal), **asked})
            return StepResult(StepStatus.REFUSED, str(refusal))
        # However little of the step comes about, what its skill runs in is ended.
        with closing(step.run):
            began = {"time": self.now(), "deadline": step.deadline}
            self._audit.append("step-began", {**began, **caller_details(step.caller)})
            try:
                ending = self._carry_out(step)
            except BaseException as failure:
                self._record_broken(step, failure)
                raise
        counts = step.counts
        # A skill's own words may hold what no file, database or terminal takes.
        reason = ending.reason.encode("utf-8", "backslashreplace").decode()
        outcome = {"time": self.now(), "status": ending.status.value, "reason": reason}
        self._audit.append("step-ended", {**outcome, **caller_details(step.caller)})
        return StepResult(ending.status, reason, counts.allowed, counts.attenuated, counts.denied)

    # Before and after.

    def _prepare(self, request: StepRequest) -> _Step:
        """The step, ready to start; raises `_RefusedError`."""
        ecm, skill = self._find(request)
        try:
            inputs = settle_inputs(skill.inputs, request.inputs)
            run = self._open_run(self.site, ecm, skill, inputs)
        except (InputError, SkillRefusedError) as refusal:
            raise _RefusedError(str(refusal)) from refusal
        deadline = self.now() + float(skill.timeout)
        return _Step(ecm, Caller(ecm.id, skill.id, inputs), run, deadline)

    def _find(self, request: StepRequest) -> tuple[Ecm, Skill]:
        """The module and the skill that are asked for, among the active ones."""
        if type(request.module) is not str or type(request.skill) is not str:
            raise _RefusedError("module and skill are not both names")
        ecm = self._configuration.modules.get(request.module)
        if ecm is None:
            raise _RefusedError(f"no module `{request.module}` is active")
        skill = ecm.skills.get(request.skill)
        if skill is None:
            raise _RefusedError(f"module `{ecm.id}` has no skill `{request.skill}`")
        return ecm, skill

    def _carry_out(self, step: _Step) -> Ending:
        with ExitStack() as leaving:
            # Run from the last to the first, each even if another raises: what moves is stopped first.
            leaving.callback(lambda: self._plant.skill_ended(step.name, finished=step.finished))
            leaving.callback(self._close, step)
            leaving.callback(lambda: None if step.finished else self._plant.stop())
            self._plant.skill_began(step.name)
            step.ending = self._drive(step)
        return step.ending

    @staticmethod
    def _close(step: _Step) -> None:
        complaint = step.run.close()
        if complaint is not None and step.ending is not None:
            reason = f"{step.ending.reason}; and its own clean-up raised {complaint}"
            step.ending = step.ending._replace(reason=reason)

    # The loop.

    def _drive(self, step: _Step) -> Ending:
        """Action after action until the skill or somebody else ends it."""
        for _ in range(MOST_ACTIONS):
            asked = step.run.resume(self._observation(step.ecm), step.deadline - self.now())
            if isinstance(asked, Ending) and asked.status is StepStatus.RAISED:
                return asked
            if self.now() > step.deadline:
                return Ending(StepStatus.TIMED_OUT, "the skill's time-out has passed")
            if isinstance(asked, Ending):
                return asked
            ending = self._act(step, asked)
            if ending is not None:
                return ending
        return Ending(StepStatus.RAISED, f"the skill floods: more than {MOST_ACTIONS} actions")

    def _observation(self, ecm: Ecm) -> Mapping[str, Any]:
        readings = self._plant.observe()
        return observation_for(ecm, self.site, readings, self.now())

    def _act(self, step: _Step, asked: Action) -> Ending | None:
        """Decide, record, execute, all under one generation; None when the skill may go on."""
        while True:
            self._pause()
            if self._governor.command is Command.STOP:
                return Ending(StepStatus.STOPPED, "the operator stops it")
            generation = self._follow()
            if not self._is_active(step.ecm):
                return Ending(StepStatus.STOPPED, f"revoked: `{step.ecm.id}` is not active as it was")
            with self._governor.acting(generation) as in_force:
                if in_force:
                    return self._act_now(step, asked)

    def _act_now(self, step: _Step, asked: Action) -> Ending | None:
        # In this order: a reading is never younger than the time it is judged at.
        measured = self._plant.observe()
        now = self.now()
        names = self._histories.names
        readings = {name: one for name, one in measured.items() if name not in names}
        readings |= self._histories.advance(readings, now)
        gated, usage = self._decide(step.caller, readings, asked, now)
        decision, plan = self._decide_motion(gated, readings)
        step.counts = step.counts.plus(decision.verdict)
        digest = self._configuration.digest
        details = decision_details(decision, digest, now, readings, step.caller, asked, usage)
        details = {**motion_details(gated, decision, motion_digest(plan)), **details}
        self._audit.append("decision", details)
        if decision.verdict is Verdict.DENY:
            return Ending(StepStatus.DENIED, spell_reasons(decision.reasons))
        if decision.action is None:
            raise InternalError(f"the gate said {decision.verdict.value} and gave no action")
        monitor = self._watched(step, decision.action, self._monitors.watch(decision.action, readings))
        # Counted before it moves: an action that fails half-way was executed too.
        self._usage.executed(decision.action.kind, now)
        if isinstance(plan, Completion):
            completion = plan  # the plant cannot do it, and nothing moves
        else:
            completion = self._plant.execute(decision.action, monitor, step.deadline, plan)
        if completion.completed:
            return None
        if completion.reason == "deadline":
            return Ending(StepStatus.TIMED_OUT, "the skill's time-out passed during a motion")
        return Ending(StepStatus.STOPPED, completion.reason or "the plant gave no reason")

    def _decide_motion(self, decision: Decision, readings: Readings) -> tuple[Decision, Plan | None]:
        """What the whole motion makes of the decision, and that motion, where there is one to decide."""
        action = decision.action
        if action is None or not self._motions.governs(action.kind):
            return decision, None
        plan = self._plant.plan(action)
        return self._motions.decide(decision, plan, readings), plan

    # Whoever governs.

    def _follow(self) -> int:
        """Take over the configuration that is in force, if it is another than before; its generation."""
        generation = self._governor.generation
        if generation == self._generation:
            return generation
        generation, configuration = self._governor.configuration()
        self._generation = generation
        if configuration.digest == self._configuration.digest:
            return generation
        if configuration.site.digest != self._configuration.site.digest:
            self._histories = Histories(configuration.site)
            self._usage = self._usage.under(configuration.site.quotas)
            self._monitors = MonitorFactory(configuration.site, self._histories)
            self._motions = MotionDecider(configuration.site.motion)
        self._configuration = configuration
        self._gate = self._gate.under(configuration)
        self._audit.append("configuration-changed", session_details(configuration))
        return generation

    def _is_active(self, ecm: Ecm) -> bool:
        """Whether the same module, of the same code, is active now."""
        now = self._configuration.modules.get(ecm.id)
        was = (ecm.manifest_digest, ecm.code_digest)
        return now is not None and (now.manifest_digest, now.code_digest) == was

    def _pause(self) -> None:
        """Wait while the operator asks for a pause."""
        paused = False
        while self._governor.command is Command.PAUSE:
            if not paused:
                self._audit.append("paused", {"time": self.now()})
            paused = True
            time.sleep(_LOOK_EVERY)
        if paused:
            self._audit.append("resumed", {"time": self.now()})

    def _watched(self, step: _Step, action: Action, monitor: Monitor) -> Monitor:
        """`monitor`, which also trips on a stop, and where the action is revoked while it is under way."""

        def watch(now: float, measured: Mapping[str, Any]) -> str | None:
            if self._governor.command is Command.STOP:
                return "the operator stops it"
            if self._governor.generation != self._generation:
                caller = step.caller
                objection = self._governor.objection(caller.module, caller.skill, action.kind)
                if objection is not None:
                    return f"revoked: {objection}"
            return monitor(now, measured)

        return watch

    def _decide(
        self, caller: Caller, readings: Readings, asked: Action, now: float
    ) -> tuple[Decision, Mapping[str, int] | None]:
        """The decision, and the use of quotas that it was made on."""
        try:
            usage = self._usage.count(now)
        except ClockError as wrong:
            return denied_by_clock(wrong), None
        return self._gate.decide(caller, readings, asked, now, usage), usage

    def _record_broken(self, step: _Step, failure: BaseException) -> None:
        """Say that the step broke off; a record that cannot be written is what is being raised already."""
        try:
            self._audit.append("step-broken", {"reason": told(failure), **caller_details(step.caller)})
        except AuditError as unwritten:
            failure.add_note(f"the end of the step is not in the record: {unwritten}")
