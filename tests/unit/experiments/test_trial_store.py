"""Finished trials outlive whatever ends the process that finished them."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.experiments.trial_store import TRIALS_FILE, SpillFile, StoredTrial, TrialStore
from aeros.spec.diagnostics.errors import MisuseError, UserError

ONE, OTHER = StoredTrial("a", 1, {"reached": True}), StoredTrial("a", 2, {"reached": False})


def test_kept_results_are_there_again(tmp_path: Path) -> None:
    with TrialStore(tmp_path / "out") as store:
        store.append([ONE, OTHER])
    with TrialStore(tmp_path / "out") as store:
        assert store.trials == {("a", 1): ONE.findings, ("a", 2): OTHER.findings}


def test_a_torn_line_is_left_out_and_cut_off(tmp_path: Path) -> None:
    with TrialStore(tmp_path) as store:
        store.append([ONE])
    whole = (tmp_path / TRIALS_FILE).read_bytes()
    (tmp_path / TRIALS_FILE).write_bytes(whole + b'{"condition":"a","seed":2,"fou')
    with TrialStore(tmp_path) as store:
        assert store.trials == {("a", 1): ONE.findings}
        store.append([OTHER])
    assert (tmp_path / TRIALS_FILE).read_bytes().count(b"\n") == 2


def test_a_spill_file_is_merged_once(tmp_path: Path) -> None:
    with TrialStore(tmp_path) as store:
        path = store.spill_path(3)
        with SpillFile(path) as aside:
            aside.append(ONE)
            aside.append(OTHER)
        store.append([ONE])
    path.write_bytes(path.read_bytes() + b'{"condition":"b","se')
    for _ in range(2):
        with TrialStore(tmp_path) as store:
            assert store.trials == {("a", 1): ONE.findings, ("a", 2): OTHER.findings}
    assert [one.name for one in tmp_path.iterdir()] == [TRIALS_FILE]
    assert (tmp_path / TRIALS_FILE).read_bytes().count(b"\n") == 2


def test_a_result_that_was_handed_over_is_not_needed_in_the_side_file(tmp_path: Path) -> None:
    with TrialStore(tmp_path) as store:
        with SpillFile(store.spill_path(0)) as aside:
            aside.append(ONE)
        store.append([ONE], store.spill_path(0))
        assert not store.spill_path(0).exists()


def test_a_worker_elsewhere_keeps_nothing_aside(tmp_path: Path) -> None:
    with SpillFile(tmp_path / "there" / "aside.jsonl") as aside:
        aside.append(ONE)
    assert not list(tmp_path.iterdir())


def test_another_writer_is_refused(tmp_path: Path) -> None:
    with TrialStore(tmp_path), pytest.raises(MisuseError, match="is being written by another run"):
        TrialStore(tmp_path)


def test_a_folder_that_cannot_be_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(MisuseError, match="cannot write to"):
        TrialStore(tmp_path / "file" / "folder")


@pytest.mark.parametrize("line", ["nonsense", "[]", '{"condition":"a"}', '{"some":1}'])
def test_a_line_that_is_no_trial_is_refused_with_its_number(line: str, tmp_path: Path) -> None:
    with TrialStore(tmp_path) as store:
        store.append([ONE])
    with (tmp_path / TRIALS_FILE).open("a") as file:
        file.write(line + "\n")
    with pytest.raises(UserError) as refused:
        TrialStore(tmp_path)
    assert "line 2, is not a finished trial" in refused.value.diagnostics[0].headline
    # and the lock is not left behind
    (tmp_path / TRIALS_FILE).unlink()
    TrialStore(tmp_path).__exit__(None, None, None)
