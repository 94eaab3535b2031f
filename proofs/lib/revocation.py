"""How a change of the registry and whoever executes agree, as shipped: programs, and an invariant of them.

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

from aeros.spec.theorems.module_copies import Code
from aeros.spec.theorems.smtlib import conjunction, disjunction
from aeros.spec.theorems.theorem import Obligation
from proofs.lib.process_model import Do, Program, Way, changed, later, program, variables

LIVE: Final = "aeros.runtime.registry.control_page"
RECORDS: Final = "aeros.runtime.registry.store"
REGISTRY: Final = "aeros.runtime.registry.registry"

_LOOKERS: Final = ("look", "other")
_HOLDS: Final = {"change": 1, "look": 2, "other": 3}
"""Who holds `change.lock`; 0 is nobody."""

_STATE: Final[Mapping[str, str]] = {
    **dict.fromkeys(("kept", "live", "returned", "lock"), "Int"),
    **{
        f"{who}.{name}": "Int"
        for who in ("change", *_LOOKERS)
        for name in ("pc", "policy-1", "modules-1", "blocks-1", "policy-2", "seen")
    },
    **{f"act.{name}": "Int" for name in ("pc", "followed", "seen")},
}


class _Generation:
    """A generation that only a term names."""

    __hash__ = None  # type: ignore[assignment]

    def __init__(self, term: str, do: Do) -> None:
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


class _Page:
    """The shared page: its first field is the generation."""

    def __init__(self, who: str, do: Do) -> None:
        self._who, self._do = who, do

    def __getitem__(self, _: slice) -> _Generation:
        self._do("see")
        return _Generation(f"{self._who}.seen", self._do)

    def __setitem__(self, _: slice, generation: _Generation) -> None:
        self._do(f"publish {generation.term}")


class _Path:
    """A path, of which what was put last is all that counts."""

    def __init__(self, name: str = "") -> None:
        self.name = name
        self.parent = self

    def __truediv__(self, name: str) -> _Path:
        return _Path(name)

    def exists(self) -> bool:
        """The folder was there."""
        return True

    def mkdir(self, **_: Any) -> None:
        """It is there."""


class _Locks:
    """The locks of `Live`, by their parity."""

    def __getitem__(self, parity: str) -> _Path:
        return _Path(f"motion-{parity}.lock")


def _live(code: Code, who: str, do: Do) -> Any:
    """The `Live` of this process, made of the shipped module."""

    def flock(lock: _Path, how: int) -> None:
        parity = lock.name.removeprefix("motion-").removesuffix(".lock")
        if how != fcntl.LOCK_EX | fcntl.LOCK_NB:
            do(f"{_HOW[how]} {parity}")
        elif do(f"exclude {parity}", "free", "held") == "held":
            raise BlockingIOError

    # Whoever waits looks once, and has no patience left: to look again changes nothing.
    times = count(step=1e6)
    module = code.module(
        LIVE,
        fcntl=_fcntl(flock),
        os=SimpleNamespace(close=lambda _: None),
        time=SimpleNamespace(monotonic=lambda: next(times), sleep=lambda _: None),
        int=SimpleNamespace(from_bytes=lambda page, _: page),
        _opened=lambda path: path,
    )
    live = module.Live.__new__(module.Live)
    live._folder, live._page, live._locks, live._file = _Path(), _Page(who, do), _Locks(), -1
    return live, module


def _fcntl(flock: Callable[[Any, int], None]) -> Any:
    names = ("LOCK_EX", "LOCK_NB", "LOCK_SH", "LOCK_UN")
    return SimpleNamespace(**{name: getattr(fcntl, name) for name in names}, flock=flock)


_HOW: Final = {fcntl.LOCK_SH: "share", fcntl.LOCK_UN: "release"}


class _Database:
    """Tells of what is read; rows are of no account but for the generation they are of."""

    def __init__(self, who: str, do: Do, reading: int) -> None:
        self._who, self._do, self._reading = who, do, reading

    def execute(self, statement: str) -> Any:
        """One SELECT, which sees what is kept at that instant; that they are one transaction is not used."""
        if statement == "BEGIN":
            return None
        (table,) = [one for one in ("policy", "modules", "blocks") if f"FROM {one}" in statement]
        self._do(f"select {table}-{self._reading}")
        row = (_Generation(f"{self._who}.{table}-{self._reading}", self._do), "site")
        return SimpleNamespace(fetchone=lambda: row, fetchall=list)


def _registry(code: Code, who: str, do: Do) -> tuple[Any, Any]:
    """The `Registry` of this process and its `Live`, made of the shipped modules."""
    readings = iter(range(1, 9))
    live, live_module = _live(code, who, do)
    records = code.module(RECORDS)

    @contextmanager
    def opened(**_: Any) -> Iterator[_Database]:
        yield _Database(who, do, next(readings))

    def flock(_: Any, how: int) -> None:
        if how == fcntl.LOCK_EX:
            do("lock")
        elif do("try-lock", "taken", "busy") == "busy":
            raise BlockingIOError

    module = code.module(
        REGISTRY,
        using=(live_module,),
        fcntl=_fcntl(flock),
        os=SimpleNamespace(open=lambda *_: 3, close=lambda _: do("unlock"), O_RDWR=0, O_CREAT=0, O_CLOEXEC=0),
        _is_at=lambda *_: True,
        record_change=lambda *_: None,
        adopted=lambda _: {},
        sweep=lambda *_: None,
        Live=lambda _: live,
    )
    registry = module.Registry.__new__(module.Registry)
    registry.folder, registry._key = _Path(), _Path()
    registry._records = records.Records.__new__(records.Records)
    registry._records._open = opened
    return registry, live


def _change(code: Code) -> Program:
    """`Registry._changing` and `_commit`: a change that was proved."""

    def run(do: Do) -> str:
        registry, _ = _registry(code, "change", do)

        def keep(_: Any) -> None:
            if do("replace", "kept", "fails", "fails-kept") != "kept":
                raise OSError("the disk")

        registry._records.replace = keep
        try:
            with registry._changing() as old:
                registry._commit(old, old, "said", SimpleNamespace(digest=""))
        except Exception:
            return "refused"
        return "returned"

    return program(run)


def _look(code: Code, who: str) -> Program:
    """`Registry.agreed`: whoever executes asks what is in force, and tells of a change that is not kept."""

    def run(do: Do) -> str:
        registry, live = _registry(code, who, do)
        return "wait" if registry.agreed(live) is None else "follow"

    return program(run)


def _act(code: Code) -> Program:
    """`Live.acting`: under its lock an action of the generation that is followed begins and ends."""

    def run(do: Do) -> str:
        live, _ = _live(code, "act", do)
        with live.acting(_Generation("act.followed", do)) as in_force:
            if in_force:
                do("move")
        return "rest"

    return program(run)


# What is true at each place.


def _since(way: Way, what: str, *ends: str) -> bool:
    """Whether the step was done, and none of `ends` since."""
    done = [one for one, _ in way]
    return what in done and not any(end in done[done.index(what) :] for end in ends)


def _holds_lock(who: str, way: Way) -> str:
    held = _since(way, "lock", "unlock") or (("try-lock", "taken") in way and not _since(way, "unlock"))
    return f"(= lock {_HOLDS[who]})" if held else f"(not (= lock {_HOLDS[who]}))"


def _in_force(act: Program) -> str:
    """That an action moves, or may from now on."""
    places = [at for at, way in enumerate(act.ways) if _may_move(way)]
    return conjunction([disjunction(f"(= act.pc {at})" for at in places), "(= act.seen act.followed)"])


def _may_move(way: Way) -> bool:
    (share, release) = (f"{what} (mod act.followed 2)" for what in ("share", "release"))
    return _since(way, "see", release) and _since(way, share, release)


def _acting_facts(way: Way) -> Iterator[str]:
    if _since(way, "move"):
        yield "(= act.seen act.followed)"
    if _may_move(way):
        yield "(=> (= act.seen act.followed) (<= returned act.followed))"
    if ("(= act.seen act.followed)", "yes") in way:
        yield "(= act.seen act.followed)"


_OLD: Final = "change.policy-1"
_NEW: Final = f"(+ {_OLD} 1)"


def _change_facts(way: Way) -> Iterator[str]:
    yield _holds_lock("change", way)
    answers = dict(way)
    if not _since(way, "select policy-1", "unlock"):
        return
    published = [what for what, _ in way if what.startswith("publish ")]
    kept = {None: _OLD, "fails": _OLD, "kept": _NEW, "fails-kept": _NEW}[answers.get("replace")]
    yield f"(= kept {kept})"
    if _since(way, "select policy-2"):
        yield "(= change.policy-2 kept)"
    if len(published) == 1:
        yield f"(= live {_NEW})"
    elif published:
        yield "(= live kept)"
    old, new = (f"exclude (mod {one} 2)" for one in (_OLD, _NEW))
    # What may move, by what was found before the change was published, and since.
    found = [answer for what, answer in way if what == new]
    waited = ("replace", "kept") in way and answers.get(old) == "free"
    newest = f"(= act.followed {_NEW})"
    if found[:1] == ["free"] or found[1:] == ["free"]:
        yield f"(=> moves {newest if waited else f'(or {newest} {_like(_OLD)})'})"
    elif waited:
        yield f"(=> moves {_like(_NEW)})"


def _like(generation: str) -> str:
    """That what may move has the lock that is also that of `generation`."""
    return f"(= (mod act.followed 2) (mod {generation} 2))"


def _look_facts(who: str, way: Way) -> Iterator[str]:
    yield _holds_lock(who, way)
    order = ("policy-1", "modules-1", "blocks-1")
    read = [one for one in order if _since(way, f"select {one}")]
    yield f"(<= {' '.join(f'{who}.{one}' for one in read)} kept)" if read else "true"
    if len(read) == len(order) and _since(way, "see"):
        yield (f"(=> (= {who}.policy-1 {who}.seen) (= {who}.policy-1 {who}.modules-1 {who}.blocks-1))")
    if _since(way, "select policy-2", "unlock"):
        yield f"(= {who}.policy-2 kept)"
    if (f"(= {who}.policy-1 {who}.seen)", "yes") in way:
        yield f"(= {who}.policy-1 {who}.seen)"


# What each step does.


def _effect(who: str, programs: Mapping[str, Program]) -> Callable[[str, str, int], str]:
    act = programs["act"]
    sharing = [
        at
        for at, way in enumerate(act.ways)
        if _since(way, "share (mod act.followed 2)", "release (mod act.followed 2)")
    ]
    shared = disjunction(f"(= act.pc {at})" for at in sharing)

    def effect(what: str, answer: str, to: int) -> str:
        match what.split(" ", 1):
            case ["lock" | "try-lock"] if answer != "busy":
                return _step(who, {"lock": str(_HOLDS[who])}, "(= lock 0)")
            case ["unlock"]:
                ended = programs[who].ends.get(to) == "returned"
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
    return changed([one for one in _STATE if one != f"{who}.pc"], after, *conditions)


def _ends(who: str, place: str, after: Mapping[str, str], *conditions: str) -> str:
    return changed(tuple(_STATE), {f"{who}.pc": "0", **after}, place, *conditions)


def _transitions(programs: Mapping[str, Program]) -> dict[str, str]:
    """What each process may do; `ends` is every end, by a crash or not, at any place."""
    moves = {who: one.moves(f"{who}.pc", _effect(who, programs)) for who, one in programs.items()}
    ends = [_ends(who, "true", {"lock": f"(ite (= lock {held}) 0 lock)"}) for who, held in _HOLDS.items()]
    followed = {
        who: disjunction(
            f"(= {who}.pc {at})" for at, result in programs[who].ends.items() if result == "follow"
        )
        for who in _LOOKERS
    }
    # `FollowedConfiguration.follow` takes over what it was told while nothing moves: see `following`.
    follows = _ends("look", followed["look"], {"act.followed": "look.policy-1"}, "(= act.pc 0)")
    return {**moves, "end": disjunction([*ends, _ends("act", "true", {}), follows])}


def _programs(code: Code) -> dict[str, Program]:
    return {
        "change": _change(code),
        **{who: _look(code, who) for who in _LOOKERS},
        "act": _act(code),
    }


def _definitions(programs: Mapping[str, Program]) -> tuple[str, ...]:
    parts = {
        "change": programs["change"].everywhere("change.pc", _change_facts),
        **{who: programs[who].everywhere(f"{who}.pc", partial(_look_facts, who)) for who in _LOOKERS},
        "act": programs["act"].everywhere("act.pc", _acting_facts),
    }
    everywhere = "(and (<= kept live (+ kept 1)) (<= returned kept) (<= 0 lock 3) (<= act.followed kept))"
    inside = conjunction([everywhere, *parts.values()])
    invariant = f"(let ((moves {_in_force(programs['act'])})) {inside})"
    return (
        *variables(_STATE),
        f"(define-fun invariant () Bool {invariant})",
        f"(define-fun invariant-after () Bool {later(invariant, _STATE)})",
    )


def revocation_obligations() -> dict[str, Callable[[Code], Obligation]]:
    """Base, and a step of each process."""
    return {
        "agreeing-base": _base,
        **{f"agreeing-{who}": _inductive(who) for who in (*_HOLDS, "act", "end")},
        "agreeing-claim": _claim,
    }


def _base(code: Code) -> Obligation:
    programs = _programs(code)
    first = conjunction(f"(= {name} 0)" for name in _STATE)
    return Obligation(
        "Base: before anything was ever kept or followed the invariant of changing and acting holds.",
        _definitions(programs),
        f"(=> {first} invariant)",
    )


_DOES: Final = {
    "change": "a change: `Registry._changing`, `_commit`",
    "look": "an executor that asks what is in force: `Registry.agreed`",
    "other": "any other executor that asks",
    "act": "an executor that begins or ends an action: `Live.acting`",
    "end": "any process that ends, is killed or begins anew, or an executor that follows what it was told",
}


def _inductive(who: str) -> Callable[[Code], Obligation]:
    def make(code: Code) -> Obligation:
        programs = _programs(code)
        return Obligation(
            f"Step: the invariant survives what is done by {_DOES[who]}.",
            (*_definitions(programs), f"(define-fun step () Bool {_transitions(programs)[who]})"),
            "(=> (and invariant step) invariant-after)",
        )

    return make


def _claim(code: Code) -> Obligation:
    programs = _programs(code)
    moving = disjunction(
        f"(= act.pc {at})"
        for at, way in enumerate(programs["act"].ways)
        if _since(way, "move", "release (mod act.followed 2)")
    )
    told = conjunction(
        f"(=> (= {who}.pc {at}) (= {who}.policy-1 {who}.modules-1 {who}.blocks-1))"
        for who in _LOOKERS
        for at, result in programs[who].ends.items()
        if result == "follow"
    )
    return Obligation(
        "Where the invariant holds, nothing moves that was decided under a configuration older than one\n"
        "whose change has returned; and what is followed is one configuration whole, not half of two.",
        _definitions(programs),
        f"(=> invariant (and (=> {moving} (<= returned act.followed kept)) {told}))",
    )
