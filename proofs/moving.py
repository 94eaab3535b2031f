"""What the executor has under way is what moves on the plant, whatever it does: for theorem 11."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, Final

from aeros.runtime.decision import Verdict
from aeros.runtime.ports import Completion, StepStatus
from aeros.runtime.skill_run import Ending
from aeros.spec.theorems.exploring import Ask, explore
from aeros.spec.theorems.formulas import literal
from aeros.spec.theorems.shipped import Code
from aeros.spec.theorems.theorem import Obligation, Table

EXECUTOR: Final = "aeros.runtime.executor"

_NAMES: Final = ("one", "other")
_DEEDS: Final = ("act", "advance", "halt", "stop-all", "break-off")
_ENDING: Final = Ending(StepStatus.STOPPED, "")


class _Plant:
    """Has the motions that move, and lets each end where that is asked for."""

    def __init__(self, ask: Ask, moving: set[str]) -> None:
        self._ask = ask
        self.moving = moving

    def begin(self, _: Any, __: Any) -> Any:
        """A motion, or why there is none."""
        if not self._ask("plant-begins"):
            return Completion(completed=False, reason="")
        self.moving.add("new")
        return "new"

    def advance(self, _: Any, __: Any) -> Any:
        """Time goes on."""
        ended = [one for one in sorted(self.moving) if self._ask(f"{one}.ends")]
        self.moving -= set(ended)
        return {one: Completion(completed=self._ask(f"{one}.completes")) for one in ended}

    def halt(self, motion: str) -> None:
        """It goes on until it has come to rest."""
        assert motion in self.moving  # noqa: S101  nothing else is ever brought to rest

    def stop(self) -> None:
        """All motions are over."""
        self.moving.clear()

    def now(self) -> float:
        """Before every deadline."""
        return 0.0

    def skill_ended(self, _: str, *, finished: bool) -> None:
        """Nothing moves for it."""


def tells_all(code: Code) -> Obligation:
    """With who decides, the record, resources and skills put aside."""

    def run(ask: Ask) -> str:
        executor = code.module(
            EXECUTOR,
            may_pass=lambda *_: False,
            spell_reasons=lambda _: "",
            caller_details=lambda _: {},
            cause_of_stop=lambda *_: None,
        )
        plant = _Plant(ask, {name for name in _NAMES if ask(f"{name}.moves")})
        before = set(plant.moving)
        told: set[str] = before

        def decide(_: Any, __: Any, under_way: Any) -> Any:
            nonlocal told
            told = {one.motion for one in under_way}
            if not ask("allowed"):
                decision = SimpleNamespace(verdict=Verdict.DENY, reasons=())
                return SimpleNamespace(decision=decision, begun=None, plan=None, causes=())
            plan = None if ask("plant-can") else Completion(completed=False, reason="")
            return SimpleNamespace(
                decision=SimpleNamespace(verdict=Verdict.ALLOW),
                begun=SimpleNamespace(action=None),
                plan=plan,
                ends_others=ask("ends-others"),
            )

        one = executor.Executor.__new__(executor.Executor)
        one._plant, one._acting, one._held_to, one._results = plant, None, {}, {}
        one._audit = SimpleNamespace(append=lambda *_: 0)
        one._governor = SimpleNamespace(command=executor.Command.RUN)
        one._resources = SimpleNamespace(release=lambda _: None)
        one._configuration = SimpleNamespace(site=None)
        monitors = SimpleNamespace(watch=lambda _: None, forget=lambda _: None, violation=None)
        one._deciding = SimpleNamespace(decide=decide, executed=lambda _: None, monitors=monitors)
        one._steps = {name: _step(executor, name, name in plant.moving, ask) for name in _NAMES}
        *most, last = _DEEDS
        _do(one, next((deed for deed in most if ask(f"(= deed {deed})")), last))
        after = {step.under_way.motion for step in one._steps.values() if step.under_way is not None}
        return literal(told == before and after == plant.moving)

    flags = (
        *(
            f"{name}.{what}"
            for name in (*_NAMES, "new")
            for what in ("moves", "halts", "finished", "late", "ends", "completes")
        ),
        "allowed",
        "plant-can",
        "plant-begins",
        "ends-others",
    )
    return Obligation(
        "Where a motion is under way exactly as some step of the executor has it, the executor tells of all\n"
        "of them whoever decides an action, and whatever it does then, this is so again.",
        (
            f"(declare-datatypes ((Deed 0)) (({' '.join(f'({one})' for one in _DEEDS)})))",
            "(declare-const deed Deed)",
            *(f"(declare-const {one} Bool)" for one in flags),
        ),
        "kept",
        tables=(Table("kept", "Bool", explore(run)),),
    )


def _step(executor: Any, name: str, moves: bool, ask: Ask) -> Any:
    """A step that has begun; one that comes to rest has an ending."""
    halts = moves and ask(f"{name}.halts")
    under_way = executor.UnderWay(name, None, None, halts) if moves else None
    return SimpleNamespace(
        caller=None,
        name=name,
        asked=None,
        has_begun=True,
        finished=not moves and ask(f"{name}.finished"),
        deadline=0.0 if ask(f"{name}.late") else 1.0,
        under_way=under_way,
        ending=_ENDING if halts else None,
        may_pass=False,
        counts=executor.DecisionCounts(),
        close=lambda: None,
    )


def _do(executor: Any, deed: str) -> None:
    """Do it where it may be: a step that moves nothing acts, and time goes on for what moves."""
    step = executor._steps["one"]
    if deed == "act" and step.under_way is None:
        executor._act_now(step, SimpleNamespace(kind=""))
    elif deed == "advance" and executor._is_moving():
        executor._advance(1.0)
    elif deed == "halt":
        executor._halt("one", _ENDING)
    elif deed == "stop-all":
        executor._stop_all("")
    elif deed == "break-off":
        executor._break_off(ValueError())
