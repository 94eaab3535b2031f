"""Protocol between a registry change and the executors, as shipped: programs and their invariant.

Generations are whole numbers of any size.  `kept` is what the database says, `live` what the shared page
says, and `returned` the newest change that has returned to the operator.
"""

from __future__ import annotations

import fcntl
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from itertools import count
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.smtlib import smt_and, smt_or
from aeros.spec.theorems.theorem import TheoremObligation
from proofs.lib.process_model import (
    PerformStep,
    ProcessGraph,
    StepPath,
    declare_state,
    execute_process,
    primed,
    transition,
)

FILES: Final = "aeros.files"
CONTROL_PAGE: Final = "aeros.runtime.registry.control_page"
REGISTRY_STORE: Final = "aeros.runtime.registry.store"
TRANSACTION: Final = "aeros.runtime.registry.transaction"

_OBSERVERS: Final = ("look", "other")
_HOLDS: Final = {"change": 1, "look": 2, "other": 3}
"""Holder of `change.lock`; 0 is nobody."""

_STATE: Final[Mapping[str, str]] = {
    **dict.fromkeys(("kept", "live", "returned", "lock"), "Int"),
    **{
        f"{who}.{name}": "Int"
        for who in ("change", *_OBSERVERS)
        for name in ("pc", "policy-1", "modules-1", "blocks-1", "policy-2", "seen")
    },
    **{f"act.{name}": "Int" for name in ("pc", "followed", "seen")},
}


class _Generation:
    """A generation that only a term names."""

    __hash__ = None  # type: ignore[assignment]

    def __init__(self, term: str, do: PerformStep) -> None:
        self.term, self._do = term, do

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, _Generation) and self._do(f"(= {self.term} {other.term})", "yes", "no") == "yes"
        )

    def __le__(self, other: _Generation) -> bool:
        return self._do(f"(<= {self.term} {other.term})", "yes", "no") == "yes"

    def __add__(self, more: int) -> _Generation:
        return _Generation(f"(+ {self.term} {more})", self._do)

    def __mod__(self, other: int) -> str:
        return f"(mod {self.term} {other})"

    def to_bytes(self, *_: Any) -> _Generation:
        """As it is in the page."""
        return self


class _PageStub:
    """The shared page: its first field is the generation."""

    def __init__(self, who: str, do: PerformStep) -> None:
        self._who, self._do = who, do

    def __getitem__(self, _: slice) -> _Generation:
        self._do("see")
        return _Generation(f"{self._who}.seen", self._do)

    def __setitem__(self, _: slice, generation: _Generation) -> None:
        self._do(f"publish {generation.term}")


class _PathStub:
    """A path, of which what was put last is all that counts."""

    def __init__(self, name: str = "") -> None:
        self.name = name
        self.parent = self

    def __truediv__(self, name: str) -> _PathStub:
        return _PathStub(name)

    def exists(self) -> bool:
        """The folder was there."""
        return True


class _LockStubs:
    """The locks of `ControlPage`, by their parity."""

    def __getitem__(self, parity: str) -> _PathStub:
        return _PathStub(f"motion-{parity}.lock")


def _control_page(code: ModuleSource, who: str, do: PerformStep) -> Any:
    """The `ControlPage` of this process, made of the shipped module."""

    def flock(lock: _PathStub, how: int) -> None:
        parity = lock.name.removeprefix("motion-").removesuffix(".lock")
        if how != fcntl.LOCK_EX | fcntl.LOCK_NB:
            do(f"{_LOCK_MODES[how]} {parity}")
        elif do(f"exclude {parity}", "free", "held") == "held":
            raise BlockingIOError

    # Whoever waits looks once, and has no patience left: to look again changes nothing.
    times = count(step=1e6)
    stubbed_fcntl = _fcntl(flock)
    module = code.module(
        CONTROL_PAGE,
        using=(code.module(FILES, fcntl=stubbed_fcntl),),
        fcntl=stubbed_fcntl,
        os=SimpleNamespace(close=lambda _: None),
        time=SimpleNamespace(monotonic=lambda: next(times), sleep=lambda _: None),
        int=SimpleNamespace(from_bytes=lambda page, _: page),
        _open_file=lambda path: path,
    )
    live = module.ControlPage.__new__(module.ControlPage)
    live._folder, live._page, live._locks, live._file = _PathStub(), _PageStub(who, do), _LockStubs(), -1
    return live, module


def _fcntl(flock: Callable[[Any, int], None]) -> Any:
    names = ("LOCK_EX", "LOCK_NB", "LOCK_SH", "LOCK_UN")
    return SimpleNamespace(**{name: getattr(fcntl, name) for name in names}, flock=flock)


_LOCK_MODES: Final = {fcntl.LOCK_SH: "share", fcntl.LOCK_UN: "release"}


class _DatabaseStub:
    """Tells of what is read; rows are of no account but for the generation they are of."""

    def __init__(self, who: str, do: PerformStep, reading: int) -> None:
        self._who, self._do, self._reading = who, do, reading

    def execute(self, statement: str) -> Any:
        """One SELECT, which sees what is kept at that instant; that they are one transaction is not used."""
        if statement == "BEGIN":
            return None
        (table,) = [one for one in ("policy", "modules", "blocks") if f"FROM {one}" in statement]
        self._do(f"select {table}-{self._reading}")
        row = (1, _Generation(f"{self._who}.{table}-{self._reading}", self._do), "site", 1, "[]")
        return SimpleNamespace(fetchone=lambda: row, fetchall=list)


def _transactions(code: ModuleSource, who: str, do: PerformStep) -> tuple[Any, Any]:
    """The `RegistryTransactions` of this process and its `ControlPage`, made of the shipped modules."""
    readings = iter(range(1, 9))
    live, live_module = _control_page(code, who, do)
    records = code.module(REGISTRY_STORE)

    @contextmanager
    def opened(**_: Any) -> Iterator[_DatabaseStub]:
        yield _DatabaseStub(who, do, next(readings))

    def flock(_: Any, how: int) -> None:
        if how == fcntl.LOCK_EX:
            do("lock")
        elif do("try-lock", "taken", "busy") == "busy":
            raise BlockingIOError

    module = code.module(
        TRANSACTION,
        using=(live_module,),
        fcntl=_fcntl(flock),
        os=SimpleNamespace(
            open=lambda *_: 3, close=lambda _: do("unlock"), O_RDWR=0, O_CREAT=0, O_CLOEXEC=0, O_NOFOLLOW=0
        ),
        make_folder=lambda *_: None,
        _is_same_file=lambda *_: True,
        record_change=lambda *_: None,
        read_recorded_state=lambda *_: SimpleNamespace(
            disagreement=lambda _: None, is_unfinished=lambda _: False
        ),
        recorded_configurations=lambda _: {},
        remove_unreferenced=lambda *_: None,
        ControlPage=lambda _: live,
    )
    one = module.RegistryTransactions.__new__(module.RegistryTransactions)
    one.folder, one._key = _PathStub(), _PathStub()
    one._records = records.RegistryStore.__new__(records.RegistryStore)
    one._records._open = opened
    return one, live


def _change_process(code: ModuleSource) -> ProcessGraph:
    """`RegistryTransactions.change_lock` and `commit`: a change that was proved."""

    def run(do: PerformStep) -> str:
        transactions, _ = _transactions(code, "change", do)

        def keep(_: Any) -> None:
            if do("replace", "kept", "fails", "fails-kept") != "kept":
                raise OSError("the disk")

        transactions._records.replace = keep
        try:
            with transactions.change_lock() as old:
                transactions.commit(old, old, "said", SimpleNamespace(digest=""))
        except Exception:
            return "refused"
        return "returned"

    return execute_process(run)


def _observer_process(code: ModuleSource, who: str) -> ProcessGraph:
    """`RegistryTransactions.committed_snapshot`: an executor reads, and withdraws what is not recorded."""

    def run(do: PerformStep) -> str:
        transactions, live = _transactions(code, who, do)
        return "wait" if transactions.committed_snapshot(live) is None else "follow"

    return execute_process(run)


def _executor_process(code: ModuleSource) -> ProcessGraph:
    """`ControlPage.hold_generation`: an action of the followed generation begins and ends under its lock."""

    def run(do: PerformStep) -> str:
        live, _ = _control_page(code, "act", do)
        with live.hold_generation(_Generation("act.followed", do)) as in_force:
            if in_force:
                do("move")
        return "rest"

    return execute_process(run)


# What is true at each place.


def _done_since(path: StepPath, what: str, *ends: str) -> bool:
    """Check that the step was done and none of `ends` came after it."""
    done = [one for one, _ in path]
    return what in done and not any(end in done[done.index(what) :] for end in ends)


def _holds_lock(who: str, path: StepPath) -> str:
    held = _done_since(path, "lock", "unlock") or (
        ("try-lock", "taken") in path and not _done_since(path, "unlock")
    )
    return f"(= lock {_HOLDS[who]})" if held else f"(not (= lock {_HOLDS[who]}))"


def _in_force(act: ProcessGraph) -> str:
    """That an action moves, or may from now on."""
    places = [at for at, way in enumerate(act.paths) if _may_be_moving(way)]
    return smt_and([smt_or(f"(= act.pc {at})" for at in places), "(= act.seen act.followed)"])


def _may_be_moving(path: StepPath) -> bool:
    (share, release) = (f"{what} (mod act.followed 2)" for what in ("share", "release"))
    return _done_since(path, "see", release) and _done_since(path, share, release)


def _executor_facts(path: StepPath) -> Iterator[str]:
    if _done_since(path, "move"):
        yield "(= act.seen act.followed)"
    if _may_be_moving(path):
        yield "(=> (= act.seen act.followed) (<= returned act.followed))"
    if ("(= act.seen act.followed)", "yes") in path:
        yield "(= act.seen act.followed)"


_OLD: Final = "change.policy-1"
_NEW: Final = f"(+ {_OLD} 1)"


def _change_facts(path: StepPath) -> Iterator[str]:
    yield _holds_lock("change", path)
    answers = dict(path)
    if not _done_since(path, "select policy-1", "unlock"):
        return
    published = [what for what, _ in path if what.startswith("publish ")]
    kept = {None: _OLD, "fails": _OLD, "kept": _NEW, "fails-kept": _NEW}[answers.get("replace")]
    yield f"(= kept {kept})"
    if _done_since(path, "select policy-2"):
        yield "(= change.policy-2 kept)"
    if len(published) == 1:
        yield f"(= live {_NEW})"
    elif published:
        yield "(= live kept)"
    old, new = (f"exclude (mod {one} 2)" for one in (_OLD, _NEW))
    # What may move, by what was found before the change was published, and since.
    found = [answer for what, answer in path if what == new]
    waited = ("replace", "kept") in path and answers.get(old) == "free"
    newest = f"(= act.followed {_NEW})"
    if found[:1] == ["free"] or found[1:] == ["free"]:
        yield f"(=> moves {newest if waited else f'(or {newest} {_same_lock(_OLD)})'})"
    elif waited:
        yield f"(=> moves {_same_lock(_NEW)})"


def _same_lock(generation: str) -> str:
    """That what may move has the lock that is also that of `generation`."""
    return f"(= (mod act.followed 2) (mod {generation} 2))"


def _observer_facts(who: str, path: StepPath) -> Iterator[str]:
    yield _holds_lock(who, path)
    order = ("policy-1", "modules-1", "blocks-1")
    read = [one for one in order if _done_since(path, f"select {one}")]
    yield f"(<= {' '.join(f'{who}.{one}' for one in read)} kept)" if read else "true"
    if len(read) == len(order) and _done_since(path, "see"):
        yield (f"(=> (= {who}.policy-1 {who}.seen) (= {who}.policy-1 {who}.modules-1 {who}.blocks-1))")
    if _done_since(path, "select policy-2", "unlock"):
        yield f"(= {who}.policy-2 kept)"
    if (f"(= {who}.policy-1 {who}.seen)", "yes") in path:
        yield f"(= {who}.policy-1 {who}.seen)"


# What each step does.


def _effect(who: str, programs: Mapping[str, ProcessGraph]) -> Callable[[str, str, int], str]:
    act = programs["act"]
    sharing = [
        at
        for at, way in enumerate(act.paths)
        if _done_since(way, "share (mod act.followed 2)", "release (mod act.followed 2)")
    ]
    shared = smt_or(f"(= act.pc {at})" for at in sharing)

    def effect(what: str, answer: str, to: int) -> str:
        match what.split(" ", 1):
            case ["lock" | "try-lock"] if answer != "busy":
                return _step(who, {"lock": str(_HOLDS[who])}, "(= lock 0)")
            case ["unlock"]:
                ended = programs[who].end_results.get(to) == "returned"
                after = {"returned": _NEW} if ended else {}
                return _step(who, {"lock": f"(ite (= lock {_HOLDS[who]}) 0 lock)", **after})
            case ["select", row]:
                read = f"{who}.{row}"  # what is read for nothing is no variable
                return _step(who, {read: "kept"} if read in _STATE else {})
            case ["see"]:
                return _step(who, {f"{who}.seen": "live"})
            case ["publish", generation]:
                return _step(who, {"live": generation})
            case ["replace"]:
                return _step(who, {"kept": "kept" if answer == "fails" else _NEW})
            case ["exclude", parity] if answer == "free":
                return _step(who, {}, f"(not (and {shared} (= (mod act.followed 2) {parity})))")
            case ["share" | "release" | "exclude", _] | ["move" | "try-lock"]:
                return _step(who, {})
        return _step(who, {}, what if answer == "yes" else f"(not {what})")

    return effect


def _step(who: str, after: Mapping[str, str], *conditions: str) -> str:
    return transition([one for one in _STATE if one != f"{who}.pc"], after, *conditions)


def _end_transition(who: str, place: str, after: Mapping[str, str], *conditions: str) -> str:
    return transition(tuple(_STATE), {f"{who}.pc": "0", **after}, place, *conditions)


def _transitions(programs: Mapping[str, ProcessGraph]) -> dict[str, str]:
    """Build the transitions of each process; `ends` is every end at any place, by a crash or not."""
    moves = {who: one.step_formula(f"{who}.pc", _effect(who, programs)) for who, one in programs.items()}
    ends = [
        _end_transition(who, "true", {"lock": f"(ite (= lock {held}) 0 lock)"})
        for who, held in _HOLDS.items()
    ]
    followed = {
        who: smt_or(
            f"(= {who}.pc {at})" for at, result in programs[who].end_results.items() if result == "follow"
        )
        for who in _OBSERVERS
    }
    # `FollowedConfiguration.follow` takes over what it was told while nothing moves: see `following`.
    follows = _end_transition("look", followed["look"], {"act.followed": "look.policy-1"}, "(= act.pc 0)")
    return {**moves, "end": smt_or([*ends, _end_transition("act", "true", {}), follows])}


def _programs(code: ModuleSource) -> dict[str, ProcessGraph]:
    return {
        "change": _change_process(code),
        **{who: _observer_process(code, who) for who in _OBSERVERS},
        "act": _executor_process(code),
    }


def _definitions(programs: Mapping[str, ProcessGraph]) -> tuple[str, ...]:
    parts = {
        "change": programs["change"].invariant_formula("change.pc", _change_facts),
        **{
            who: programs[who].invariant_formula(f"{who}.pc", partial(_observer_facts, who))
            for who in _OBSERVERS
        },
        "act": programs["act"].invariant_formula("act.pc", _executor_facts),
    }
    everywhere = "(and (<= kept live (+ kept 1)) (<= returned kept) (<= 0 lock 3) (<= act.followed kept))"
    inside = smt_and([everywhere, *parts.values()])
    invariant = f"(let ((moves {_in_force(programs['act'])})) {inside})"
    return (
        *declare_state(_STATE),
        f"(define-fun invariant () Bool {invariant})",
        f"(define-fun invariant-after () Bool {primed(invariant, _STATE)})",
    )


def revocation_obligations() -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """Base, and a step of each process."""
    return {
        "agreeing-base": _base,
        **{f"agreeing-{who}": _inductive(who) for who in (*_HOLDS, "act", "end")},
        "agreeing-claim": _claim,
    }


def _base(code: ModuleSource) -> TheoremObligation:
    programs = _programs(code)
    first = smt_and(f"(= {name} 0)" for name in _STATE)
    return TheoremObligation(
        "Base: before anything was ever kept or followed the invariant of changing and acting holds.",
        _definitions(programs),
        f"(=> {first} invariant)",
    )


_PROCESS_DESCRIPTIONS: Final = {
    "change": "a change: `RegistryTransactions.change_lock`, `commit`",
    "look": "an executor that asks what is in force: `RegistryTransactions.committed_snapshot`",
    "other": "any other executor that asks",
    "act": "an executor that begins or ends an action: `ControlPage.hold_generation`",
    "end": "any process that ends, is killed or begins anew, or an executor that follows what it was told",
}


def _inductive(who: str) -> Callable[[ModuleSource], TheoremObligation]:
    def make(code: ModuleSource) -> TheoremObligation:
        programs = _programs(code)
        return TheoremObligation(
            f"Step: the invariant survives what is done by {_PROCESS_DESCRIPTIONS[who]}.",
            (*_definitions(programs), f"(define-fun step () Bool {_transitions(programs)[who]})"),
            "(=> (and invariant step) invariant-after)",
        )

    return make


def _claim(code: ModuleSource) -> TheoremObligation:
    programs = _programs(code)
    moving = smt_or(
        f"(= act.pc {at})"
        for at, way in enumerate(programs["act"].paths)
        if _done_since(way, "move", "release (mod act.followed 2)")
    )
    consistent = smt_and(
        f"(=> (= {who}.pc {at}) (= {who}.policy-1 {who}.modules-1 {who}.blocks-1))"
        for who in _OBSERVERS
        for at, result in programs[who].end_results.items()
        if result == "follow"
    )
    return TheoremObligation(
        "Where the invariant holds, nothing moves that was decided under a configuration older than one\n"
        "whose change has returned; and what is followed is one configuration whole, not half of two.",
        _definitions(programs),
        f"(=> invariant (and (=> {moving} (<= returned act.followed kept)) {consistent}))",
    )
