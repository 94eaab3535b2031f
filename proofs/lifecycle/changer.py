"""That a change of the registry is kept whole or not at all."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any, Final

from aeros.runtime.registry.operator_block import OperatorBlock
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.theorems.module_copies import ModuleSource
from aeros.spec.theorems.theorem import TheoremObligation
from proofs.lib.process_model import PerformStep, StepPath, declare_state, execute_process, primed, transition
from proofs.lifecycle.revocation import REGISTRY_STORE

_DISK: Final = {"pc": "Int", "open": "Bool", "pending": "Int", "disk": "Int", "half": "Bool"}
"""`pending`, `disk`: how many writes are in the transaction, and on the disk; `half`: one is there alone."""


def _transaction(code: ModuleSource) -> TheoremObligation:
    def run(do: PerformStep) -> str:
        class Database:
            """Tells of each statement; any may fail."""

            def execute(self, statement: str, *_: Any) -> Any:
                kind = statement.split()[0]
                if kind in ("BEGIN", "COMMIT", "DELETE", "INSERT") and do(kind, "done", "fails") == "fails":
                    raise sqlite3.Error
                return SimpleNamespace(fetchone=lambda: (records._VERSION,))

            executemany = execute

            def close(self) -> None:
                do("close")

        records = code.module(
            REGISTRY_STORE,
            sqlite3=SimpleNamespace(connect=lambda *_, **__: Database(), Error=sqlite3.Error),
            _is_new=lambda _: False,
        )
        path = SimpleNamespace(absolute=lambda: SimpleNamespace(as_uri=lambda: "file"))
        one = records.RegistryStore.__new__(records.RegistryStore)
        one.path = path
        new = records.RegistrySnapshot(2, "site", {}, {"b": OperatorBlock("b", "why", None, None, None)})
        try:
            one.replace(new)
        except UserError:
            return "refused"
        return "kept"

    replace = execute_process(run)
    (whole,) = {
        _writes_on_path(replace.paths[at]) for at, result in replace.end_results.items() if result == "kept"
    }

    def effect(what: str, answer: str, _: int) -> str:
        state = [one for one in _DISK if one != "pc"]
        if answer == "fails":
            return transition(state, {})
        match what:
            case "BEGIN":
                return transition(state, {"open": "true", "pending": "0"})
            case "COMMIT":
                return transition(state, {"open": "false", "disk": "(ite open pending disk)"})
            case "close":
                return transition(state, {"open": "false", "pending": "0"})
        return transition(
            state, {"pending": "(ite open (+ pending 1) pending)", "half": "(or half (not open))"}
        )

    def facts(way: StepPath) -> Iterator[str]:
        done = [what for what, answer in way if answer != "fails"]
        is_open = "BEGIN" in done and not {"COMMIT", "close"} & set(done)
        yield "open" if is_open else "(not open)"
        if is_open:
            yield f"(= pending {_writes_on_path(way)})"
        yield f"(= disk {whole if 'COMMIT' in done else 0})"
        yield "(not half)"

    invariant = replace.invariant_formula("pc", facts)
    return TheoremObligation(
        "`RegistryStore.replace`: base and step of an invariant by which, wherever it fails or is killed,\n"
        "all that it writes is on the disk, or nothing; once it returns, all.",
        (
            *declare_state(_DISK),
            f"(define-fun invariant () Bool {invariant})",
            f"(define-fun invariant-after () Bool {primed(invariant, _DISK)})",
            f"(define-fun step () Bool {replace.step_formula('pc', effect)})",
        ),
        "(and (=> (and (= pc 0) (not open) (= disk 0) (not half)) invariant)"
        " (=> (and invariant step) invariant-after)"
        f" (=> invariant (and (not half) (or (= disk 0) (= disk {whole}))))"
        f" (=> (and invariant {_ended_with_result(replace, 'kept')}) (= disk {whole})))",
    )


def _ended_with_result(one: Any, result: str) -> str:
    return "(or " + " ".join(f"(= pc {at})" for at, found in one.end_results.items() if found == result) + ")"


def _writes_on_path(path: StepPath) -> int:
    return sum(what in ("DELETE", "INSERT") and answer != "fails" for what, answer in path)


def transaction_obligations() -> dict[str, Callable[[ModuleSource], TheoremObligation]]:
    """Of what the disk holds at any moment of a change."""
    return {
        "transaction": _transaction,
    }
