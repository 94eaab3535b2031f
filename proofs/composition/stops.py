"""Parts under held conditions and within times: what starts in them, when they stop, and what follows."""

from __future__ import annotations

from math import inf
from types import SimpleNamespace
from typing import Any, Final, cast

from aeros.agent.execution.attempt import AttemptResult, RunningAttempt
from aeros.agent.planning.task_graph import PlanStep
from aeros.runtime.ports import StepResult, StepStatus
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL
from aeros.spec.model.ecm import ActionCondition
from aeros.spec.model.step_graph import Fallback, HeldPart, Seq, TimedPart
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_and, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.composition.alternatives import ALTERNATIVES, PROGRESS

PART_STOPS: Final = "aeros.agent.execution.part_stops"
PLAN_EXECUTOR: Final = "aeros.agent.execution.plan_executor"

_STEPS: Final = ("first", "second")
_CONDITION: Final = ActionCondition(
    t.Variable("c", BOOL, t.VariableRole.STATE), "c", cast("Any", SimpleNamespace(text="c"))
)
_SPAN: Final = cast("Any", None)
_TIME: Final = 10.0


class _Attempts:
    """Runtime and world, as a plan's executor sees them; each answer is asked for."""

    def __init__(self, ask: DecideBranch, is_timed: bool) -> None:
        self._ask = ask
        self._is_timed = is_timed
        self._measurement = "begins"
        self.waiting = SimpleNamespace(was_cancelled=False, now=0.0)
        self.world = SimpleNamespace(
            evaluate=lambda _: ask(self._measurement), unmet_reason=lambda _: "", predicates={}
        )
        self.audit_head = None
        self.facts = {f"{name}-started": False for name in (*_STEPS, "other")}
        self.facts |= {"unheld": False, "left-running": False}
        self._running = ""
        self._cancelled = False

    def start(self, _: Any, __: str, skill: str, ___: Any, held: Any) -> RunningAttempt:
        is_inside = skill in _STEPS
        self.facts[f"{skill}-started"] = True
        self.facts["unheld"] |= is_inside and not self._is_timed and held != (_CONDITION,)
        self._running, self._cancelled = skill, False
        return RunningAttempt(cast("Any", skill), cast("Any", skill))

    def cancel(self, handle: Any, _: str) -> None:
        self._cancelled = self._cancelled or handle == self._running

    def wait(self, until: float) -> Any:
        name = self._running
        may_last = name in _STEPS and until < inf and not self._cancelled
        if may_last and self._ask(f"{name}-lasts"):
            self.waiting.now = until
            return None
        self.facts["left-running"] |= name in _STEPS and self.waiting.now >= _TIME and not self._cancelled
        lost = name in _STEPS and not self._is_timed and self._ask(f"{name}-lost")
        stopped = lost or self._cancelled
        status = StepStatus.CANCELLED if stopped else StepStatus.FINISHED
        return SimpleNamespace(step=name, result=StepResult(status, "", lost_hold=0 if lost else None))

    def finish(self, name: str, result: StepResult) -> AttemptResult:
        self._measurement = f"{name}-holds"
        record = cast("Any", SimpleNamespace(module="m", skill=name, status=result.status))
        if result.status is StepStatus.CANCELLED:
            return AttemptResult(True, "", record=record, is_stop=self._ask(f"{name}-known"))
        if name not in _STEPS or self._ask(f"{name}-succeeds"):
            return AttemptResult(False, "", record=record)
        return AttemptResult(True, "", is_retryable=self._ask(f"{name}-declared"), record=record)


def _tables(code: ModuleSource, *, is_timed: bool) -> tuple[SymbolicFunction, ...]:
    """Run a part of two steps, and another step where the part fails; one table for each fact."""
    progress = code.module(PROGRESS)
    stops = code.module(PART_STOPS, using=(progress,))
    alternatives = code.module(ALTERNATIVES, using=(progress,))
    executor = code.module(PLAN_EXECUTOR, using=(progress, stops, alternatives))
    inner = Seq(tuple(PlanStep("m", name, id=name) for name in _STEPS))
    part: Any = HeldPart(inner, _SPAN, False, _CONDITION)
    if is_timed:
        part = TimedPart(inner, _SPAN, False, cast("Any", _TIME))

    def facts(ask: DecideBranch) -> dict[str, bool]:
        attempts = _Attempts(ask, is_timed)
        engine = executor.PlanExecutor(attempts, None, lambda: False)
        end = engine.run(Fallback((part, PlanStep("m", "other")), _SPAN))
        return {**attempts.facts, "succeeds": end is None}

    names = (*(f"{name}-started" for name in (*_STEPS, "other")), "unheld", "left-running", "succeeds")

    def table(name: str) -> SymbolicFunction:
        return SymbolicFunction(
            f"part-{name}", "Bool", execute_symbolically(lambda ask: smt_literal(facts(ask)[name]))
        )

    return tuple(map(table, names))


def _claims(begins: str, stops: dict[str, str], clean: dict[str, str]) -> list[str]:
    """State what starts: by when the part stops in a step, and when the step's own end allows to go on."""
    first, second = (f"(and (not {stops[name]}) {name}-succeeds)" for name in _STEPS)
    done = smt_and([begins, first, second])
    ended = {
        name: f"(ite {stops[name]} {clean[name]} (and (not {name}-succeeds) {name}-declared))"
        for name in _STEPS
    }
    fails = f"(or (not {begins}) {ended['first']} (and {first} {ended['second']}))"
    return [
        f"(= part-first-started {begins})",
        f"(= part-second-started (and {begins} {first}))",
        f"(= part-other-started {fails})",
        f"(= part-succeeds (or {done} {fails}))",
        "(not part-unheld)",
        "(not part-left-running)",
    ]


def held_parts(code: ModuleSource) -> TheoremObligation:
    """Of a held part with two steps, each with any end, and a condition that may break at any measurement.

    Args:
        code: the shipped modules, or copies with a fault.

    Returns:
        The obligation.
    """
    stops = {name: f"(or {name}-lost (not {name}-holds))" for name in _STEPS}
    clean = {name: f"(ite {name}-lost {name}-known (or {name}-succeeds {name}-declared))" for name in _STEPS}
    return TheoremObligation(
        "A part under `hold` starts only where its condition is measured as true, and goes on only while it\n"
        "is: the runtime holds it for each step, and it is measured after each.  Once it is not, nothing in\n"
        "the part starts, and it has failed as declared, unless its step ended as no plan provides for.",
        (
            "(declare-const begins Bool)",
            *(
                f"(declare-const {name}-{what} Bool)"
                for name in _STEPS
                for what in ("lost", "holds", "known", "succeeds", "declared")
            ),
        ),
        smt_and(_claims("begins", stops, clean)),
        tables=_tables(code, is_timed=False),
    )


def timed_parts(code: ModuleSource) -> TheoremObligation:
    """Of a part with a timeout and two steps, each of which may last until the time has passed.

    Args:
        code: the shipped modules, or copies with a fault.

    Returns:
        The obligation.
    """
    stops = {name: f"{name}-lasts" for name in _STEPS}
    clean = {name: f"{name}-known" for name in _STEPS}
    return TheoremObligation(
        "Once the time of a part with a timeout has passed, its running step is cancelled, nothing in it\n"
        "starts, and it has failed as declared, unless its step ended as no plan provides for.",
        tuple(
            f"(declare-const {name}-{what} Bool)"
            for name in _STEPS
            for what in ("lasts", "known", "succeeds", "declared")
        ),
        smt_and(_claims("true", stops, clean)),
        tables=_tables(code, is_timed=True),
    )
