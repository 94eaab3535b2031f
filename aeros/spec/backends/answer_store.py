"""Answers, and proofs of modules, kept between runs, so that an unchanged module costs no solver call.

A key is the SHA-256 of the whole question, of the solver's version and of the code that puts
questions to it, so an answer is found again only where asking again would give it.  What cannot be
read is not there, and what cannot be written is asked again: a store never changes a verdict.
Trusts what the user's own folder holds, as much as the program itself that lives beside it.
"""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

from aeros.spec.backends.solver_results import SatResult, ScalarValue, SolverAnswer


def default_store() -> AnswerStore | None:
    """The store in `$AEROS_CACHE`, else in the user's cache folder; None where there can be none.

    `AEROS_CACHE=off` asks for none.
    """
    named = os.environ.get("AEROS_CACHE") or os.environ.get("XDG_CACHE_HOME")
    if named == "off":
        return None
    try:
        folder = Path(named) if named else Path.home() / ".cache"
        folder = folder / "aeros"
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if folder.stat().st_uid != os.getuid():
            return None
        return AnswerStore(folder / "answers.sqlite3")
    except (OSError, RuntimeError, sqlite3.Error):
        return None


class AnswerStore:
    """A SQLite file of answers and proofs by key.  Several processes may use one at a time."""

    def __init__(self, path: Path) -> None:
        self._database: sqlite3.Connection | None = sqlite3.connect(path, timeout=1.0)
        self._database.execute("PRAGMA journal_mode = WAL")
        self._database.execute("PRAGMA synchronous = OFF")  # what is lost is asked again
        self._database.execute(
            "CREATE TABLE IF NOT EXISTS answers (key TEXT PRIMARY KEY, answer TEXT) STRICT"
        )
        self._database.execute(
            "CREATE TABLE IF NOT EXISTS proofs (key TEXT PRIMARY KEY, head TEXT, claims BLOB) STRICT"
        )

    def get(self, key: str) -> SolverAnswer | None:
        """The answer kept under `key`, or None."""
        try:
            row = self._connection.execute("SELECT answer FROM answers WHERE key = ?", (key,)).fetchone()
            return None if row is None else _answer(json.loads(row[0]))
        except (sqlite3.Error, ValueError, KeyError, TypeError):
            return None

    def put(self, answers: Mapping[str, SolverAnswer]) -> None:
        """Keep `answers`; UNKNOWN is not kept, as a person may well ask again."""
        rows = [(key, _text(one)) for key, one in answers.items() if one.result is not SatResult.UNKNOWN]
        try:
            with self._connection:
                self._connection.executemany("INSERT OR REPLACE INTO answers VALUES (?, ?)", rows)
        except sqlite3.Error:
            return

    def proof(self, key: str) -> tuple[str, bytes] | None:
        """What is kept of a module or a site under `key`, as it was put: its head and its claims; or None."""
        try:
            row = self._connection.execute("SELECT head, claims FROM proofs WHERE key = ?", (key,)).fetchone()
        except sqlite3.Error:
            return None
        return None if row is None else (str(row[0]), bytes(row[1]))

    def put_proofs(self, proofs: Mapping[str, tuple[str, bytes]]) -> None:
        """Keep `proofs`."""
        rows = [(key, *proof) for key, proof in proofs.items()]
        try:
            with self._connection:
                self._connection.executemany("INSERT OR REPLACE INTO proofs VALUES (?, ?, ?)", rows)
        except sqlite3.Error:
            return

    def close(self) -> None:
        """Release the file; safe to call twice."""
        if self._database is not None:
            self._database.close()
            self._database = None

    @property
    def _connection(self) -> sqlite3.Connection:
        if self._database is None:
            raise sqlite3.ProgrammingError("the store is closed")
        return self._database


def _text(answer: SolverAnswer) -> str:
    model = {name: _value_to_json(value) for name, value in answer.model.items()}
    return json.dumps({"result": answer.result.value, "model": model}, separators=(",", ":"))


def _value_to_json(value: ScalarValue) -> Any:
    if isinstance(value, Fraction):
        return [str(value.numerator), str(value.denominator)]
    return value


def _answer(stored: Any) -> SolverAnswer:
    model = {
        name: Fraction(int(value[0]), int(value[1])) if isinstance(value, list) else value
        for name, value in stored["model"].items()
    }
    return SolverAnswer(SatResult(stored["result"]), model)
