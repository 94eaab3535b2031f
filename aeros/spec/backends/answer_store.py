"""Cache of solver answers and module proofs between runs, so that an unchanged module needs no solver call.

A key is the SHA-256 of the whole question, of the solver's version and of the code that poses questions. So a
stored answer is used only where the solver would give the same one. Unreadable entries count as missing, and
write errors are ignored: the store never changes a verdict. The user's cache folder is trusted as much as the
program itself.
"""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, nullcontext
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

from aeros.files import make_folder
from aeros.spec.backends.solver_results import SatResult, ScalarValue, SolverAnswer

_SET_UP: Final = (
    "PRAGMA journal_mode = WAL",
    "PRAGMA synchronous = OFF",  # a lost answer is asked for again
    "CREATE TABLE IF NOT EXISTS answers (key TEXT PRIMARY KEY, answer TEXT) STRICT",
    "CREATE TABLE IF NOT EXISTS proofs (key TEXT PRIMARY KEY, head TEXT, claims BLOB) STRICT",
)
"""Statements that prepare a file; they change nothing in one that is prepared."""


def default_store() -> AnswerStore | None:
    """Open the user's store in `$AEROS_CACHE`, else `$XDG_CACHE_HOME`, else `~/.cache`.

    Returns:
        The store; None if `AEROS_CACHE=off`, if the folder belongs to another user, or if it cannot be
        opened.
    """
    named = os.environ.get("AEROS_CACHE") or os.environ.get("XDG_CACHE_HOME")
    if named == "off":
        return None
    try:
        folder = Path(named) if named else Path.home() / ".cache"
        folder = folder / "aeros"
        make_folder(folder, 0o700)
        if folder.stat().st_uid != os.getuid():
            return None
        return AnswerStore(folder / "answers.sqlite3")
    except (OSError, RuntimeError, sqlite3.Error):
        return None


@contextmanager
def open_default_store() -> Iterator[AnswerStore | None]:
    """Open the store that `default_store` returns, and close it at the end of the block.

    Yields:
        The store, or None.
    """
    store = default_store()
    with nullcontext() if store is None else closing(store):
        yield store


class AnswerStore:
    """SQLite file of answers and proofs by key. Several processes may use one file."""

    def __init__(self, path: Path) -> None:
        self._database = sqlite3.connect(path, timeout=1.0)
        try:
            for statement in _SET_UP:
                self._database.execute(statement)
        except sqlite3.Error:
            self.close()
            raise

    def get(self, key: str) -> SolverAnswer | None:
        """Look up an answer.

        Args:
            key: SHA-256 of the question, in hexadecimal.

        Returns:
            The answer; None if there is none or it cannot be read.
        """
        try:
            row = self._database.execute("SELECT answer FROM answers WHERE key = ?", (key,)).fetchone()
            return _answer(json.loads(row[0]))  # without a row a TypeError
        except (sqlite3.Error, ValueError, LookupError, TypeError, AttributeError, ZeroDivisionError):
            return None

    def put(self, answers: Mapping[str, SolverAnswer]) -> None:
        """Store answers. UNKNOWN is not stored, so that the question is asked again.

        Args:
            answers: answers by key.
        """
        rows = [
            (key, _text(answer)) for key, answer in answers.items() if answer.result is not SatResult.UNKNOWN
        ]
        try:
            with self._database:
                self._database.executemany("INSERT OR REPLACE INTO answers VALUES (?, ?)", rows)
        except sqlite3.Error:
            return

    def proof(self, key: str) -> tuple[str, bytes] | None:
        """Look up the proof of a module or a site.

        Args:
            key: SHA-256 of what was proved and of the program, in hexadecimal.

        Returns:
            Head (JSON) and claims (bytes) as they were stored; None if there are none or they cannot be read.
        """
        try:
            row = self._database.execute("SELECT head, claims FROM proofs WHERE key = ?", (key,)).fetchone()
        except sqlite3.Error:
            return None
        return None if row is None else (str(row[0]), bytes(row[1]))

    def put_proofs(self, proofs: Mapping[str, tuple[str, bytes]]) -> None:
        """Store proofs of modules and sites.

        Args:
            proofs: head (JSON) and claims (bytes) by key.
        """
        rows = [(key, *proof) for key, proof in proofs.items()]
        try:
            with self._database:
                self._database.executemany("INSERT OR REPLACE INTO proofs VALUES (?, ?, ?)", rows)
        except sqlite3.Error:
            return

    def close(self) -> None:
        """Close the file. Safe to call twice."""
        self._database.close()


def _text(answer: SolverAnswer) -> str:
    model = {name: _value_to_json(value) for name, value in answer.model.items()}
    return json.dumps({"result": answer.result.value, "model": model})


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
