"""Carries out steps: skill → gate → motion → record → plant → observation, in this order and no other.

- No motion without a decision on readings taken just before, and no decision acted on before its
  record is durable.
- Several steps may be under way, in one thread: whichever skill is due yields its next action, and time
  goes on for all motions together once each skill has one.  An action is decided by itself and together
  with those under way.
- However a step ends, by itself, denied, stopped, late, cancelled, or because something here is broken,
  the same clean-up runs once: what it moves is brought to rest unless the skill finished, the generator
  is closed, the plant hears that the skill ended, what it held is released, the end is recorded.
- A violation at a control tick is a protective stop of everything that moves, and ends every step that
  does.  A denial, a time-out or a revocation ends its own step alone.
- What a skill, a planner or a caller gets wrong is a `StepResult`.  What is wrong with AEROS itself
  (`InternalError` from the gate, a plant that raises) or with the record (`AuditError`) is raised,
  after the clean-up of every step.
- A configuration that changed is followed once nothing moves that was begun under the one before.

An isolated skill is interrupted at any time; one that runs in this process, not while its own code runs.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from math import inf
from typing import Any, Final, Self

from aeros.runtime.audit import AuditError, AuditLog, DecisionCounts
from aeros.runtime.canonical import restored
from aeros.runtime.configuration import Configuration
from aeros.runtime.deciding import Deciding
from aeros.runtime.gate_port import Gate
from aeros.runtime.governor import Command, Fixed, Governor
from aeros.runtime.grounds import cause_of_stop
from aeros.runtime.holding import Hold
from aeros.runtime.observation import Sight
from aeros.runtime.passing import may_pass
from aeros.runtime.ports import (
    BEGINNING,
    Completion,
    Ended,
    Head,
    Plant,
    Readings,
    Said,
    StepHandle,
    StepRequest,
    StepResult,
    StepStatus,
)
from aeros.runtime.preparing import RefusedError, prepared, with_outputs
from aeros.runtime.records import caller_details, session_details, spell_reasons
from aeros.runtime.recounting import Recount, recounted
from aeros.runtime.resources import Resources
from aeros.runtime.skill_code import told
from aeros.runtime.skill_run import Ending, OpenRun
from aeros.runtime.step import Step, UnderWay, capacities_of, needs_of
from aeros.skill import Action
from aeros.spec.cause import Cause
from aeros.spec.cause import told as told_causes
from aeros.spec.certificate import Certificate
from aeros.spec.errors import MisuseError
from aeros.spec.model import Ecm, Site

_LOOK_EVERY: Final = 0.01  # s, while paused
_HALTED: Final = Ending(StepStatus.HALTED, "the operator stops it")

MOST_ACTIONS: Final = 10_000
"""Actions of one step beyond which a skill floods; a zero-time action could otherwise repeat for ever."""


class Executor:
    """The runtime as the agent sees it (`ports.Runtime`), for one configuration and one plant.

    It owns neither plant nor log: whoever made them closes them.  As a context manager it leaves no step
    under way.
    governor: says which configuration is in force; without one, `configuration` is so for good.
    resumed: go on with the session that the log holds, which ended without a word: what it had counted of
        quotas counts, and what it had seen of histories, with a gap since.  Raises `AuditError` where
        another site governed it.
    """

    def __init__(
        self,
        configuration: Configuration,
        gate: Gate,
        plant: Plant,
        audit: AuditLog,
        open_run: OpenRun,
        governor: Governor | None = None,
        *,
        resumed: bool = False,
    ) -> None:
        self._governor = Fixed(configuration) if governor is None else governor
        # Of no generation yet: what was loaded before may have changed since, so the first look follows.
        self._generation: int | None = None
        self._configuration = configuration
        self._plant = plant
        self._audit = audit
        self._open_run = open_run
        self._deciding = Deciding(configuration, gate, plant, audit)
        self._resources = Resources(capacities_of(configuration.site))
        self._steps: dict[StepHandle, Step] = {}
        # Of these steps, what must be measured as long as they run.
        self._held_to: dict[StepHandle, Hold] = {}
        self._started = 0
        self._results: dict[StepHandle, StepResult] = {}
        # Held while anything moves: until then no change of the configuration is complete.
        self._acting: AbstractContextManager[bool] | None = None
        self._is_paused = False
        self._breaking_off = _BreakingOff(self._break_off)
        if resumed and audit.head.records:
            self._deciding.take_over(_earlier(audit, configuration.site))
            audit.append("session-resumed", session_details(configuration))
        else:
            audit.append("session-opened", session_details(configuration))

    @property
    def site(self) -> Site:
        """The site whose policy governs."""
        return self._configuration.site

    @property
    def is_stopped(self) -> bool:
        """See `ports.Runtime`."""
        return self._governor.command is Command.STOP

    def active_modules(self) -> Mapping[str, Ecm]:
        """The certified, active modules by name."""
        self._follow()
        return self._configuration.modules

    def certificate(self, module: str) -> Certificate | None:
        """What is proved of an active module."""
        return self._configuration.certificates.get(module)

    def now(self) -> float:
        """Seconds on the plant's clock."""
        return self._plant.now()

    def observe(self) -> Readings:
        """Everything that is measured now."""
        return self._plant.observe()

    def note(self, event: str, details: Mapping[str, Any]) -> None:
        """Put an event of the agent's into the record, as a note, so it cannot pass for one of ours."""
        self._audit.append("note", {"event": event, "details": dict(details)})

    def head(self) -> Head:
        """See `ports.Runtime`."""
        return self._audit.head

    def said_since(self, head: Head) -> Sequence[Said] | None:
        """See `ports.Runtime`."""
        records = self._audit.since(head)
        if records is None:
            return None
        own = (one for one in records if one["event"] != "note")
        return [Said(one["sequence"], one["event"], restored(one["details"])) for one in own]

    def submit(self, request: StepRequest) -> StepResult:
        """Run one skill to its end; never raises for a bad request."""
        started = self.start(request)
        if isinstance(started, StepResult):
            return started
        while started not in self._results:
            self._go_on(inf)
        return self._results.pop(started)

    def start(self, request: StepRequest) -> StepHandle | StepResult:
        """See `ports.Runtime`; never raises for a bad request."""
        with self._breaking_off:
            return self._start(request)

    def _start(self, request: StepRequest) -> StepHandle | StepResult:
        self._follow()
        asked = {"module": request.module, "skill": request.skill, "inputs": request.inputs}
        try:
            step = prepared(request, self._configuration, self._resources, self._open_run)
        except RefusedError as refusal:
            self._audit.append("step-refused", {"reason": str(refusal), **asked})
            return StepResult(StepStatus.REFUSED, str(refusal))
        self._started += 1
        handle = StepHandle(self._started)
        self._steps[handle] = step
        if step.hold is not None:
            self._held_to[handle] = step.hold
        self._resources.ask(handle, needs_of(step.skill))
        return handle

    def wait(self, until: float = inf) -> Ended | None:
        """See `ports.Runtime`."""
        if not self._steps and not self._results:
            if until == inf:
                raise MisuseError("nothing was started that could end")
            with self._breaking_off:
                self._plant.advance(self._watch, until)
            return None
        while not self._results:
            if self.now() >= until or self._go_on(until):
                return None
        return self._ended()

    def turn(self, until: float) -> Ended | None:
        """Let one thing happen, or time go on until `until` at most; a step that has ended then, if any has.

        For whoever has to look at something else too; returns soon, also while the operator pauses.
        """
        if not self._results:
            self._go_on(until)
        return self._ended() if self._results else None

    def cancel(self, step: StepHandle, reason: str) -> None:
        """See `ports.Runtime`."""
        if step in self._steps:
            with self._breaking_off:
                self._halt(step, Ending(StepStatus.CANCELLED, reason))

    def counts(self, step: StepHandle) -> DecisionCounts | None:
        """What was decided of a step so far; None once it has ended."""
        under_way = self._steps.get(step)
        return None if under_way is None else under_way.counts

    def close(self) -> None:
        """Clean up after every step that has not ended; safe to call twice."""
        if self._steps:
            self._break_off(MisuseError("whoever had asked for it is gone"))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _ended(self) -> Ended:
        """The first of those that have ended and were not told yet."""
        handle = next(iter(self._results))
        return Ended(handle, self._results.pop(handle))

    # The loop.

    def _begin(self) -> None:
        """Begin the steps whose turn it is; their time-outs run from now on."""
        if not self._resources.is_awaited:
            return
        for who in self._resources.grant():
            step = self._steps[StepHandle(who)]
            step.deadline = self.now() + float(step.skill.timeout)
            began = {"time": self.now(), "deadline": step.deadline}
            self._audit.append("step-began", {**began, **caller_details(step.caller)})
            step.has_begun = True
            self._plant.skill_began(step.name)
        for handle, step in list(self._steps.items()):
            lacking = None if step.has_begun else self._resources.lacking(needs_of(step.skill))
            if lacking is not None:
                self._halt(handle, Ending(StepStatus.STOPPED, f"this site has no `{lacking}` any more"))

    def _go_on(self, until: float) -> bool:
        """Let a skill that is due act; where none is, let time go on.  Whether `until` comes first."""
        with self._breaking_off:
            self._begin()
            due = next((handle for handle, step in self._steps.items() if step.is_due), None)
            if due is not None and not self._is_held_back():
                ending = self._act(self._steps[due])
                if ending is not None:
                    self._halt(due, ending)
            elif self._is_moving():
                return self._advance(until)
            elif due is not None:
                time.sleep(_LOOK_EVERY)
        return False

    def _is_held_back(self) -> bool:
        """Whether no action may begin: the operator pauses, or an older configuration's still move."""
        paused = self._governor.command is Command.PAUSE
        if paused is not self._is_paused:
            self._is_paused = paused
            self._audit.append("paused" if paused else "resumed", {"time": self.now()})
        return paused or self._follow() != self._governor.generation

    def _act(self, step: Step) -> Ending | None:
        """Let the skill ask for an action and begin it; or how the step ends."""
        unheld = self._unheld(step)
        if unheld is not None:
            return unheld
        if step.asked is None:
            ending = self._resume(step)
            if ending is not None or self._is_held_back():
                return ending
        if self._governor.command is Command.STOP:
            return _HALTED
        if not self._is_active(step.ecm):
            return Ending(StepStatus.STOPPED, f"revoked: `{step.ecm.id}` is not active as it was")
        if self._is_moving():
            in_force = self._follow() == self._governor.generation
        else:
            acting = self._governor.acting(self._follow())
            in_force, self._acting = acting.__enter__(), acting
        try:
            asked = step.asked
            if not in_force or asked is None:
                return None
            step.asked = None
            # Once more: meanwhile the skill has computed.
            return self._unheld(step) or self._act_now(step, asked)
        finally:
            self._let_go()

    def _resume(self, step: Step) -> Ending | None:
        """Let the skill ask for its next action; or how the step ends."""
        if step.actions == MOST_ACTIONS:
            return Ending(StepStatus.RAISED, f"the skill floods: more than {MOST_ACTIONS} actions")
        step.actions += 1
        if step.sight is None or step.sight.site is not self.site:
            step.sight = Sight(step.ecm, self.site)
        observed = step.sight.observation(self._plant.observe(), self.now())
        asked = step.run.resume(observed, step.deadline - self.now())
        if isinstance(asked, Ending) and asked.status is StepStatus.RAISED:
            return asked
        if self.now() > step.deadline:
            return Ending(StepStatus.TIMED_OUT, "the skill's time-out has passed")
        if isinstance(asked, Ending):
            return with_outputs(step.skill, asked)
        step.asked = asked
        return None

    def _unheld(self, step: Step) -> Ending | None:
        """How the step ends if its hold-condition is not measured now."""
        if step.hold is None:
            return None
        # In this order: a reading is never younger than the time it is judged at.
        readings = self._plant.observe()
        return _halted_for(step.hold.broken(readings, self.now()))

    def _act_now(self, step: Step, asked: Action) -> Ending | None:
        """Have it decided and recorded, and begin it; None when it has begun."""
        decided = self._deciding.decide(step.caller, asked, self._moving())
        step.counts = step.counts.plus(decided.decision.verdict)
        begun, plan = decided.begun, decided.plan
        if begun is None:
            step.may_pass = may_pass(decided.decision.reasons, asked.kind, self.site)
            why = spell_reasons(decided.decision.reasons)
            return Ending(StepStatus.DENIED, why, causes=decided.causes)
        if decided.ends_others:
            self._stop_all(f"stopped for `{step.name}`, which asks for a protective stop")
        self._deciding.executed(begun)
        # A completion: the plant cannot do it, and nothing moves.
        motion = plan if isinstance(plan, Completion) else self._plant.begin(begun.action, plan)
        if isinstance(motion, Completion):
            return _stopped_by(motion)
        step.under_way = UnderWay(motion, begun, plan)
        self._deciding.monitors.watch(begun)
        return None

    def _moving(self) -> list[UnderWay]:
        """What is under way, what comes to rest included."""
        return [step.under_way for step in self._steps.values() if step.under_way is not None]

    def _is_moving(self) -> bool:
        """Whether anything is under way."""
        for step in self._steps.values():  # noqa: SIM110  `any` takes three times as long, at every action
            if step.under_way is not None:
                return True
        return False

    def _advance(self, until: float) -> bool:
        """Let time go on until a motion ends or a time-out has passed.  Whether `until` comes first."""
        moving = {handle: step for handle, step in self._steps.items() if step.under_way is not None}
        latest = min([until, *(step.deadline for step in moving.values() if step.ending is None)])
        ended = self._plant.advance(self._watch, latest)
        landed = {
            handle: ended[one.motion]
            for handle, step in moving.items()
            if (one := step.under_way) and one.motion in ended
        }
        self._land(landed)
        for handle, completion in landed.items():
            step = moving[handle]
            ending = step.ending or (None if completion.completed else self._broken_off(completion))
            if ending is not None:
                self._halt(handle, ending)
        if ended:
            return False
        for handle, step in moving.items():
            if step.deadline <= latest:
                self._halt(
                    handle, Ending(StepStatus.TIMED_OUT, "the skill's time-out passed during a motion")
                )
        return latest == until

    def _broken_off(self, completion: Completion) -> Ending:
        """How a step ends whose motion did not reach its end; of a violated rule, with what was measured."""
        if self._governor.command is Command.STOP:
            return _HALTED
        ending, violation = _stopped_by(completion), self._deciding.monitors.violation
        by, _, rule = ending.reason.partition("monitor:")
        if by or not rule:
            return ending
        ending = ending._replace(causes=(cause_of_stop(self.site, rule, violation),))
        if violation is None or violation.rule != rule:
            return ending
        return ending._replace(reason=f"{ending.reason}: {violation}")

    def _watch(self, now: float, measured: Mapping[str, Any]) -> str | None:
        """The monitor of everything under way; what was revoked, or does not hold any more, is halted."""
        if self._governor.command is Command.STOP:
            return _HALTED.reason
        if self._governor.generation != self._generation:
            for handle, step in self._steps.items():
                objection = self._revoked(step)
                if objection is not None:
                    self._halt(handle, Ending(StepStatus.STOPPED, f"revoked: {objection}"))
        for handle, hold in self._held_to.items():
            step = self._steps[handle]
            if step.under_way is not None and step.ending is None:
                ending = _halted_for(hold.broken_at_tick(measured, now, self._plant.observe))
                if ending is not None:
                    self._halt(handle, ending)
        return self._deciding.monitors(now, measured)

    def _revoked(self, step: Step) -> str | None:
        """Why what the step has under way may not go on, or None."""
        if step.under_way is None:
            return None
        caller, kind = step.caller, step.under_way.begun.action.kind
        return self._governor.objection(caller.module, caller.skill, kind)

    # Endings.

    def _halt(self, handle: StepHandle, ending: Ending) -> None:
        """End a step: now if it moves nothing, else once that has come to rest."""
        step = self._steps[handle]
        if step.under_way is None:
            step.ending = ending
            self._finish(handle)
        elif step.ending is None:
            step.ending = ending
            step.under_way = step.under_way._replace(is_halting=True)
            self._plant.halt(step.under_way.motion)

    def _land(self, handles: Iterable[StepHandle]) -> None:
        """What these steps had under way is not so any more."""
        for handle in handles:
            step = self._steps[handle]
            if step.under_way is not None:
                self._deciding.monitors.forget(step.under_way.begun)
                step.under_way = None
        self._let_go()

    def _let_go(self) -> None:
        """Changes of the configuration may be complete once nothing moves."""
        if self._acting is not None and not self._is_moving():
            acting, self._acting = self._acting, None
            acting.__exit__(None, None, None)

    def _stop_all(self, why: str) -> None:
        """A protective stop, which ends every step that moves something."""
        moving = [handle for handle, step in self._steps.items() if step.under_way is not None]
        if not moving:
            return
        self._plant.stop()
        self._land(moving)
        for handle in moving:
            self._halt(handle, self._steps[handle].ending or Ending(StepStatus.STOPPED, why))

    def _finish(self, handle: StepHandle) -> None:
        """The one clean-up of a step, and its result."""
        step = self._steps.pop(handle)
        self._held_to.pop(handle, None)
        try:
            with ExitStack() as leaving:
                # Run from the last to the first, each even if another raises: what moves is stopped first.
                leaving.callback(self._leave, handle, step)
                if step.has_begun and not step.finished and not self._is_moving():
                    leaving.callback(self._plant.stop)
        except BaseException as failure:
            self._record_broken(step, failure)
            raise
        status, said, outputs, causes = step.ending or Ending(StepStatus.STOPPED, "")
        # A skill's own words may hold what no file, database or terminal takes.
        reason = said.encode("utf-8", "backslashreplace").decode()
        outcome = {"time": self.now(), "status": status.value, "reason": reason}
        event = "step-ended" if step.has_begun else "step-refused"
        gave = {} if outputs is None else {"outputs": dict(outputs)}
        why = {"causes": told_causes(causes)} if causes else {}
        self._audit.append(event, {**outcome, **why, **caller_details(step.caller), **gave})
        counts = step.counts
        self._results[handle] = StepResult(
            status,
            reason,
            counts.allowed,
            counts.attenuated,
            counts.denied,
            dict(outputs or {}),
            step.may_pass and status is StepStatus.DENIED,
            causes,
        )

    def _leave(self, handle: StepHandle, step: Step) -> None:
        """Close the skill, tell the plant, release what the step holds: each even if another raises."""
        with ExitStack() as leaving:
            leaving.callback(self._resources.release, handle)
            if step.has_begun:
                leaving.callback(lambda: self._plant.skill_ended(step.name, finished=step.finished))
            leaving.callback(step.close)

    def _break_off(self, failure: BaseException) -> None:
        """The one clean-up of every step that has not ended."""
        steps = dict(self._steps)
        with ExitStack() as leaving:
            for handle, step in reversed(steps.items()):
                leaving.callback(self._record_broken, step, failure)
                leaving.callback(self._leave, handle, step)
            leaving.callback(self._held_to.clear)
            leaving.callback(self._steps.clear)
            leaving.callback(self._land, steps)
            if any(step.has_begun for step in steps.values()):
                leaving.callback(self._plant.stop)

    def _record_broken(self, step: Step, failure: BaseException) -> None:
        """Say that the step broke off; a record that cannot be written is what is being raised already."""
        try:
            self._audit.append("step-broken", {"reason": told(failure), **caller_details(step.caller)})
        except AuditError as unwritten:
            failure.add_note(f"the end of the step is not in the record: {unwritten}")

    # Whoever governs.

    def _follow(self) -> int:
        """Take over the configuration that is in force, unless something moves; the generation followed."""
        followed = self._generation
        if followed is not None and (followed == self._governor.generation or self._is_moving()):
            return followed
        generation, configuration = self._governor.configuration()
        self._generation = generation
        if configuration.digest == self._configuration.digest:
            return generation
        self._deciding.follow(configuration)
        self._resources.under(capacities_of(configuration.site))
        self._configuration = configuration
        self._audit.append("configuration-changed", session_details(configuration))
        return generation

    def _is_active(self, ecm: Ecm) -> bool:
        """Whether the same module, of the same code, is active now."""
        now = self._configuration.modules.get(ecm.id)
        if now is ecm:
            return True
        was = (ecm.manifest_digest, ecm.code_digest)
        return now is not None and (now.manifest_digest, now.code_digest) == was


def _earlier(audit: AuditLog, site: Site) -> Recount:
    """What the sessions in the log add up to, if it was this site that governed them."""
    records = audit.since(BEGINNING) or []
    opening = ("session-opened", "session-resumed", "configuration-changed")
    governed = [one["details"]["site"]["digest"] for one in records if one["event"] in opening]
    if any(digest != site.digest for digest in governed):
        raise AuditError(f"`{audit.path}` cannot be gone on with: another site governed it")
    return recounted(records, site)


class _BreakingOff:
    """Cleans up after every step where the block raises."""

    def __init__(self, break_off: Callable[[BaseException], None]) -> None:
        self._break_off = break_off

    def __enter__(self) -> None:
        """Nothing is to be cleaned up yet."""

    def __exit__(self, _: object, failure: BaseException | None, __: object) -> None:
        """What was raised goes on, after the clean-up."""
        if failure is not None:
            self._break_off(failure)


def _halted_for(cause: Cause | None) -> Ending | None:
    """How a step ends whose hold-condition is not measured."""
    return None if cause is None else Ending(StepStatus.UNHELD, str(cause), causes=(cause,))


def _stopped_by(completion: Completion) -> Ending:
    return Ending(StepStatus.STOPPED, completion.reason or "the plant gave no reason")
