"""One state folder has one agent at most: theorem 9."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import count
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.theorems.module_copies import ModuleSource, Mutant
from aeros.spec.theorems.smtlib import smt_and, smt_or
from aeros.spec.theorems.theorem import Theorem, TheoremObligation
from proofs.lib.process_model import (
    PerformStep,
    ProcessGraph,
    StepPath,
    declare_state,
    execute_process,
    primed,
    transition,
)

IDENTITY: Final = "aeros.agent.identity"
LOCKS: Final = "aeros.files"

_AGENTS: Final = {"one": 1, "two": 2}
"""Any two processes, by what `lock` is while they hold it; 0 is nobody, 3 anybody else."""

_STATE: Final[Mapping[str, str]] = {
    "lock": "Int",
    **{f"{who}.pc": "Int" for who in _AGENTS},
    **{f"{who}.child": "Bool" for who in _AGENTS},
}
"""`child`: a process that this one forked has its open files still."""


class _FolderStub:
    """The state folder, and files in it."""

    def __truediv__(self, _: str) -> _FolderStub:
        return self


def _agent(code: ModuleSource) -> ProcessGraph:
    """`acquire_identity`: an agent comes awake, lives, and lets go."""

    def run(do: PerformStep) -> str:
        def flock(_: int, how: int) -> None:
            kind = "exclude" if how & fcntl.LOCK_EX else "share"
            if do(kind, "taken", "busy") == "busy":
                raise BlockingIOError

        def write(*_: Any) -> None:
            if do("write-identity", "done", "fails") == "fails":
                raise RuntimeError

        clock = count()
        flags = ("O_RDWR", "O_CREAT", "O_CLOEXEC", "O_NOFOLLOW")
        locks = code.module(
            LOCKS,
            fcntl=SimpleNamespace(
                LOCK_EX=fcntl.LOCK_EX, LOCK_NB=fcntl.LOCK_NB, LOCK_SH=fcntl.LOCK_SH, flock=flock
            ),
        )
        identity = code.module(
            IDENTITY,
            using=(locks,),
            os=SimpleNamespace(
                **{flag: getattr(os, flag) for flag in flags},
                open=lambda *_: 3,
                close=lambda _: do("close"),
                fstat=lambda _: SimpleNamespace(st_size=1),
                pread=lambda *_: b"",
                pwrite=lambda *_: do("say-who"),
                ftruncate=lambda *_: None,
                getpid=lambda: 1,
            ),
            time=SimpleNamespace(monotonic=lambda: next(clock), sleep=lambda _: None),
            make_folder=lambda *_: None,
            _read=lambda _: do("read-identity") or None,
            _write=write,
        )
        try:
            with identity.acquire_identity(_FolderStub(), "name"):
                _run_agent(do)
        except identity.AgentError:
            return "refused"
        except RuntimeError:
            return "broken"
        return "slept"

    return execute_process(run)


def _run_agent(do: PerformStep) -> None:
    if do("live", "well", "raises") == "raises":
        raise RuntimeError


def _done_since(path: StepPath, step: tuple[str, str]) -> bool:
    return step in path and "close" not in [what for what, _ in path[path.index(step) :]]


def _path_facts(who: str, path: StepPath) -> Iterator[str]:
    if _done_since(path, ("exclude", "taken")):
        yield f"(= lock {_AGENTS[who]})"


def _effect(who: str) -> Callable[[str, str, int], str]:
    mine = _AGENTS[who]

    def effect(what: str, answer: str, _: int) -> str:
        state = [one for one in _STATE if one != f"{who}.pc"]
        match what, answer:
            case "exclude", "taken":
                return transition(state, {"lock": str(mine)}, "(= lock 0)")
            case "share", "taken":
                return transition(state, {}, "(= lock 0)")
            case "close", _:
                return transition(state, {"lock": f"(ite (and (= lock {mine}) (not {who}.child)) 0 lock)"})
        return transition(state, {})

    return effect


def _place_invariant(graph: ProcessGraph, who: str, is_there: Callable[[StepPath], bool]) -> str:
    return smt_or(f"(= {who}.pc {at})" for at, way in enumerate(graph.paths) if is_there(way))


def _process_transitions(graph: ProcessGraph) -> str:
    """Build the transitions of a process at any place: fork, end of its child, kill, restart."""
    steps = []
    for who, mine in _AGENTS.items():
        holds = _place_invariant(graph, who, lambda way: _done_since(way, ("exclude", "taken")))
        left = f"(ite (and (= lock {mine}) (not {holds})) 0 lock)"
        dropped = f"(ite (and (= lock {mine}) (not {who}.child)) 0 lock)"
        steps += [
            transition(tuple(_STATE), {f"{who}.child": "true"}),
            transition(tuple(_STATE), {f"{who}.child": "false", "lock": left}),
            transition(tuple(_STATE), {f"{who}.pc": "0", "lock": dropped}),
        ]
    steps += [
        transition(tuple(_STATE), {"lock": "3"}, "(= lock 0)"),
        transition(tuple(_STATE), {"lock": "0"}, "(= lock 3)"),
    ]
    return smt_or(steps)


def _definitions(graph: ProcessGraph) -> tuple[str, ...]:
    facts = [graph.invariant_formula(f"{who}.pc", partial(_path_facts, who)) for who in _AGENTS]
    invariant = smt_and(["(<= 0 lock 3)", *facts])
    return (
        *declare_state(_STATE),
        f"(define-fun invariant () Bool {invariant})",
        f"(define-fun invariant-after () Bool {primed(invariant, _STATE)})",
    )


class _NamedFile:
    """A path below the state folder."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __truediv__(self, part: str) -> _NamedFile:
        return _NamedFile(f"{self.name}/{part}")


def _locked_file(code: ModuleSource, process: int) -> str:
    """Return the file that a process locks; whatever a process can ask about itself is its own number."""
    opened: dict[int, str] = {}
    locked: list[str] = []
    flags = ("O_RDWR", "O_CREAT", "O_CLOEXEC", "O_NOFOLLOW")

    def open_file(path: _NamedFile, *_: Any) -> int:
        opened[len(opened)] = path.name
        return len(opened) - 1

    locks = code.module(
        LOCKS,
        fcntl=SimpleNamespace(
            LOCK_EX=fcntl.LOCK_EX,
            LOCK_NB=fcntl.LOCK_NB,
            LOCK_SH=fcntl.LOCK_SH,
            flock=lambda descriptor, _: locked.append(opened[descriptor]),
        ),
    )
    identity = code.module(
        IDENTITY,
        using=(locks,),
        os=SimpleNamespace(
            **{flag: getattr(os, flag) for flag in flags},
            open=open_file,
            close=lambda _: None,
            fstat=lambda _: SimpleNamespace(st_size=0),
            pwrite=lambda *_: None,
            ftruncate=lambda *_: None,
            getpid=lambda: process,
        ),
        socket=SimpleNamespace(gethostname=lambda: str(process)),
        time=SimpleNamespace(monotonic=lambda: process, sleep=lambda _: None),
        _utc_now=lambda: str(process),
        make_folder=lambda *_: None,
        _read=lambda _: None,
        _write=lambda *_: None,
    )
    with identity.acquire_identity(_NamedFile("state"), f"name-{process}"):
        (name,) = locked
    return name


def _one_file(code: ModuleSource) -> TheoremObligation:
    names = {who: _locked_file(code, number) for who, number in _AGENTS.items()}
    return TheoremObligation(
        "Two processes that differ in all that they ask about themselves lock one file of the folder.",
        [f'(define-fun locked.{who} () String "{name}")' for who, name in names.items()],
        "(= locked.one locked.two)",
    )


def _base(code: ModuleSource) -> TheoremObligation:
    return TheoremObligation(
        "Base: where nobody has begun and nobody holds the lock, the invariant holds.",
        _definitions(_agent(code)),
        "(=> (and (= lock 0) (= one.pc 0) (= two.pc 0)) invariant)",
    )


def _step(who: str) -> Callable[[ModuleSource], TheoremObligation]:
    def make(code: ModuleSource) -> TheoremObligation:
        one = _agent(code)
        step = _process_transitions(one) if who == "kernel" else one.step_formula(f"{who}.pc", _effect(who))
        does = "the kernel: forks, ends, crashes, other agents" if who == "kernel" else f"agent `{who}`"
        return TheoremObligation(
            f"Step: the invariant survives what is done by {does}.",
            (*_definitions(one), f"(define-fun step () Bool {step})"),
            "(=> (and invariant step) invariant-after)",
        )

    return make


def _claim(code: ModuleSource) -> TheoremObligation:
    one = _agent(code)
    awake = [_place_invariant(one, who, _is_awake) for who in _AGENTS]
    return TheoremObligation(
        "Where the invariant holds, no two agents are awake, nor between reading and writing who they are;\n"
        "and while a child of one that ended has its lock, nobody else is.",
        _definitions(one),
        f"(=> invariant (and (not (and {' '.join(awake)})) (=> (= lock 1) (not {awake[1]}))"
        f" (=> (= lock 2) (not {awake[0]}))))",
    )


def _is_awake(path: StepPath) -> bool:
    """Check that a process at this place has read its identity and has not ended."""
    done = [what for what, _ in path]
    if "live" in done:
        return False  # all that it has left to do is let go
    return "read-identity" in done and ("write-identity", "fails") not in path


THEOREM = Theorem(
    "at most one agent holds a state folder, even if processes are killed at any time",
    {
        "base": _base,
        **{f"step-{who}": _step(who) for who in (*_AGENTS, "kernel")},
        "claim": _claim,
        "one-file": _one_file,
    },
    (
        Mutant(
            "shares-the-lock",
            "claim",
            LOCKS,
            "fcntl.LOCK_EX | fcntl.LOCK_NB",
            "fcntl.LOCK_SH | fcntl.LOCK_NB",
        ),
        Mutant(
            "starts-beside-whoever-holds-it",
            "claim",
            IDENTITY,
            "if time.monotonic() >= latest:",
            "if time.monotonic() >= latest + 1:\n"
            "                    break\n"
            "                if timeout_s < 0:",
        ),
        Mutant(
            "lets-go-before-it-lives",
            "claim",
            IDENTITY,
            "        yield abandoned\n",
            "        os.close(descriptor)\n        yield abandoned\n",
        ),
        Mutant(
            "locks-a-file-of-its-own",
            "one-file",
            IDENTITY,
            "descriptor = os.open(folder / _LOCK, flags, 0o600)",
            'descriptor = os.open(folder / f"agent-{os.getpid()}.lock", flags, 0o600)',
        ),
    ),
)
