"""That a change of the registry is kept whole or not at all."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any, Final

from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.model import Block
from aeros.spec.theorems.module_copies import Code
from aeros.spec.theorems.theorem import Obligation
from proofs.lib.process_model import Do, Way, changed, later, program, variables
from proofs.lib.revocation import RECORDS

_DISK: Final = {"pc": "Int", "open": "Bool", "pending": "Int", "disk": "Int", "half": "Bool"}
"""`pending`, `disk`: how many writes are in the transaction, and on the disk; `half`: one is there alone."""


def _transaction(code: Code) -> Obligation:
    def run(do: Do) -> str:
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
            RECORDS,
            sqlite3=SimpleNamespace(connect=lambda *_, **__: Database(), Error=sqlite3.Error),
            _is_new=lambda _: False,
        )
        path = SimpleNamespace(absolute=lambda: SimpleNamespace(as_uri=lambda: "file"))
        one = records.Records.__new__(records.Records)
        one.path = path
        new = records.Snapshot(2, "site", {}, {"b": Block("b", "why", None, None, None)})
        try:
            one.replace(new)
        except UserError:
            return "refused"
        return "kept"

    replace = program(run)
    (whole,) = {_writes(replace.ways[at]) for at, result in replace.ends.items() if result == "kept"}

    def effect(what: str, answer: str, _: int) -> str:
        state = [one for one in _DISK if one != "pc"]
        if answer == "fails":
            return changed(state, {})
        match what:
            case "BEGIN":
                return changed(state, {"open": "true", "pending": "0"})
            case "COMMIT":
                return changed(state, {"open": "false", "disk": "(ite open pending disk)"})
            case "close":
                return changed(state, {"open": "false", "pending": "0"})
        return changed(state, {"pending": "(ite open (+ pending 1) pending)", "half": "(or half (not open))"})

    def facts(way: Way) -> Iterator[str]:
        done = [what for what, answer in way if answer != "fails"]
        is_open = "BEGIN" in done and not {"COMMIT", "close"} & set(done)
        yield "open" if is_open else "(not open)"
        if is_open:
            yield f"(= pending {_writes(way)})"
        yield f"(= disk {whole if 'COMMIT' in done else 0})"
        yield "(not half)"

    invariant = replace.everywhere("pc", facts)
    return Obligation(
        "`Records.replace`: base and step of an invariant by which, wherever it fails or is killed, all\n"
        "that it writes is on the disk, or nothing; once it returns, all.",
        (
            *variables(_DISK),
            f"(define-fun invariant () Bool {invariant})",
            f"(define-fun invariant-after () Bool {later(invariant, _DISK)})",
            f"(define-fun step () Bool {replace.moves('pc', effect)})",
        ),
        "(and (=> (and (= pc 0) (not open) (= disk 0) (not half)) invariant)"
        " (=> (and invariant step) invariant-after)"
        f" (=> invariant (and (not half) (or (= disk 0) (= disk {whole}))))"
        f" (=> (and invariant {_ended(replace, 'kept')}) (= disk {whole})))",
    )


def _ended(one: Any, result: str) -> str:
    return "(or " + " ".join(f"(= pc {at})" for at, found in one.ends.items() if found == result) + ")"


def _writes(way: Way) -> int:
    return sum(what in ("DELETE", "INSERT") and answer != "fails" for what, answer in way)


def transaction_obligations() -> dict[str, Callable[[Code], Obligation]]:
    """Of what the disk holds at any moment of a change."""
    return {
        "transaction": _transaction,
    }
