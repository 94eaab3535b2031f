"""That the executor begins nothing under another configuration than the one in force."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.theorems.exploring import Ask, Symbol, explore
from aeros.spec.theorems.formulas import application, literal
from aeros.spec.theorems.shipped import Code
from aeros.spec.theorems.theorem import Obligation, Table
from proofs.lifecycle_table import Known

EXECUTOR: Final = "aeros.runtime.executor"


def _begins(code: Code) -> Obligation:
    def run(ask: Ask) -> str:
        executor = code.module(EXECUTOR)
        began: list[str] = []
        generation = Symbol("latest", ask)

        @contextmanager
        def acting(_: Any) -> Iterator[bool]:
            yield ask("in-force")

        ecm = SimpleNamespace(
            id="m", manifest_digest=Symbol("manifest", ask), code_digest=Symbol("code", ask)
        )
        now = SimpleNamespace(
            manifest_digest=Symbol("manifest-now", ask), code_digest=Symbol("code-now", ask)
        )
        command = executor.Command.STOP if ask("stopped") else executor.Command.RUN
        one = executor.Executor.__new__(executor.Executor)
        one._governor = SimpleNamespace(generation=generation, command=command, acting=acting)
        one._configuration = SimpleNamespace(modules=Known(ask, "active", now))
        looks = iter(("unheld", "unheld-now"))
        one._acting = None
        one._unheld = lambda _: "ending" if ask(next(looks)) else None
        one._is_held_back = lambda: ask("held-back")
        one._follow = lambda: Symbol("followed", ask)
        one._is_moving = lambda: ask("moving")
        one._act_now = lambda *_: began.append("begins")
        step = SimpleNamespace(ecm=ecm, asked="action" if ask("asked-before") else None)

        def resume(_: Any) -> Any:
            step.asked = "action"

        one._resume = resume
        one._act(step)
        return literal(bool(began))

    flags = (
        "in-force",
        "stopped",
        "active",
        "held-back",
        "moving",
        "asked-before",
        "unheld",
        "unheld-now",
    )
    numbers = ("latest", "followed", "manifest", "manifest-now", "code", "code-now")
    return Obligation(
        "`Executor._act` begins an action only where the module is in force with the same manifest and\n"
        "code, nobody stops it, what it is to be held to is measured, and the configuration followed is the\n"
        "latest: asked while it holds the lock.",
        (
            *(f"(declare-const {one} Bool)" for one in flags),
            *(f"(declare-const {one} Int)" for one in numbers),
        ),
        "(=> begins (and active (= manifest manifest-now) (= code code-now) (not stopped)"
        " (not unheld) (not unheld-now) (ite moving (= followed latest) in-force)))",
        tables=(Table("begins", "Bool", explore(run)),),
    )


def _follows(code: Code) -> Obligation:
    def run(ask: Ask) -> str:
        executor = code.module(EXECUTOR, session_details=lambda _: {}, capacities_of=lambda _: {})
        one = executor.Executor.__new__(executor.Executor)
        new = SimpleNamespace(digest=Symbol("digest-new", ask), site=None)
        one._generation = Symbol("followed", ask) if ask("follows-one") else None
        one._configuration = SimpleNamespace(digest=Symbol("digest-old", ask))
        one._governor = SimpleNamespace(
            generation=Symbol("latest", ask), configuration=lambda: (Symbol("told", ask), new)
        )
        one._is_moving = lambda: ask("moving")
        one._deciding = SimpleNamespace(follow=lambda _: None)
        one._resources = SimpleNamespace(under=lambda _: None)
        one._audit = SimpleNamespace(append=lambda *_: 0)
        followed = one._follow()
        return application("following", followed.term, literal(one._configuration is new))

    return Obligation(
        "`Executor._follow` takes another configuration over only while nothing moves, with the generation\n"
        "that it was told with it; else it goes on with the one that it had.",
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
        tables=(Table("now", "Following", explore(run)),),
    )


def executor_obligations() -> dict[str, Callable[[Code], Obligation]]:
    """Of following the configuration, and of beginning an action."""
    return {
        "follows": _follows,
        "begins": _begins,
    }
