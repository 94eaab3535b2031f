"""Nothing is done twice because of a crash: theorem 13."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import inf
from types import SimpleNamespace
from typing import Any, Final

from aeros.agent.execution.after_failure import FailureRules
from aeros.agent.execution.attempt_journal import OverdueSteps
from aeros.agent.execution.cancellable_wait import CancellableWait
from aeros.agent.execution.provider_choice import ProviderChoice
from aeros.agent.planning.task_graph import PlanStep
from aeros.runtime.ports import AuditEvent, EndedStep, LogHead, StepRequest, StepResult, StepStatus
from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.smtlib import smt_and, smt_or
from aeros.spec.theorems.theorem import Theorem, TheoremObligation
from proofs.lib.loops import loops_of
from proofs.lib.process_model import (
    PerformStep,
    ProcessGraph,
    StepPath,
    declare_state,
    execute_process,
    primed,
    transition,
)

ATTEMPT: Final = "aeros.agent.execution.step_attempt"
UNCERTAIN_STEPS: Final = "aeros.agent.execution.uncertain_steps"
CHECKPOINT: Final = "aeros.agent.recovery.checkpoint"
PLAN_EXECUTOR: Final = "aeros.agent.execution.plan_executor"
PROGRESS: Final = "aeros.agent.execution.progress"
TASK_LOOP: Final = "aeros.agent.task_loop"
RECOVERY: Final = "aeros.agent.recovery.recover"

_ATTEMPT_CODES: Final = {"fresh": 0, "begun": 1, "done": 2, "failed": 3}
_EVENT_CODES: Final = {"nothing": 0, "began": 1, "ended": 2}
_STATE: Final[Mapping[str, str]] = {
    "pc": "Int",
    "kept": "Int",
    "kept.plan": "Bool",
    "kept.barred": "Bool",
    "told": "Int",
    "happened": "Bool",
    "left": "Bool",
    "acknowledged": "Bool",
    "repeated": "Bool",
}
"""State that outlives a crash: the newest checkpoint, the record since then, and the facts.

kept: what the checkpoint has of the one place: untried, begun, done or failed.
told: what the record has since the checkpoint reaches back: nothing, a beginning, an end.
happened: the skill has succeeded, once at least.
left: a crash left a try that the record says began, the skill has succeeded, and nobody has found that out.
acknowledged: a checkpoint has the place as done, in the plan that is followed; repeated: it was begun again.
"""

_HEAD: Final = LogHead(10, "hash")
_STEP: Final = PlanStep("m", "k")
_GRAPH: Final[Any] = SimpleNamespace(body=_STEP, parts=(), remark="")


def _session(code: ModuleSource) -> ProcessGraph:
    """An agent that wakes, takes its run up again, follows its plan and plans anew once."""
    progress = code.module(PROGRESS)
    bars = code.module(UNCERTAIN_STEPS)
    checkpoint = code.module(CHECKPOINT, using=(progress,))
    recovery = code.module(RECOVERY, using=(progress, bars))
    attempt = code.module(ATTEMPT, using=(bars,))
    engine = code.module(PLAN_EXECUTOR, using=(progress, attempt))
    pursuit = code.module(TASK_LOOP, using=(progress, checkpoint, recovery, engine, attempt))
    modules = SimpleNamespace(
        progress=progress, bars=bars, checkpoint=checkpoint, attempt=attempt, engine=engine
    )

    def run(do: PerformStep) -> str:
        kept = _newest_checkpoint(do, modules)
        recorded = do("read-record", *_EVENT_CODES)
        world = _world(do("measure", "unknown", "yes", "no"))
        attempts = _stubbed_attempts(do, modules, world)
        one = pursuit.TaskLoop.__new__(pursuit.TaskLoop)
        one._runtime, one._attempts, one._journal = attempts._runtime, attempts, attempts._journal
        one._checkpoints = SimpleNamespace(write=lambda made: do(f"save {_checkpoint_facts(made)}"))
        one._routed, one._agent, one._instruction = _ROUTE, "agent", "instruction"
        one._timeout, one._waited, one._replans = None, 0.0, 0
        one._engine = engine.PlanExecutor(attempts, attempts._journal, lambda: False)
        one._is_goal_reached = lambda: False
        one._plans = SimpleNamespace(last_problems=[], new_plan=lambda _: _GRAPH, kept_plan=lambda plan: plan)
        one._idle = lambda _: None
        one._position = SimpleNamespace(number=0, earlier_reports=())
        one._finished_plans = SimpleNamespace(is_useless=lambda *_: False)
        one.resume(kept, _record(recorded))
        one._run_until_goal()
        return "over"

    return execute_process(run).merge_places(_path_facts)


_ROUTE: Final = SimpleNamespace(task=SimpleNamespace(goal=None, goal_text="goal"))


def _newest_checkpoint(do: PerformStep, modules: Any) -> Any:
    """The newest checkpoint."""
    state = do("read-checkpoint", *_ATTEMPT_CODES)
    plan = _GRAPH if do("read-plan", "yes", "no") == "yes" else None
    key = modules.bars._key("m", "k", {})
    barred = (key,) if do("read-bars", "no", "yes") == "yes" else ()
    made = modules.progress.PlanProgress()
    if state != "fresh":
        before = {"d": False} if do("before", "unknown", "no") == "no" else {}
        made.start_attempt((), modules.progress.UnfinishedAttempt("m", "k", {}, before, _HEAD))
    if state in ("done", "failed"):
        made.finish_attempt((), modules.attempt.AttemptResult(failed=state == "failed", reason=""))
    return modules.checkpoint.TaskCheckpoint(
        agent="agent",
        instruction="instruction",
        task="task",
        goal="goal",
        time=0.0,
        audit_head=_HEAD,
        world={},
        replans=0,
        waited_s=0.0,
        deadline=None,
        denied_steps=(),
        avoided_skills=(),
        uncertain_steps=barred,
        repeated_failures=(),
        last_plan_problems=(),
        planning_states=(),
        steps=(),
        plan=plan,
        attempts=tuple(made.attempts.items()),
        done_paths=(),
        branch_choices=(),
    )


def _checkpoint_facts(made: Any) -> str:
    """State what a checkpoint stores: the place, the plan, and the barred steps."""
    tried = made.progress().attempts.get(())
    state = "fresh"  # also of a try that was withdrawn
    if tried is not None and tried.unfinished is not None:
        state = "begun"
    elif tried is not None and tried.last_result is not None:
        state = "failed" if tried.last_result.failed else "done"
    return f"{state} {'planned' if made.plan else 'planless'} {'barred' if made.uncertain_steps else 'free'}"


def _record(recorded: str) -> list[AuditEvent]:
    details = {"module": "m", "skill": "k", "inputs": {}}
    began = AuditEvent(_HEAD.records, "step-began", details)
    ended = AuditEvent(_HEAD.records + 1, "step-ended", {**details, "status": "finished", "reason": ""})
    return {"nothing": [], "began": [began], "ended": [began, ended]}[recorded]


def _world(measured: str) -> Any:
    """The world, in which the skill's one effect is measured, or the contrary, or nothing."""
    known = {"unknown": {}, "yes": {"d": True}, "no": {"d": False}}[measured]
    return SimpleNamespace(known=known, unknown={}, predicates=known, at_time=lambda _: None)


_OUTCOMES: Final = {
    name: SimpleNamespace(
        id=name, effects={"d": not fails}, ranges=(), effect_count=1, failure=fails, verdict=""
    )
    for name, fails in (("done", False), ("missed", True))
}
_SKILL: Final = SimpleNamespace(
    id="k",
    idempotent=False,
    timeout=60,
    outcomes=_OUTCOMES,
    success_outcomes=(_OUTCOMES["done"],),
    failures_with_more_effects=lambda _: [],  # each outcome has one effect
)
_ECM: Final = SimpleNamespace(id="m", skills={"k": _SKILL}, definitions={}, providers=lambda name: (name,))


def _stubbed_attempts(do: PerformStep, modules: Any, world: Any) -> Any:
    """The shipped `StepRunner`, of which `begin` is as it is; what a try comes to is arbitrary."""
    one = modules.attempt.StepRunner.__new__(modules.attempt.StepRunner)
    world.at_time = lambda _: world
    site = SimpleNamespace(limits=SimpleNamespace(replans=1))
    dispatch = SimpleNamespace(
        request=StepRequest("m", "k", {}),
        skill=_SKILL,
        choice=ProviderChoice((), None, ""),
        code="",
        context="",
        typical_duration=None,
        record=SimpleNamespace(successes=0, failures=0),
    )

    def start(_: Any) -> int:
        do("begin")
        return 1

    def wait(_: float = inf) -> EndedStep:
        do("act")
        do("end")
        return EndedStep(1, StepResult(StepStatus.FINISHED, ""))  # type: ignore[arg-type]

    def finish(*_: Any) -> Any:
        failed = do("judge", "done", "failed") == "failed"
        return modules.attempt.AttemptResult(failed=failed, reason="failed" if failed else "")

    one._runtime = SimpleNamespace(
        now=lambda: 0.0,
        log_head=lambda: _HEAD,
        start=start,
        wait=wait,
        active_modules=lambda: {"m": _ECM},
        site=site,
    )
    one.waiting = CancellableWait(one._runtime)  # nobody cancels
    one._journal = SimpleNamespace(record=lambda *_, **__: None, record_step=lambda *_, **__: None)
    one._overdue = OverdueSteps(one._journal)  # none is: nothing is known of how long they usually take
    one._memory = SimpleNamespace(start_episode=lambda _: 1, latest_episode=lambda: 0)
    one._world, one._task, one._failures = world, "task", []
    one.dispatcher = SimpleNamespace(dispatch=lambda *_: dispatch, denied=set())
    one.failure_rules = FailureRules(one._runtime, one._memory, one.dispatcher)
    one._planned_state = None
    one.planning_memory = SimpleNamespace(recall=lambda given: given, view=lambda seen, _: seen)
    one.records, one.planned_in, one.bars = [], [], modules.bars.UncertainSteps()
    one.finish = finish
    return one


# What is true at each place, and what each step does.


def _path_facts(path: StepPath) -> Iterator[str]:
    done = [what for what, _ in path]
    answers = dict(path)
    saved = [what.split() for what in done if what.startswith("save ")]
    if not saved:
        if "read-checkpoint" in answers:
            yield f"(= kept {_ATTEMPT_CODES[answers['read-checkpoint']]})"
        if "read-plan" in answers:
            yield f"(= kept.plan {str(answers['read-plan'] == 'yes').lower()})"
        if "read-bars" in answers:
            yield f"(= kept.barred {str(answers['read-bars'] == 'yes').lower()})"
        if "read-record" in answers:
            yield f"(= told {_EVENT_CODES[answers['read-record']]})"
    else:
        _, state, plan, bars = saved[-1]
        yield f"(= kept {_ATTEMPT_CODES[state]})"
        yield f"(= kept.plan {str(plan == 'planned').lower()})"
        yield f"(= kept.barred {str(bars == 'barred').lower()})"
        last = max(place for place, what in enumerate(done) if what.startswith("save "))
        yield f"(= told {('end' in done[last:]) + ('begin' in done[last:])})"
    if "act" not in done and answers.get("measure") == "yes":
        yield "happened"
    if "act" not in done and answers.get("measure") == "no":
        yield "(not happened)"
    if "begin" in done or any("done" in one or "free" in one for one in saved):
        yield "(not left)"


_INVARIANT_FACTS: Final = (
    "(<= 0 kept 3)",
    "(<= 0 told 2)",
    "(=> left happened)",
    "(=> left (or kept.barred (and (= kept 1) (< 0 told))))",
    "(=> (< 0 told) (= kept 1))",
    "(=> (= kept 1) kept.plan)",
    "(=> acknowledged (and (= kept 2) kept.plan))",
    "(not repeated)",
)


def _effect(what: str, answer: str, _: int) -> str:
    state = [one for one in _STATE if one != "pc"]
    match what.split():
        case ["read-checkpoint"]:
            return transition(state, {}, f"(= kept {_ATTEMPT_CODES[answer]})")
        case ["read-plan"]:
            return transition(state, {}, "kept.plan" if answer == "yes" else "(not kept.plan)")
        case ["read-bars"]:
            return transition(state, {}, "kept.barred" if answer == "yes" else "(not kept.barred)")
        case ["read-record"]:
            return transition(state, {}, f"(= told {_EVENT_CODES[answer]})")
        case ["measure"]:
            return transition(
                state, {}, {"yes": "happened", "no": "(not happened)", "unknown": "true"}[answer]
            )
        case ["save", tried, plan, bars]:
            planned = plan == "planned"
            after = {
                "kept": str(_ATTEMPT_CODES[tried]),
                "kept.plan": str(planned).lower(),
                "kept.barred": str(bars == "barred").lower(),
                "told": "0",
                "left": "false" if tried == "done" else "left",
                "acknowledged": str(tried == "done" and planned).lower(),
                "repeated": "(or repeated acknowledged)" if tried == "begun" else "repeated",
            }
            return transition(state, after)
        case ["begin"]:
            return transition(state, {"told": "1"})
        case ["act"]:
            succeeds = transition(state, {"happened": "true"})
            return smt_or([succeeds, transition(state, {})])
        case ["end"]:
            return transition(state, {"told": "2"})
    return transition(state, {})


_CRASH: Final = transition(
    tuple(_STATE), {"pc": "0", "left": "(or left (and happened (= kept 1) (< 0 told)))"}
)


def _definitions(session: ProcessGraph) -> tuple[str, ...]:
    invariant = smt_and([*_INVARIANT_FACTS, session.invariant_formula("pc", _path_facts)])
    return (
        *declare_state(_STATE),
        f"(define-fun invariant () Bool {invariant})",
        f"(define-fun invariant-after () Bool {primed(invariant, _STATE)})",
    )


def _base(code: ModuleSource) -> TheoremObligation:
    first = "(and (= pc 0) (= kept 0) (= told 0) (not happened) (not left) (not acknowledged) (not repeated))"
    return TheoremObligation(
        "Base: of a run in which nothing was tried yet the invariant holds, whatever its checkpoint bars.",
        _definitions(_session(code)),
        f"(=> {first} invariant)",
    )


def _step(code: ModuleSource) -> TheoremObligation:
    session = _session(code)
    return TheoremObligation(
        "Step: the invariant survives every step of a session that takes a run up.",
        (*_definitions(session), f"(define-fun step () Bool {session.step_formula('pc', _effect)})"),
        "(=> (and invariant step) invariant-after)",
    )


def _crash(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "Step: it survives a crash at any place, the wake-up included.",
        (*_definitions(_session(code)), f"(define-fun step () Bool {_CRASH})"),
        "(=> (and invariant step) invariant-after)",
    )


def _claim(code: ModuleSource) -> TheoremObligation:
    session = _session(code)
    begins = smt_or(f"(= pc {at})" for at, what, _, _ in session.steps if what == "begin")
    return TheoremObligation(
        "Where the invariant holds, a skill begins only after a checkpoint that says so, and never\n"
        "where a crash left a try of it that has succeeded; no place acknowledged as done is begun again.",
        _definitions(session),
        f"(=> invariant (and (not repeated) (=> {begins} (and (= kept 1) (= told 0) (not left)))))",
    )


_START_ATTEMPT: Final = (
    "        self._progress.start_attempt("
    "at, UnfinishedAttempt(step.module, step.skill, inputs, before, head))\n"
)
_START_STEP: Final = (
    "        started = self._attempts.start(role, step.module, step.skill, inputs, scope.held)\n"
)

_LOOPS: Final = loops_of(
    "aeros.agent.execution.plan_executor",
    "aeros.agent.execution.progress",
    "aeros.agent.execution.step_attempt",
    "aeros.agent.execution.uncertain_steps",
    "aeros.agent.recovery.checkpoint",
    "aeros.agent.recovery.recover",
    "aeros.agent.task_loop",
)

THEOREM = Theorem(
    "a resumed agent repeats no step that was acknowledged or that happened before the crash",
    {"base": _base, "step": _step, "crash": _crash, "claim": _claim, "loops": _LOOPS},
    (
        Mutant(
            "begins-before-it-keeps-that",
            "claim",
            PLAN_EXECUTOR,
            _START_ATTEMPT + _START_STEP,
            _START_STEP + _START_ATTEMPT,
        ),
        Mutant(
            "forgets-how-a-try-ended",
            "step",
            PROGRESS,
            "return self.attempts[at].last_result if at in self.attempts else None",
            "return None",
        ),
        Mutant(
            "bars-nothing",
            "step",
            RECOVERY,
            "if (attempt is None or attempt.failed) and not skill.idempotent:",
            "if attempt is None and not skill.idempotent:",
        ),
        Mutant(
            "forgets-in-a-second-crash-what-it-barred",
            "step",
            TASK_LOOP,
            "uncertain_steps=attempts.bars.to_checkpoint,",
            "uncertain_steps=(),",
        ),
        Mutant(
            "takes-unknown-for-excluded",
            "step",
            UNCERTAIN_STEPS,
            "if not is_excluded(outcome, world, before):",
            "if outcome.effects.keys() <= world.known.keys() and not is_excluded(outcome, world, before):",
        ),
        Mutant(
            "looks-at-two-outcomes-only",
            "loops",
            "aeros.agent.execution.uncertain_steps",
            "for outcome in skill.success_outcomes:",
            "for outcome in skill.success_outcomes[:2]:",
        ),
    ),
)
