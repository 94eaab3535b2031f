"""The run that a command is about: the named, the newest, or the recorded one, known by its process."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from aeros.cli.latest_run import find_audit_log, find_run_folder, latest_run, save_latest_run
from aeros.exit_codes import UsageError


def test_the_latest_run_is_known_by_its_process(tmp_path: Path) -> None:
    assert latest_run(tmp_path) is None
    save_latest_run(tmp_path, tmp_path / "out")
    assert latest_run(tmp_path) == (tmp_path / "out", True)
    message = json.loads((tmp_path / "latest-run.json").read_text())
    for process in (2**22 + os.getpid(), 10**30, -1, 0):
        (tmp_path / "latest-run.json").write_text(json.dumps({**message, "pid": process}))
        assert latest_run(tmp_path) == (tmp_path / "out", False)
    for damaged in ("", "[]", "{}", '{"out": 3, "pid": 1}', '{"out": "x", "pid": "y"}'):
        (tmp_path / "latest-run.json").write_text(damaged)
        assert latest_run(tmp_path) is None


def test_no_run_fails_for_want_of_a_place_to_say_where_it_is(tmp_path: Path) -> None:
    save_latest_run(tmp_path / "nowhere", tmp_path)
    assert latest_run(tmp_path / "nowhere") is None
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("pid", ["Infinity", "1e999", "NaN", "null", "[]"])
def test_a_process_that_is_no_number_is_no_record(tmp_path: Path, pid: str) -> None:
    save_latest_run(tmp_path, tmp_path / "out")
    message = (tmp_path / "latest-run.json").read_text()
    (tmp_path / "latest-run.json").write_text(message.replace(f'"pid": {os.getpid()}', f'"pid": {pid}'))
    assert latest_run(tmp_path) is None


def test_the_first_process_there_is_runs(tmp_path: Path) -> None:
    save_latest_run(tmp_path, tmp_path / "out")
    message = json.loads((tmp_path / "latest-run.json").read_text())
    (tmp_path / "latest-run.json").write_text(json.dumps({**message, "pid": 1}))
    assert latest_run(tmp_path) == (tmp_path / "out", True)


def test_a_process_of_another_user_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_latest_run(tmp_path, tmp_path / "out")

    def refuse(pid: int, signal: int) -> None:
        assert (pid, signal) == (os.getpid(), 0)
        raise PermissionError

    monkeypatch.setattr(os, "kill", refuse)
    assert latest_run(tmp_path) == (tmp_path / "out", True)


def test_the_output_folder_is_kept_whole_wherever_it_is_asked_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    save_latest_run(tmp_path, Path("runs/one"))
    monkeypatch.chdir("/")
    assert latest_run(tmp_path) == (tmp_path / "runs" / "one", True)


def test_a_record_of_another_version_is_refused(tmp_path: Path) -> None:
    (tmp_path / "latest-run.json").write_text('{"schema": "aeros/latest-run/9", "out": "x", "pid": 1}')
    with pytest.raises(UsageError, match=r"latest-run\.json"):
        latest_run(tmp_path)


def test_a_run_is_found_by_its_folder_or_its_log_or_as_the_newest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for find in (find_audit_log, find_run_folder):
        with pytest.raises(UsageError, match="no run in `runs`"):
            find(None)
    for age, name in enumerate(("new", "old")):
        folder = tmp_path / "runs" / name
        folder.mkdir(parents=True)
        (folder / "audit.jsonl").write_text("")
        os.utime(folder / "audit.jsonl", (1e9 - age, 1e9 - age))
    old = Path("runs", "old")
    assert find_audit_log(old) == find_audit_log(old / "audit.jsonl") == old / "audit.jsonl"
    assert find_run_folder(old) == find_run_folder(old / "audit.jsonl") == old
    assert capsys.readouterr().err == ""
    assert find_audit_log(None) == Path("runs", "new", "audit.jsonl")
    assert capsys.readouterr().err == f"newest run: {Path('runs', 'new')}\n"
    assert find_run_folder(None) == Path("runs", "new")
    with pytest.raises(UsageError, match=r"no audit\.jsonl in `runs`"):
        find_audit_log(Path("runs"))
    assert find_run_folder(Path("runs")) == Path("runs")
    copy = old / "copy.jsonl"
    copy.write_text("")
    assert find_audit_log(copy) == copy
    with pytest.raises(UsageError, match=r"copy\.jsonl` is no audit\.jsonl"):  # another log would be reported
        find_run_folder(copy)


def test_the_newest_run_is_that_whose_record_begins_last(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    runs = (
        ("old", "1000.0", 9e8),
        ("new", "2000.0", 8e8),
        ("odd", '"x"', 1500.0),
        ("huge", "9" * 400, 1400.0),
    )
    for name, written, touched in runs:
        folder = tmp_path / "runs" / name
        folder.mkdir(parents=True)
        (folder / "audit.jsonl").write_text(f'{{"event":"log-began","written":{written}}}\n')
        os.utime(folder / "audit.jsonl", (touched, touched))
    assert find_audit_log(None) == Path("runs", "new", "audit.jsonl")


def test_another_run_that_is_recorded_as_the_latest_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    left, own = Path("runs", "left"), Path(".aeros")
    left.mkdir(parents=True)
    own.mkdir()
    (left / "audit.jsonl").write_text("")
    save_latest_run(own, left)
    assert find_audit_log(None) == left / "audit.jsonl"
    assert capsys.readouterr().err == f"newest run: {left}\n"
    save_latest_run(own, Path("elsewhere"))
    assert find_audit_log(None) == left / "audit.jsonl"
    assert f"not the latest run of `.aeros`, which is `{tmp_path / 'elsewhere'}`" in capsys.readouterr().err
