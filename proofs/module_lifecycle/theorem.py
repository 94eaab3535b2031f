"""No skill of a module that is not active acts, and changes are whole or not at all: theorem 8."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.errors import UserError
from aeros.spec.theorems.exploring import Ask, Diagram, Symbol, explore
from aeros.spec.theorems.formulas import literal
from aeros.spec.theorems.shipped import Code, Mutant, put_in_place
from aeros.spec.theorems.theorem import Obligation, Table, Theorem

LIFECYCLE: Final = "aeros.runtime.registry.lifecycle"
REGISTRY: Final = "aeros.runtime.registry.registry"
GOVERNING: Final = "aeros.runtime.registry.governing"
EXECUTOR: Final = "aeros.runtime.executor"

# The table of states, as the registry goes through it.

_STATES: Final = (
    "(declare-datatypes ((State 0)) (((absent) (installed) (configured) (active) (refused))))",
    "(declare-datatypes ((Verb 0)) (((install) (configure) (activate) (deactivate) (remove))))",
    "(declare-const state State)",
    "(declare-const verb Verb)",
)


def _chosen(ask: Ask, name: str, members: Any) -> Any:
    """One of an enumeration's members, as the input says."""
    *others, last = members
    return next((one for one in others if ask(f"(= {name} {one.value})")), last)


def _explore_steps(code: Code) -> Diagram:
    """The state after a verb, or `refused`: a term of sort State."""
    lifecycle = code.module(LIFECYCLE)
    registry = code.module(REGISTRY, using=(lifecycle,))

    def run(ask: Ask) -> str:
        state = _chosen(ask, "state", lifecycle.State)
        kept = {} if state is lifecycle.State.ABSENT else {"m": SimpleNamespace(state=state)}
        try:
            reached = registry.Registry._next(
                None, SimpleNamespace(modules=kept), "m", _chosen(ask, "verb", lifecycle.Verb)
            )
        except UserError:
            return "refused"
        return str(reached.value)

    return explore(run)


def _inductive(code: Code) -> Obligation:
    """An induction: what holds of every module before a step, holds after it."""
    return Obligation(
        "Whatever is done in whichever order, an active module has been installed, configured and activated\n"
        "since it was last absent; an active one is never removed or configured, and what is refused stays.",
        (
            *_STATES,
            *(f"(declare-const has-been.{past} Bool)" for past in ("installed", "configured", "activated")),
        ),
        "(=> (invariant state has-been.installed has-been.configured has-been.activated)"
        " (and (invariant then then.installed then.configured then.activated)"
        " (=> (and (= state active) (or (= verb remove) (= verb configure))) (= after refused))))",
        tables=(Table("after", "State", _explore_steps(code)),),
        lemmas=(
            "(define-fun then () State (ite (= after refused) state after))",
            "(define-fun done ((one Verb)) Bool (and (not (= after refused)) (= verb one)))",
            "(define-fun lives () Bool (not (= then absent)))",
            "(define-fun then.installed () Bool (and lives (or has-been.installed (done install))))",
            "(define-fun then.configured () Bool (and lives (or has-been.configured (done configure))))",
            "(define-fun then.activated () Bool (and lives (or has-been.activated (done activate))))",
            "(define-fun invariant ((s State) (i Bool) (c Bool) (a Bool)) Bool (and (not (= s refused))"
            " (=> (= s installed) i) (=> (= s configured) (and i c)) (=> (= s active) (and i c a))))",
        ),
    )


def _begins(code: Code) -> Obligation:
    return Obligation(
        "A module that was never heard of is absent, of which all that claims is true; and from there only\n"
        "`install` leads anywhere.",
        _STATES,
        "(=> (= state absent) (= after (ite (= verb install) installed refused)))",
        tables=(Table("after", "State", _explore_steps(code)),),
    )


# Whether what is in force lets a skill act.


def _objection(code: Code) -> Obligation:
    governing = code.module(GOVERNING)

    def run(ask: Ask) -> str:
        def snapshot(when: str, state: Any) -> Any:
            one = SimpleNamespace(state=state, digest=Symbol(f"{when}.digest", ask))
            blocks = {
                name: SimpleNamespace(reason="", matches=lambda *_, name=name: ask(f"{name}.matches"))
                for name in ("block.1", "block.2")
            }
            known = when == "was" or ask("kept")
            return SimpleNamespace(
                modules={"m": one} if known else {}, site=Symbol(f"{when}.site", ask), blocks=blocks
            )

        state = governing.State.ACTIVE if ask("is-active") else governing.State.CONFIGURED
        governor = SimpleNamespace(
            _latest=lambda: snapshot("now", state), _loaded=snapshot("was", governing.State.ACTIVE)
        )
        return literal(governing.Governing.objection(governor, "m", "k", "a") is None)

    return Obligation(
        "`Governing.objection` lets a skill go on exactly while its module is kept and active, with the\n"
        "contents and under the policy that it was decided under, and no override matches.",
        (
            "(declare-sort Text 0)",
            *(
                f"(declare-const {name} Bool)"
                for name in ("kept", "is-active", "block.1.matches", "block.2.matches")
            ),
            *(
                f"(declare-const {when}.{what} Text)"
                for when in ("was", "now")
                for what in ("digest", "site")
            ),
        ),
        "(= goes-on (and kept is-active (= now.digest was.digest) (= now.site was.site)"
        " (not block.1.matches) (not block.2.matches)))",
        tables=(Table("goes-on", "Bool", explore(run)),),
    )


_ACTING: Final = (
    "halted",
    "asks",
    "held-back",
    "stop",
    "active-as-it-was",
    "moving",
    "in-force",
    "halted-now",
)


def _acts(code: Code) -> Obligation:
    executor = code.module(EXECUTOR)

    def run(ask: Ask) -> str:
        acted: list[bool] = []

        @contextmanager
        def acting(_: Any) -> Iterator[bool]:
            yield ask("in-force")

        def begin(*_: Any) -> None:
            acted.append(True)

        looks = iter(("halted", "halted-now"))
        governor = SimpleNamespace(
            acting=acting,
            command=executor.Command.STOP if ask("stop") else executor.Command.RUN,
            generation=1,
        )
        self = SimpleNamespace(
            _unheld=lambda _: "ending" if ask(next(looks)) else None,
            _resume=lambda _: "ending" if ask("ends") else None,
            _is_held_back=lambda: ask("held-back"),
            _is_active=lambda _: ask("active-as-it-was"),
            _moving=lambda: ask("moving"),
            _follow=lambda: 1 if ask("in-force") else 0,
            _acting=SimpleNamespace(enter_context=lambda manager: manager.__enter__()),
            _governor=governor,
            _act_now=begin,
            _let_go=lambda: None,
        )
        step = SimpleNamespace(
            asked="action" if ask("asks") else None, ecm=SimpleNamespace(id="m"), skill="k"
        )
        executor.Executor._act(self, step)
        return literal(bool(acted))

    return Obligation(
        "`Executor._act` begins an action only of a module that is active as it was, under the\n"
        "configuration\n"
        "that is in force and locked against change, and not once a stop was asked for.",
        tuple(f"(declare-const {name} Bool)" for name in (*_ACTING, "ends")),
        "(=> acts (and (not halted) (not stop) active-as-it-was in-force (not halted-now)))",
        tables=(Table("acts", "Bool", explore(run)),),
    )


# A change of the registry.


@dataclass
class _World:
    """What is there of a change at any moment."""

    recorded: bool = False
    told: bool = False
    kept: bool = False
    still: bool = False


class _Folder:
    """Where the registry is; nothing of it is looked at."""

    def mkdir(self, **_: Any) -> None:
        """It is there."""

    def __truediv__(self, _: str) -> _Folder:
        return self


class _KilledError(BaseException):
    """The process ended there."""


def _commit(code: Code) -> Obligation:
    """Wherever a call fails, and wherever the process is killed."""
    registry = code.module(REGISTRY)

    def run(ask: Ask) -> str:
        world = _World()

        def step(name: str, change: Callable[[], None]) -> None:
            if ask(f"killed-before.{name}"):
                raise _KilledError
            if ask(f"fails.{name}"):
                if ask(f"done-all-the-same.{name}"):
                    change()
                raise OSError
            change()

        def publish(generation: int) -> None:
            def change() -> None:
                world.told = generation == 2

            # A store into shared memory does not fail.
            if ask(f"killed-before.publish-{generation}"):
                raise _KilledError
            change()

        live = SimpleNamespace(
            publish=publish,
            is_still=lambda _: ask("older-is-still"),
            wait_until_still=lambda *_: step("wait", lambda: setattr(world, "still", True)),
        )

        @contextmanager
        def opened(_: Any) -> Iterator[Any]:
            yield live

        old, new = (SimpleNamespace(generation=1, site="x", modules={}) for _ in range(2))
        put_in_place(
            registry,
            {
                "record_change": lambda *_: step("record", lambda: setattr(world, "recorded", True)),
                "Live": opened,
                "replace": lambda snapshot, **changes: SimpleNamespace(**{**vars(snapshot), **changes}),
                "adopted": lambda _: {},
                "sweep": lambda *_: None,
            },
        )
        self = SimpleNamespace(
            folder=_Folder(),
            _key=None,
            _keep_policy=lambda *_: None,
            _records=SimpleNamespace(replace=lambda _: step("replace", lambda: setattr(world, "kept", True))),
            snapshot=lambda: SimpleNamespace(generation=2 if world.kept else 1),
        )
        ended = "returned"
        try:
            registry.Registry._commit(self, old, new, "said", SimpleNamespace(digest="d"))
        except _KilledError:
            ended = "killed"
        except (OSError, UserError):
            ended = "failed"
        flags = (world.recorded, world.told, world.kept, world.still)
        return f"(left {ended} {' '.join(map(literal, flags))})"

    names = ["record", "replace", "wait"]
    return Obligation(
        "Wherever `Registry._commit` is killed or fails: what is kept is recorded, and executors were told;\n"
        "where it fails before anything is kept, they are told that nothing changed; where it returns, the\n"
        "change is kept, and nothing of the old configuration moves.",
        (
            "(declare-datatypes ((Ended 0)) (((returned) (failed) (killed))))",
            "(declare-datatypes ((Left 0))"
            " (((left (ended Ended) (recorded Bool) (told Bool) (kept Bool) (still Bool)))))",
            *(f"(declare-const killed-before.{one} Bool)" for one in (*names, "publish-1", "publish-2")),
            "(declare-const older-is-still Bool)",
            *(f"(declare-const {how}.{one} Bool)" for one in names for how in ("fails", "done-all-the-same")),
        ),
        "(and (=> (kept world) (and (recorded world) (told world)))"
        " (=> (and (= (ended world) failed) (not (kept world))) (not (told world)))"
        " (=> (= (ended world) returned) (and (kept world) (still world))))",
        tables=(Table("world", "Left", explore(run)),),
    )


_TELLS: Final = "            live.publish(new.generation)\n"
_KEEPS: Final = "                self._records.replace(new)\n"

THEOREM = Theorem(
    "no skill of a module that is not active acts; what is revoked stops; a change is whole or not at all",
    {
        "begins": _begins,
        "inductive": _inductive,
        "objection": _objection,
        "acts": _acts,
        "commit": _commit,
    },
    (
        Mutant(
            "activates-what-was-never-configured",
            "inductive",
            LIFECYCLE,
            "(State.CONFIGURED, Verb.ACTIVATE): State.ACTIVE,",
            "(State.CONFIGURED, Verb.ACTIVATE): State.ACTIVE,\n"
            "    (State.INSTALLED, Verb.ACTIVATE): State.ACTIVE,",
        ),
        Mutant(
            "goes-on-while-a-module-is-kept",
            "objection",
            GOVERNING,
            "if one is None or one.state is not State.ACTIVE:",
            "if one is None:",
        ),
        Mutant(
            "acts-under-what-was-in-force",
            "acts",
            EXECUTOR,
            "if not in_force or asked is None:",
            "if asked is None:",
        ),
        Mutant(
            "keeps-before-it-tells",
            "commit",
            REGISTRY,
            _TELLS + "            try:\n" + _KEEPS,
            "            try:\n" + _KEEPS + "    " + _TELLS,
        ),
    ),
)
