"""That the executor begins nothing under another configuration than the one in force."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_apply, smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, SymbolicValue, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.lifecycle.table import SymbolicMapping

SCHEDULER: Final = "aeros.runtime.execution.scheduler"
GOVERNOR: Final = "aeros.runtime.execution.governor"


def _begin_obligation(code: ModuleSource) -> TheoremObligation:
    # Neither module keeps anything between two paths, so they are loaded once.
    governor = code.module(GOVERNOR)
    control = code.module(SCHEDULER, using=(governor,))

    def run(ask: DecideBranch) -> str:
        began: list[str] = []
        generation = SymbolicValue("latest", ask)

        @contextmanager
        def hold_generation(_: Any) -> Iterator[bool]:
            yield ask("in-force")

        ecm = SimpleNamespace(
            id="m",
            manifest_digest=SymbolicValue("manifest", ask),
            code_digest=SymbolicValue("code", ask),
            configuration=SymbolicValue("bound", ask),
        )
        now = SimpleNamespace(
            manifest_digest=SymbolicValue("manifest-now", ask),
            code_digest=SymbolicValue("code-now", ask),
            configuration=SymbolicValue("bound-now", ask),
        )
        command = governor.OperatorCommand.STOP if ask("stopped") else governor.OperatorCommand.RUN
        followed = governor.FollowedConfiguration.__new__(governor.FollowedConfiguration)
        followed._governor = SimpleNamespace(generation=generation, hold_generation=hold_generation)
        followed.configuration = SimpleNamespace(modules=SymbolicMapping(ask, "active", now))
        followed.follow = lambda: SymbolicValue("followed", ask)
        followed._is_moving = lambda: ask("moving")
        followed._held = None
        one = control.StepControl.__new__(control.StepControl)
        one._governor, one._followed = SimpleNamespace(command=command), followed
        looks = iter(("unheld", "unheld-now"))
        one._check_hold_condition = lambda _: "ending" if ask(next(looks)) else None
        one.actions_are_paused = lambda: ask("held-back")
        one._decide_and_begin = lambda *_: began.append("begins")
        step = SimpleNamespace(
            ecm=ecm,
            requested_action="action" if ask("asked-before") else None,
            pending_legs=deque(("leg",) if ask("goes-round") else ()),
        )

        def resume(_: Any) -> Any:
            step.requested_action = "action"

        one._resume_skill = resume
        one.run_skill(step)
        return smt_literal(bool(began))

    flags = (
        "in-force",
        "stopped",
        "active",
        "held-back",
        "moving",
        "asked-before",
        "goes-round",
        "unheld",
        "unheld-now",
    )
    numbers = ("latest", "followed", "manifest", "manifest-now", "code", "code-now", "bound", "bound-now")
    return TheoremObligation(
        "`StepControl.run_skill` begins an action only where the module is in force with the same manifest,\n"
        "code and configuration, nobody stops it, what it is to be held to is measured, and the\n"
        "configuration followed is the latest: asked while it holds the lock.",
        (
            *(f"(declare-const {one} Bool)" for one in flags),
            *(f"(declare-const {one} Int)" for one in numbers),
        ),
        "(=> begins (and active (= manifest manifest-now) (= code code-now) (= bound bound-now) (not stopped)"
        " (not unheld) (not unheld-now) (ite moving (= followed latest) in-force)))",
        tables=(SymbolicFunction("begins", "Bool", execute_symbolically(run)),),
    )


def _switch_obligation(code: ModuleSource) -> TheoremObligation:
    def run(ask: DecideBranch) -> str:
        governor = code.module(GOVERNOR)
        new = SimpleNamespace(digest=SymbolicValue("digest-new", ask), site=None)
        one = governor.FollowedConfiguration(
            SimpleNamespace(digest=SymbolicValue("digest-old", ask)),
            SimpleNamespace(
                generation=SymbolicValue("latest", ask),
                configuration=lambda: (SymbolicValue("told", ask), new),
            ),
            is_moving=lambda: ask("moving"),
            switch=lambda _: None,
            record=lambda _: None,
        )
        one.generation = SymbolicValue("followed", ask) if ask("follows-one") else None
        followed = one.follow()
        return smt_apply("following", followed.term, smt_literal(one.configuration is new))

    return TheoremObligation(
        "`FollowedConfiguration.follow` takes another configuration over only while nothing moves, with the\n"
        "generation that it was told with it; else it goes on with the one that it had.",
        (
            "(declare-datatypes ((Following 0)) (((following (generation Int) (another Bool)))))",
            *(
                f"(declare-const {one} Int)"
                for one in ("followed", "latest", "told", "digest-old", "digest-new")
            ),
            *(f"(declare-const {one} Bool)" for one in ("follows-one", "moving")),
        ),
        "(and (=> (and follows-one moving) (= now (following followed false)))"
        " (=> (another now) (= (generation now) told))"
        " (=> (not (= (generation now) followed)) (or (another now) (= digest-old digest-new))))",
        tables=(SymbolicFunction("now", "Following", execute_symbolically(run)),),
    )


def executor_obligations() -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """Of following the configuration, and of beginning an action."""
    return {
        "follows": _switch_obligation,
        "begins": _begin_obligation,
    }
