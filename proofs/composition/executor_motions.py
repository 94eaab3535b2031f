"""The motions that the executor counts as under way are those that move on the plant: for theorem 11."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, Final, NamedTuple

from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.gate.decision import DecisionKind
from aeros.runtime.ports import MotionCompletion, StepStatus
from aeros.runtime.skills.in_process_run import SkillRunResult
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation

STEP: Final = "aeros.runtime.execution.step"
CLEAN_UP: Final = "aeros.runtime.execution.clean_up"
SCHEDULER: Final = "aeros.runtime.execution.scheduler"

_NAMES: Final = ("one", "other")
_EXECUTOR_ACTIONS: Final = ("act", "advance", "halt", "stop-all", "break-off")
_RUN_RESULT: Final = SkillRunResult(StepStatus.STOPPED, "")


class _SymbolicPlant:
    """Has the motions that move, and lets each end where that is asked for."""

    def __init__(self, ask: DecideBranch, moving: set[str]) -> None:
        self._ask = ask
        self.moving = moving

    def begin(self, _: Any, __: Any) -> Any:
        """A motion, or why there is none."""
        if not self._ask("plant-begins"):
            return MotionCompletion(completed=False, reason="")
        self.moving.add("new")
        return "new"

    def advance(self, _: Any, __: Any) -> Any:
        """Time goes on."""
        ended = [one for one in sorted(self.moving) if self._ask(f"{one}.ends")]
        self.moving -= set(ended)
        return {one: MotionCompletion(completed=self._ask(f"{one}.completes")) for one in ended}

    def halt(self, motion: str) -> None:
        """It goes on until it has come to rest."""
        assert motion in self.moving  # noqa: S101  nothing else is ever brought to rest

    def stop(self) -> None:
        """All motions are over."""
        self.moving.clear()

    def now(self) -> float:
        """Before every deadline."""
        return 0.0

    def observe(self) -> Mapping[str, Any]:
        """Nothing is measured: records of stops are not modelled."""
        return {}

    def skill_ended(self, _: str, *, finished: bool) -> None:
        """Nothing moves for it."""


def motions_match_plant(code: ModuleSource) -> TheoremObligation:
    """With who decides, the record, resources and skills put aside."""
    # No module keeps anything between two paths, so they are loaded once.
    steps = code.module(STEP)
    clean_up = code.module(CLEAN_UP, using=(steps,), caller_details=lambda _: {})
    scheduler = code.module(
        SCHEDULER,
        using=(steps, clean_up),
        is_transient_denial=lambda *_: False,
        format_reasons=lambda *_: "",
        stop_cause=lambda *_: None,
    )

    def run(ask: DecideBranch) -> str:
        plant = _SymbolicPlant(ask, {name for name in _NAMES if ask(f"{name}.moves")})
        before = set(plant.moving)
        decided_with: set[str] = before

        def decide(_: Any, __: Any, active_motions: Any) -> Any:
            nonlocal decided_with
            decided_with = {one.handle for one in active_motions}
            if not ask("allowed"):
                decision = SimpleNamespace(kind=DecisionKind.DENY, reasons=())
                return SimpleNamespace(decision=decision, active_action=None, plan=None, causes=())
            plan = None if ask("plant-can") else MotionCompletion(completed=False, reason="")
            return SimpleNamespace(
                decision=SimpleNamespace(kind=DecisionKind.ALLOW),
                active_action=SimpleNamespace(action=None),
                plan=plan,
                is_protective_stop=ask("ends-others"),
            )

        table = steps.StepTable()
        table.steps = {name: _step(steps, name, name in plant.moving, ask) for name in _NAMES}

        def nothing(*_: Any) -> None:
            """Stand for what has no effect on motions."""

        # A stop is under way, so that what is done then runs as well; there is nothing to record of it.
        stops = SimpleNamespace(
            late_ticks=0,
            are_open=True,
            stop=None,
            add=nothing,
            begin_halt=nothing,
            end_halt=nothing,
            end_stop=nothing,
        )
        monitors = SimpleNamespace(
            add=nothing,
            remove=nothing,
            violation=None,
            begin_stop=nothing,
            stops=stops,
            tracker=SimpleNamespace(halt=nothing),
        )
        context = clean_up.ExecutionContext(
            table,
            plant,
            audit=SimpleNamespace(append=lambda *_: 0),
            resources=SimpleNamespace(release=lambda _: None),
            pipeline=SimpleNamespace(
                decide=decide,
                find_detour=lambda *_: ("leg", "last") if ask("way-round") else None,
                count_execution=lambda _: None,
                monitors=monitors,
            ),
            governor=SimpleNamespace(command=OperatorCommand.RUN),
            followed=SimpleNamespace(configuration=SimpleNamespace(site=None), release=lambda: None),
        )
        cleaning = clean_up.CleanUp(context)
        control = scheduler.StepControl(context, cleaning)
        one = _Parts(table, cleaning, control, scheduler.Scheduler(context, cleaning, control))
        *most, last = _EXECUTOR_ACTIONS
        _perform(one, next((deed for deed in most if ask(f"(= deed {deed})")), last))
        after = {step.active_motion.handle for step in table.steps.values() if step.active_motion is not None}
        return smt_literal(decided_with == before and after == plant.moving)

    flags = (
        *(
            f"{name}.{what}"
            for name in (*_NAMES, "new")
            for what in ("moves", "halts", "finished", "late", "ends", "completes", "goes-round")
        ),
        "allowed",
        "way-round",
        "plant-can",
        "plant-begins",
        "ends-others",
    )
    return TheoremObligation(
        "Where a motion is under way exactly as some step of the executor has it, the executor tells of all\n"
        "of them whoever decides an action, and whatever it does then, this is so again.",
        (
            f"(declare-datatypes ((Deed 0)) (({' '.join(f'({one})' for one in _EXECUTOR_ACTIONS)})))",
            "(declare-const deed Deed)",
            *(f"(declare-const {one} Bool)" for one in flags),
        ),
        "kept",
        tables=(SymbolicFunction("kept", "Bool", execute_symbolically(run)),),
    )


class _Parts(NamedTuple):
    """The parts of an executor."""

    table: Any
    clean_up: Any
    control: Any
    scheduler: Any


def _step(steps: Any, name: str, moves: bool, ask: DecideBranch) -> Any:
    """A step that has begun; one that comes to rest has an ending."""
    halts = moves and ask(f"{name}.halts")
    active_motion = steps.ActiveMotion(name, SimpleNamespace(record_number=0), None, halts) if moves else None
    return SimpleNamespace(
        caller=None,
        name=name,
        requested_action=None,
        pending_legs=deque(("leg",) if ask(f"{name}.goes-round") else ()),
        is_running=True,
        is_finished=not moves and ask(f"{name}.finished"),
        deadline=0.0 if ask(f"{name}.late") else 1.0,
        active_motion=active_motion,
        result=_RUN_RESULT if halts else None,
        is_transient=False,
        denials=[],
        is_denial_open=False,
        is_held_back=False,
        decision_counts=steps.Counter(),
        close_skill=lambda: None,
    )


def _perform(executor: _Parts, deed: str) -> None:
    """Do it where it may be: a step that moves nothing acts, and time goes on for what moves."""
    step = executor.table.steps["one"]
    if deed == "act" and step.active_motion is None:
        executor.control._decide_and_begin(step, SimpleNamespace(kind=""))
    elif deed == "advance" and executor.table.is_moving():
        executor.scheduler._advance_plant(1.0)
    elif deed == "halt":
        executor.clean_up.halt_step("one", _RUN_RESULT)
    elif deed == "stop-all":
        executor.clean_up.stop_all("")
    elif deed == "break-off":
        executor.clean_up.clean_up_all(ValueError())
