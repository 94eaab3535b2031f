"""Finished trials outlive whatever ends the process that finished them."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.experiments.trial_store import FILE, Aside, Kept, Store
from aeros.spec.diagnostics.errors import MisuseError, UserError

ONE, OTHER = Kept("a", 1, {"reached": True}), Kept("a", 2, {"reached": False})


def test_what_was_kept_is_there_again(tmp_path: Path) -> None:
    with Store(tmp_path / "out") as store:
        store.keep([ONE, OTHER])
    with Store(tmp_path / "out") as store:
        assert store.trials == {("a", 1): ONE.found, ("a", 2): OTHER.found}


def test_a_torn_line_is_left_out_and_cut_off(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        store.keep([ONE])
    whole = (tmp_path / FILE).read_bytes()
    (tmp_path / FILE).write_bytes(whole + b'{"condition":"a","seed":2,"fou')
    with Store(tmp_path) as store:
        assert store.trials == {("a", 1): ONE.found}
        store.keep([OTHER])
    assert (tmp_path / FILE).read_bytes().count(b"\n") == 2


def test_what_was_kept_aside_is_taken_in_once(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        path = store.aside(3)
        with Aside(path) as aside:
            aside.keep(ONE)
            aside.keep(OTHER)
        store.keep([ONE])
    path.write_bytes(path.read_bytes() + b'{"condition":"b","se')
    for _ in range(2):
        with Store(tmp_path) as store:
            assert store.trials == {("a", 1): ONE.found, ("a", 2): OTHER.found}
    assert [one.name for one in tmp_path.iterdir()] == [FILE]
    assert (tmp_path / FILE).read_bytes().count(b"\n") == 2


def test_what_is_handed_over_is_not_needed_aside(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        with Aside(store.aside(0)) as aside:
            aside.keep(ONE)
        store.keep([ONE], store.aside(0))
        assert not store.aside(0).exists()


def test_a_worker_elsewhere_keeps_nothing_aside(tmp_path: Path) -> None:
    with Aside(tmp_path / "there" / "aside.jsonl") as aside:
        aside.keep(ONE)
    assert not list(tmp_path.iterdir())


def test_another_writer_is_refused(tmp_path: Path) -> None:
    with Store(tmp_path), pytest.raises(MisuseError, match="is being written by another run"):
        Store(tmp_path)


def test_a_folder_that_cannot_be_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(MisuseError, match="cannot write to"):
        Store(tmp_path / "file" / "folder")


@pytest.mark.parametrize("line", ["nonsense", "[]", '{"condition":"a"}', '{"some":1}'])
def test_a_line_that_is_no_trial_is_refused_with_its_number(line: str, tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        store.keep([ONE])
    with (tmp_path / FILE).open("a") as file:
        file.write(line + "\n")
    with pytest.raises(UserError) as refused:
        Store(tmp_path)
    assert "line 2, is no finished trial" in refused.value.diagnostics[0].headline
    # and the lock is not left behind
    (tmp_path / FILE).unlink()
    Store(tmp_path).__exit__(None, None, None)
