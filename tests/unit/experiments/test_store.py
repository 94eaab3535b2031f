"""Finished trials outlive whatever ends the process that finished them."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.experiments.store import FILE, Kept, Store
from aeros.spec.errors import MisuseError, UserError

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
