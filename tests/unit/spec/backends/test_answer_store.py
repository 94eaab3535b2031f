"""The store gives back exactly the answers and proofs that were put in, and never an error."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.backends.answer_store import AnswerStore, default_store, open_default_store
from aeros.spec.backends.solver_results import SatResult, SolverAnswer
from tests.hypothesis_profiles import examples

SAT = SolverAnswer(SatResult.SAT, {"x": Fraction(-1, 3), "held": True, "mode": "idle"})
UNSAT = SolverAnswer(SatResult.UNSAT, {})


@pytest.fixture
def store(tmp_path: Path) -> Iterator[AnswerStore]:
    opened = AnswerStore(tmp_path / "answers.sqlite3")
    yield opened
    opened.close()


def test_a_stored_answer_is_found_by_its_key(store: AnswerStore) -> None:
    store.put({"a": SAT, "b": UNSAT})
    assert (store.get("a"), store.get("b"), store.get("c")) == (SAT, UNSAT, None)


@examples(20)
@given(value=st.fractions() | st.booleans() | st.text(st.characters(codec="utf-8")))
def test_any_value_of_a_model_comes_back_exactly(value: Fraction | bool | str) -> None:
    store = AnswerStore(Path(":memory:"))
    store.put({"a": SolverAnswer(SatResult.SAT, {"x": value})})
    found = store.get("a")
    store.close()
    assert found is not None
    assert (found.model, type(found.model["x"])) == ({"x": value}, type(value))


def test_an_answer_outlives_the_process_and_a_newer_one_replaces_it(tmp_path: Path) -> None:
    first = AnswerStore(tmp_path / "kept")
    first.put({"a": SAT})
    first.put({"a": UNSAT})
    first.close()
    again = AnswerStore(tmp_path / "kept")
    assert again.get("a") == UNSAT
    again.close()


def test_one_process_may_read_while_another_writes(tmp_path: Path) -> None:
    store = AnswerStore(tmp_path / "kept")
    other = sqlite3.connect(tmp_path / "kept", isolation_level=None, timeout=0)
    other.execute("BEGIN IMMEDIATE")
    other.execute("INSERT INTO answers VALUES ('b', '')")
    assert store.get("a") is None
    assert other.execute("PRAGMA journal_mode").fetchone() == ("wal",)
    other.execute("COMMIT")
    other.close()
    store.close()


def test_an_undecided_answer_is_not_stored(store: AnswerStore) -> None:
    store.put({"a": SolverAnswer(SatResult.UNKNOWN, {}, "out of budget"), "b": UNSAT})
    assert (store.get("a"), store.get("b")) == (None, UNSAT)


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", '{"result": "sat"}', '{"result": "maybe", "model": {}}',
     '{"result": "sat", "model": {"x": ["1", "0"]}}', '{"result": "sat", "model": {"x": ["1"]}}',
     '{"result": "sat", "model": {"x": ["1", "zero"]}}', '{"result": "sat", "model": 1}'],
)  # fmt: skip
def test_an_unreadable_answer_counts_as_missing(text: str, tmp_path: Path) -> None:
    store = AnswerStore(tmp_path / "kept")
    store.put({"a": SAT})
    with sqlite3.connect(tmp_path / "kept") as database:
        database.execute("UPDATE answers SET answer = ?", (text,))
    database.close()
    found = store.get("a")
    store.close()
    assert found is None


def test_a_stored_proof_is_found_by_its_key(store: AnswerStore) -> None:
    store.put_proofs({"m": ("{}", b"\x00\xff"), "n": ("[1]", b"")})
    assert (store.proof("m"), store.proof("n"), store.proof("o")) == (("{}", b"\x00\xff"), ("[1]", b""), None)
    store.put_proofs({"m": ("{2}", b"2")})
    assert store.proof("m") == ("{2}", b"2")


def test_a_closed_store_finds_nothing_and_keeps_nothing(store: AnswerStore) -> None:
    store.put({"a": SAT})
    store.put_proofs({"m": ("{}", b"")})
    store.close()
    store.close()
    store.put({"b": SAT})
    store.put_proofs({"n": ("{}", b"")})
    assert [store.get("a"), store.get("b"), store.proof("m"), store.proof("n")] == [None] * 4


def _folder_of(store: AnswerStore | None) -> None:
    assert store is not None
    store.put({"a": UNSAT})
    store.close()


def test_the_user_s_store_is_in_the_folder_that_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("AEROS_CACHE", "XDG_CACHE_HOME", "HOME"):
        monkeypatch.setenv(name, str(tmp_path / name))
    _folder_of(default_store())
    monkeypatch.delenv("AEROS_CACHE")
    _folder_of(default_store())
    monkeypatch.delenv("XDG_CACHE_HOME")
    _folder_of(default_store())
    for folder in ("AEROS_CACHE/aeros", "XDG_CACHE_HOME/aeros", "HOME/.cache/aeros"):
        assert (tmp_path / folder / "answers.sqlite3").is_file()
        assert (tmp_path / folder).stat().st_mode & 0o777 == 0o700


def test_no_store_is_opened_where_none_is_wanted_or_can_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AEROS_CACHE", "off")
    assert default_store() is None
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("AEROS_CACHE", str(tmp_path / "file"))
    assert default_store() is None
    (tmp_path / "aeros").mkdir()
    (tmp_path / "aeros" / "answers.sqlite3").write_text("this is no database, and never was one")
    monkeypatch.setenv("AEROS_CACHE", str(tmp_path))
    assert default_store() is None


def test_a_folder_of_another_user_is_not_trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AEROS_CACHE", str(tmp_path))
    other = os.getuid() + 1
    monkeypatch.setattr(os, "getuid", lambda: other)
    assert default_store() is None


def test_the_default_store_is_open_inside_its_block_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AEROS_CACHE", str(tmp_path))
    for _ in range(2):
        with open_default_store() as store:
            assert store is not None
            store.put({"a": UNSAT})
            assert store.get("a") == UNSAT
        assert store.get("a") is None
    monkeypatch.setenv("AEROS_CACHE", "off")
    with open_default_store() as store:
        assert store is None


def test_a_store_waits_for_another_process_for_one_second(monkeypatch: pytest.MonkeyPatch) -> None:
    given = []
    connect = sqlite3.connect

    def noted(path: Path, **options: float) -> sqlite3.Connection:
        given.append((path, options))
        return connect(":memory:")

    monkeypatch.setattr(sqlite3, "connect", noted)
    AnswerStore(Path("answers")).close()
    assert given == [(Path("answers"), {"timeout": 1.0})]
