"""Effects of a registry change that ends at any point, and of a revocation, by the shipped code."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.diagnostics.errors import UserError
from aeros.spec.theorems.module_copies import ModuleSource, install_stubs
from aeros.spec.theorems.smtlib import smt_literal
from aeros.spec.theorems.symbolic_execution import DecideBranch, SymbolicValue, execute_symbolically
from aeros.spec.theorems.theorem import SymbolicFunction, TheoremObligation
from proofs.lifecycle.revocation import TRANSACTION

RUN_MODULES: Final = "aeros.runtime.registry.run_modules"


def change_obligations() -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """Make the obligations: a revoked skill may not continue, and a change is atomic wherever it ends."""
    return {"goes-on": _revoked_motion_stops, "commit": _commit}


# Whether what is in force lets a skill act.


def _revoked_motion_stops(code: ModuleSource) -> TheoremObligation:
    run_modules = code.module(RUN_MODULES)
    states = run_modules.ModuleState

    def run(ask: DecideBranch) -> str:
        blocks = {
            name: SimpleNamespace(reason="", matches=lambda *_, name=name: ask(f"{name}.matches"))
            for name in ("block.1", "block.2")
        }
        one = SimpleNamespace(
            state=states.ACTIVE if ask("is-active") else states.CONFIGURED,
            digest=SymbolicValue("now.digest", ask),
        )
        now = SimpleNamespace(
            modules={"m": one} if ask("kept") else {},
            withdrawn={"m"} if ask("withdrawn") else set(),
            site=SymbolicValue("now.site", ask),
            is_policy_set=ask("policy-set"),
            blocks=blocks,
        )
        identity = SimpleNamespace(digest=SymbolicValue("was.digest", ask))
        loaded = SimpleNamespace(
            identities={"m": identity} if ask("loaded") else {},
            is_installed=ask("installed"),
            policy=SymbolicValue("was.site", ask),
            configuration=SimpleNamespace(site=SimpleNamespace(kinds={})),
        )
        reason = run_modules.LoadedModules.revocation_reason(loaded, now, "m", "k", "a")
        return smt_literal(reason is None)

    flags = ("loaded", "installed", "kept", "is-active", "withdrawn", "policy-set")
    return TheoremObligation(
        "`LoadedModules.revocation_reason` lets a skill go on exactly while its module is loaded and not\n"
        "withdrawn, no override matches, and the operator has set no other policy; the module of a registry\n"
        "run must be kept and active, and that of a folder need not be; while it is active, it has the\n"
        "contents of the registry's.",
        (
            "(declare-sort Text 0)",
            *(f"(declare-const {name} Bool)" for name in (*flags, "block.1.matches", "block.2.matches")),
            *(
                f"(declare-const {when}.{what} Text)"
                for when in ("was", "now")
                for what in ("digest", "site")
            ),
        ),
        "(= goes-on (and loaded (not withdrawn) (=> installed (and kept is-active))"
        " (=> (and kept is-active) (= now.digest was.digest)) (=> policy-set (= now.site was.site))"
        " (not block.1.matches) (not block.2.matches)))",
        tables=(SymbolicFunction("goes-on", "Bool", execute_symbolically(run)),),
    )


# A change of the registry.


@dataclass
class _ObservedState:
    """State of a change that others can observe at a moment."""

    recorded: bool = False
    announced: bool = False
    committed: bool = False
    idle: bool = False


class _RegistryFolderStub:
    """Stub of the registry's folder; no claim looks into it."""

    def __truediv__(self, _: str) -> _RegistryFolderStub:
        return self


class _KilledError(BaseException):
    """The process ended there."""


def _commit(code: ModuleSource) -> TheoremObligation:
    """Make the obligation on a commit in which any call fails or the process is killed at any point."""
    transaction = code.module(TRANSACTION)

    def run(ask: DecideBranch) -> str:
        world = _ObservedState()

        def step(name: str, change: Callable[[], None]) -> None:
            if ask(f"killed-before.{name}"):
                raise _KilledError
            if ask(f"fails.{name}"):
                if ask(f"done-all-the-same.{name}"):
                    change()
                raise UserError([])
            change()

        def publish(generation: int) -> None:
            def change() -> None:
                world.announced = generation == 2

            # A store into shared memory does not fail.
            if ask(f"killed-before.publish-{generation}"):
                raise _KilledError
            change()

        live = SimpleNamespace(
            publish=publish,
            is_idle=lambda _: ask("older-is-still"),
            wait_until_idle=lambda *_: step("wait", lambda: setattr(world, "idle", True)),
        )

        @contextmanager
        def opened(_: Any) -> Iterator[Any]:
            yield live

        old, new = (SimpleNamespace(generation=1, site="x", modules={}) for _ in range(2))
        install_stubs(
            transaction,
            {
                "make_folder": lambda *_: None,
                "record_change": lambda *_: step("record", lambda: setattr(world, "recorded", True)),
                "ControlPage": opened,
                "replace": lambda snapshot, **changes: SimpleNamespace(**{**vars(snapshot), **changes}),
                "recorded_configurations": lambda _: {},
                "remove_unreferenced": lambda *_: None,
            },
        )
        after = SimpleNamespace(**{**vars(new), "generation": 2})
        self = SimpleNamespace(
            folder=_RegistryFolderStub(),
            _key=None,
            _records=SimpleNamespace(
                replace=lambda _: step("replace", lambda: setattr(world, "committed", True))
            ),
        )
        self._recorded_state = lambda: SimpleNamespace(latest=after if world.recorded else old)
        self._record = partial(transaction.RegistryTransactions._record, self)
        self._store = partial(transaction.RegistryTransactions._store, self)
        ended = "returned"
        try:
            transaction.RegistryTransactions.commit(self, old, new, "said", SimpleNamespace(digest="d"))
        except _KilledError:
            ended = "killed"
        except UserError:
            ended = "failed"
        flags = (world.recorded, world.announced, world.committed, world.idle)
        return f"(left {ended} {' '.join(map(smt_literal, flags))})"

    names = ["record", "replace", "wait"]
    return TheoremObligation(
        "Wherever `RegistryTransactions.commit` is killed or fails: what is kept is recorded, and executors\n"
        "were told; they are told of nothing that is not recorded; where it returns, the change is kept,\n"
        "and nothing of the old configuration moves.",
        (
            "(declare-datatypes ((Ended 0)) (((returned) (failed) (killed))))",
            "(declare-datatypes ((Left 0))"
            " (((left (ended Ended) (recorded Bool) (told Bool) (kept Bool) (still Bool)))))",
            *(f"(declare-const killed-before.{one} Bool)" for one in (*names, "publish-2")),
            "(declare-const older-is-still Bool)",
            *(f"(declare-const {how}.{one} Bool)" for one in names for how in ("fails", "done-all-the-same")),
        ),
        "(and (=> (kept world) (and (recorded world) (told world)))"
        " (=> (told world) (recorded world))"
        " (=> (= (ended world) returned) (and (kept world) (still world))))",
        tables=(SymbolicFunction("world", "Left", execute_symbolically(run)),),
    )
