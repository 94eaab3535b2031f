"""The action that begins is the action that was decided, with its motion, after its record."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import fields
from types import SimpleNamespace
from typing import Any, Final

from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.gate.decision import Decision, DecisionKind
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.ports import MotionCompletion
from aeros.skill import Action
from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, Theorem, TheoremObligation
from proofs.lib.loops import loops_of

SCHEDULER: Final = "aeros.runtime.execution.scheduler"
PIPELINE: Final = "aeros.runtime.execution.decision_pipeline"
STEP: Final = "aeros.runtime.execution.step"

_ASKED: Final = Action("asked", {})
_REDUCED: Final = Action("reduced", {})
_PLAN: Final = SimpleNamespace(body="body")  # the motion that was decided, where the action begins
_TERMS: Final = {id(_ASKED): "asked", id(_REDUCED): "reduced"}
_OTHER: Final = SimpleNamespace(active_action=ActiveAction(_REDUCED, {}, 0.0, 3), plan=None, is_halting=False)
_NUMBER: Final = 7
_FAILED: Final = MotionCompletion(completed=False, reason="")

# From the request to the record: `DecisionPipeline.decide`.

_PIPELINE_DECLARATIONS: Final = (
    "(declare-datatypes ((Act 0)) (((asked) (reduced) (other-act))))",
    "(declare-datatypes ((Outcome 0)) (((denied) (forwarded (act Act)) (wrong))))",
    *(
        f"(declare-const {name} Bool)"
        for name in ("clock-fails", "allows", "attenuates", "joint-denies", "others", "stops", "covered")
    ),
    "(declare-const motion-denies Bool)",
    "(define-fun forwards () Bool (and (not clock-fails) (or allows attenuates)"
    " (not (and others (not stops) joint-denies)) (not (and covered motion-denies))))",
)


def _deny() -> Decision:
    return Decision(DecisionKind.DENY, None, ())


class _Pipeline:
    """A pipeline with stand-ins that notice if they are asked about anything else, or in another order."""

    def __init__(self, code: ModuleSource, ask: DecideBranch) -> None:
        self.ask = ask
        self.faults: list[str] = []
        self.readings = {"s": object()}
        self.now = object()
        self.latest: Decision | None = None  # the decision of the last layer that was asked
        self.recorded: list[Any] = []
        self.observed = False
        self.plan: Any = None  # the motion that the plant planned last; it never plans the same twice
        self.decided_plan: Any = None
        self.module = code.module(
            PIPELINE,
            DecisionRecord=lambda *parts: parts,
            denial_causes=lambda *_: (),
            concurrent_motions=lambda *_: ("companion",),
            known_obstacles=lambda _: (),
            clock_denial=lambda _: self.latest,
        )
        pipeline = self.pipeline = object.__new__(self.module.DecisionPipeline)
        kinds = {name: SimpleNamespace(protective=ask("stops")) for name in ("asked", "reduced")}
        pipeline._configuration = SimpleNamespace(site=SimpleNamespace(kinds=kinds), digest="digest")
        pipeline._plant = SimpleNamespace(observe=self._observe, now=self._clock, plan=self._planned)
        pipeline._histories = SimpleNamespace(names=())
        pipeline._usage = SimpleNamespace(usage_at=self._usage)
        pipeline._gate = SimpleNamespace(decide=self._decide, decide_jointly=self._decide_jointly)
        pipeline._motions = SimpleNamespace(covers_kind=lambda _: ask("covered"), decide=self._decide_motion)
        pipeline._encoder = SimpleNamespace(encode=lambda record: record, encode_motion=lambda *_: {})
        pipeline._audit = SimpleNamespace(append=self._append)
        pipeline._record_robot_body = lambda _: ""

    def expect(self, holds: bool, fault: str) -> None:
        if not holds:
            self.faults.append(fault)

    def _observe(self) -> Any:
        self.observed = True
        return self.readings

    def _clock(self) -> Any:
        self.expect(self.observed, "the clock is read before the state")
        return self.now

    def _usage(self, now: Any) -> Any:
        self.expect(now is self.now, "quotas are counted at another time")
        if self.ask("clock-fails"):
            self.latest = _deny()
            raise self.module.ClockError("")
        return "usage"

    def _is_measured(self, readings: Any) -> bool:
        return bool(readings == self.readings)

    def _decide(self, caller: Any, readings: Any, action: Any, now: Any, usage: Any) -> Decision:
        self.expect(caller == "caller" and action is _ASKED, "another request is decided")
        self.expect(self._is_measured(readings), "it is decided on other readings")
        self.expect(now is self.now and usage == "usage", "it is decided at another time")
        if self.ask("allows"):
            self.latest = Decision(DecisionKind.ALLOW, _ASKED, ())
        elif self.ask("attenuates"):
            self.latest = Decision(DecisionKind.ATTENUATE, _REDUCED, ())
        else:
            self.latest = _deny()
        return self.latest

    def _decide_jointly(self, decision: Any, readings: Any, now: Any, active: Any) -> Decision:
        self.expect(decision is self.latest, "the joint rules get another decision")
        self.expect(self._is_measured(readings) and now is self.now, "they get other readings")
        self.expect(active == [_OTHER.active_action], "they get other actions under way")
        if decision.action is not None and self.ask("joint-denies"):
            self.latest = _deny()
        return self.latest or _deny()

    def _planned(self, action: Any) -> Any:
        self.expect(self.latest is not None and action is self.latest.action, "another action is planned")
        self.plan = SimpleNamespace(body="body")
        return self.plan

    def _decide_motion(
        self, decision: Any, plan: Any, readings: Any, companions: Any, obstacles: Any
    ) -> Decision:
        self.expect(decision is self.latest and plan is self.plan, "another motion is decided")
        self.decided_plan = plan
        self.expect(self._is_measured(readings), "the motion is decided on other readings")
        expected = ("companion",) if self.ask("others") and not self._stops(decision) else ()
        self.expect(tuple(companions) == expected, "the motions under way are left out")
        if self.ask("motion-denies"):
            self.latest = _deny()
        return self.latest or _deny()

    def _stops(self, decision: Any) -> bool:
        return decision.action is not None and self.ask("stops")

    def _append(self, event: str, record: Any) -> int:
        self.expect(event == "decision", "something else is recorded")
        self.recorded.append(record)
        return _NUMBER

    def outcome(self) -> str:
        """Decide a request, and say how it was decided: a term of sort Outcome."""
        active_motions = [_OTHER] if self.ask("others") else []
        decided = self.pipeline.decide("caller", _ASKED, active_motions)
        record = self.recorded[0] if len(self.recorded) == 1 else (None,) * 6
        self.expect(record[0] is self.latest and record[5] is _ASKED, "something else is recorded")
        self.expect(record[2] is self.now and self._is_measured(record[3]), "another moment is recorded")
        self.expect(decided.decision is self.latest, "another decision is returned")
        result = "denied"
        if decided.active_action is not None:
            action, readings, now, number = astuple_of(decided.active_action)
            self.expect(self._is_measured(readings) and now is self.now, "it is watched from another moment")
            self.expect(number == _NUMBER, "it is known by the number of another record")
            is_planned = self.decided_plan is not None
            self.expect(is_planned is self.ask("covered"), "a motion is not decided")
            self.expect(decided.plan is self.decided_plan, "another plan is returned")
            self.expect(decided.is_protective_stop is self.ask("stops"), "a stop is not known as one")
            result = f"(forwarded {_TERMS.get(id(action), 'other-act')})"
        return "wrong" if self.faults else result


def astuple_of(active: ActiveAction) -> tuple[Any, ...]:
    """The fields of an active action, none of them copied."""
    return tuple(getattr(active, field.name) for field in fields(active))


def _decided(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "`DecisionPipeline.decide` forwards exactly the action that the gate forwarded for this request on\n"
        "the readings of now, unless the joint rules or the whole motion deny it; what it returns is what\n"
        "it has recorded.",
        _PIPELINE_DECLARATIONS,
        "(= found (ite forwards (forwarded (ite allows asked reduced)) denied))",
        tables=(
            SymbolicFunction(
                "found", "Outcome", execute_symbolically(lambda ask: _Pipeline(code, ask).outcome())
            ),
        ),
    )


# From the record to the motor: `StepControl._decide_and_begin`.

_BEGIN_DECLARATIONS: Final = (
    "(declare-datatypes ((Act 0)) (((asked) (reduced) (other-act))))",
    "(declare-datatypes ((Started 0)) (((none) (started (act Act)) (wrong))))",
    *(f"(declare-const {name} Bool)" for name in ("forwarded", "allows", "plant-can", "stops", "begins")),
    "(declare-const way-round Bool)",
)


def _beginning(code: ModuleSource) -> TheoremObligation:
    scheduler = code.module(
        SCHEDULER, is_transient_denial=lambda *_: False, format_reasons=lambda *_: "denied"
    )

    def run(ask: DecideBranch) -> str:
        events: list[tuple[Any, ...]] = []
        active = ActiveAction(_ASKED if ask("allows") else _REDUCED, {}, 0.0, _NUMBER)
        plan = _PLAN if ask("plant-can") else _FAILED
        forwarded = ask("forwarded")
        decided = SimpleNamespace(
            decision=SimpleNamespace(kind=DecisionKind.ALLOW if forwarded else DecisionKind.DENY, reasons=()),
            active_action=active if forwarded else None,
            plan=plan,
            causes=(),
            is_protective_stop=forwarded and ask("stops"),
        )

        def decide(caller: Any, action: Any, others: Any) -> Any:
            events.append(("decide", caller, action, others))
            return decided

        def begin(action: Any, given: Any) -> Any:
            events.append(("begin", action, given))
            return "motion" if ask("begins") else _FAILED

        pipeline = SimpleNamespace(
            decide=decide,
            find_detour=lambda *_: [_REDUCED, _ASKED] if ask("way-round") else None,
            count_execution=lambda one: events.append(("count", one)),
            monitors=SimpleNamespace(add=lambda one, given: events.append(("watch", one, given))),
        )
        context = SimpleNamespace(
            table=SimpleNamespace(active_motions=lambda: ()),
            plant=SimpleNamespace(begin=begin),
            audit=None,
            pipeline=pipeline,
            governor=SimpleNamespace(command=OperatorCommand.RUN),
            followed=SimpleNamespace(configuration=SimpleNamespace(site=None)),
        )
        clean_up = SimpleNamespace(stop_all=lambda _: events.append(("stop",)))
        step = SimpleNamespace(
            caller="caller",
            name="m.k",
            pending_legs=deque(),
            decision_counts=Counter(),
            is_transient=False,
            denials=[],
            is_denial_open=False,
            is_held_back=False,
            active_motion=None,
        )
        ending = scheduler.StepControl(context, clean_up)._decide_and_begin(step, _ASKED)
        stopping = [("stop",)] if decided.is_protective_stop else []
        expected: list[tuple[Any, ...]] = [("decide", "caller", _ASKED, ())]
        if forwarded:
            expected += [*stopping, ("count", active)]
            if ask("plant-can"):
                expected.append(("begin", active.action, plan))
                if ask("begins"):
                    expected.append(("watch", active, plan))
        started = [one for one in events if one[0] == "begin"]
        if not _are_same(events, expected):
            # Name the action where it is another one, so that a counterexample shows it.
            others = [one[1] for one in started if one[1] is not active.action]
            return f"(started {_TERMS.get(id(others[0]), 'other-act')})" if others else "wrong"
        moves = forwarded and ask("plant-can") and ask("begins")
        if moves and (ending is not None or step.active_motion != ("motion", active, plan, False)):
            return "wrong"
        if not moves and step.active_motion is not None:
            return "wrong"
        return f"(started {_TERMS[id(active.action)]})" if started else "none"

    return TheoremObligation(
        "`StepControl._decide_and_begin` lets the plant begin exactly the action that was decided for the\n"
        "request, with the motion that was decided, once, counted against its quotas before; it is watched\n"
        "from then on. Where it was denied, or the plant cannot do it, nothing begins.",
        _BEGIN_DECLARATIONS,
        "(= found (ite (and forwarded plant-can) (started (ite allows asked reduced)) none))",
        tables=(SymbolicFunction("found", "Started", execute_symbolically(run)),),
    )


def _are_same(events: Sequence[tuple[Any, ...]], expected: Sequence[tuple[Any, ...]]) -> bool:
    """Check that they are the same objects in the same order."""
    return len(events) == len(expected) and all(
        len(one) == len(other) and all(a is b or a == b == () for a, b in zip(one, other, strict=True))
        for one, other in zip(events, expected, strict=True)
    )


# From the skill to the request: `StepControl.run_skill`.

_TURN_DECLARATIONS: Final = (
    "(declare-datatypes ((Turn 0)) (((nothing-decided) (decided) (wrong))))",
    *(
        f"(declare-const {name} Bool)"
        for name in ("waits", "leg", "held-before", "held-after", "active-before", "active-after")
    ),
    *(f"(declare-const {name} Bool)" for name in ("answers", "paused", "stopped", "in-force")),
)


def _turn(code: ModuleSource) -> TheoremObligation:
    scheduler = code.module(SCHEDULER, _revoked=lambda _: "revoked")

    def run(ask: DecideBranch) -> str:
        decided: list[Any] = []
        checks = iter(("held-before", "held-after"))
        activity = iter(("active-before", "active-after"))
        control = object.__new__(scheduler.StepControl)
        waiting, leg, answered = (Action(name, {}) for name in ("waiting", "leg", "answered"))
        step = SimpleNamespace(
            ecm="ecm",
            requested_action=waiting if ask("waits") else None,
            pending_legs=deque((leg,) if ask("leg") else ()),
        )
        legs = len(step.pending_legs)
        wanted = waiting if ask("waits") else leg if ask("leg") else answered

        def resume(_: Any) -> Any:
            if not ask("answers"):
                return "ended"
            step.requested_action = answered
            return None

        control._check_hold_condition = lambda _: None if ask(next(checks)) else "lost"
        control._followed = SimpleNamespace(
            is_active=lambda _: ask(next(activity)), hold=lambda: ask("in-force"), release=lambda: None
        )
        control._governor = SimpleNamespace(
            command=OperatorCommand.STOP if ask("stopped") else OperatorCommand.RUN
        )
        control._resume_skill = resume
        control.actions_are_paused = lambda: ask("paused")
        control._decide_and_begin = lambda one, action: decided.append((one, action))
        control.run_skill(step)
        if not decided:
            return "nothing-decided"
        ((one, action),) = decided
        used = legs - len(step.pending_legs) == (1 if wanted is leg else 0)
        is_same = one is step and action is wanted and step.requested_action is None and used
        return "decided" if is_same else "wrong"

    asked = "(or waits leg answers)"
    pauses = "(and paused (not waits))"
    return TheoremObligation(
        "`StepControl.run_skill` has exactly the action decided that the step waits with, or that leads\n"
        "round an obstacle, or that its skill asks for now; and only if its condition is measured to hold\n"
        "before and after, its module is active before and after, nobody stops or pauses, and the\n"
        "configuration is in force.",
        _TURN_DECLARATIONS,
        f"(= found (ite (and held-before active-before {asked} (not {pauses}) (not stopped) active-after"
        " in-force held-after) decided nothing-decided))",
        tables=(SymbolicFunction("found", "Turn", execute_symbolically(run)),),
    )


THEOREM = Theorem(
    "the action that begins is the one that was decided, with the motion that was decided, after its record",
    {
        "turn": _turn,
        "decided": _decided,
        "beginning": _beginning,
        "loops": loops_of(SCHEDULER, PIPELINE, STEP),
    },
    (
        Mutant(
            "decides-although-the-condition-was-lost-meanwhile",
            "turn",
            SCHEDULER,
            "return self._check_hold_condition(step) or self._decide_and_begin(step, action)",
            "return self._decide_and_begin(step, action)",
        ),
        Mutant(
            "decides-the-motion-of-what-was-asked-for",
            "decided",
            PIPELINE,
            "plan, obstacles = self._plant.plan(action), known_obstacles(self._plant)",
            "plan, obstacles = self._plant.plan(None), known_obstacles(self._plant)",
        ),
        Mutant(
            "returns-a-motion-that-is-planned-again",
            "decided",
            PIPELINE,
            "return PipelineDecision(decision, active_action, plan, is_protective_stop, causes)",
            "return PipelineDecision(decision, active_action, plan and self._plant.plan(decision.action),"
            " is_protective_stop, causes)",
        ),
        Mutant(
            "returns-what-the-gate-decided-alone",
            "decided",
            PIPELINE,
            "decision, plan, motion = self._decide_motion(gated, readings, companions)",
            "decision, (_, plan, motion) = gated, self._decide_motion(gated, readings, companions)",
        ),
        Mutant(
            "forgets-motions-under-way",
            "decided",
            PIPELINE,
            "            companions = concurrent_motions(",
            "            concurrent_motions(",
        ),
        Mutant(
            "begins-what-was-asked-for",
            "beginning",
            SCHEDULER,
            "self._plant.begin(active_action.action, plan)",
            "self._plant.begin(action, plan)",
        ),
        Mutant(
            "lets-the-plant-plan-again",
            "beginning",
            SCHEDULER,
            "self._plant.begin(active_action.action, plan)",
            "self._plant.begin(active_action.action, None)",
        ),
        Mutant(
            "does-not-watch-what-begins",
            "beginning",
            SCHEDULER,
            "        self._pipeline.monitors.add(active_action, plan)\n",
            "",
        ),
        Mutant(
            "looks-for-the-first-motion-only",
            "loops",
            STEP,
            "for step in self.steps.values() if step.active_motion is not None]",
            "for step in list(self.steps.values())[:2] if step.active_motion is not None]",
        ),
    ),
)
