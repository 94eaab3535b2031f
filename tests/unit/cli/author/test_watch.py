"""Changes of files are noticed, and nothing else is taken for one."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from aeros.cli.author.watch import changed_files, files_read_for, take_snapshot, wait_for_change
from aeros.cli.main import main
from aeros.exit_codes import Exit
from tests.repo.tree import ROOT


def test_files_that_are_changed_added_or_removed_show(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    file = tmp_path / "a" / "ecm.yaml"
    file.write_text("1")
    seen = [take_snapshot([tmp_path])]
    file.write_text("12")
    seen.append(take_snapshot([tmp_path]))
    (tmp_path / "a" / "skills.py").touch()
    seen.append(take_snapshot([tmp_path]))
    file.unlink()
    seen.append(take_snapshot([tmp_path, file]))
    assert len({tuple(one.items()) for one in seen}) == len(seen)


def test_certificates_caches_and_hidden_folders_do_not_count(tmp_path: Path) -> None:
    before = take_snapshot([tmp_path])
    for name in ("ecm.lock", "__pycache__/a.pyc", ".git/index", "runs/a/audit.jsonl"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    assert take_snapshot([tmp_path]) == before


def test_it_waits_until_the_files_stay_as_they_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "ecm.yaml"
    writes = iter([None, None, "a", "ab", "abc"])

    def edit(seconds: float) -> None:
        if (text := next(writes, None)) is not None:
            file.write_text(text)

    monkeypatch.setattr("aeros.cli.author.watch.time.sleep", edit)
    file.write_text("")
    found = wait_for_change(lambda: [file], take_snapshot([file]))
    assert found[file][1] == len("abc")


def test_modules_next_to_one_and_the_sites_of_overlays_are_watched(tmp_path: Path) -> None:
    for name in ("tidy", "clean", "o", "deep/er"):
        (tmp_path / name).mkdir(parents=True)
    for name in ("tidy/ecm.yaml", "clean/ecm.yaml", "clean/skills.py", "deep/er/ecm.yaml", "cell.yaml"):
        (tmp_path / name).touch()
    overlay = tmp_path / "o" / "over.yaml"
    overlay.write_text("schema: aeros/overlay/1\nbase: ../cell.yaml # the cell\n")
    (tmp_path / "cell.yaml").write_text("base: o/over.yaml\n")  # each is the base of the other
    before = take_snapshot(files_read_for([tmp_path / "tidy"], overlay))
    assert {str(one.relative_to(tmp_path)) for one in before} == {
        *("tidy/ecm.yaml", "clean/ecm.yaml", "clean/skills.py"),
        *("o/over.yaml", "cell.yaml"),
    }
    (tmp_path / "cell.yaml").write_text("schema: aeros/site/2\n")
    (tmp_path / "o" / "new.yaml").touch()
    after = take_snapshot(files_read_for([tmp_path / "tidy"], overlay))
    assert changed_files(before, after) == [tmp_path / "cell.yaml", tmp_path / "o" / "new.yaml"]


def test_it_ends_when_nobody_reads_the_output(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as output:
        monkeypatch.setattr("sys.stdout", output)
        with pytest.raises(BrokenPipeError):
            wait_for_change(lambda: [tmp_path], take_snapshot([tmp_path]))


def test_a_change_is_verified_again_until_ctrl_c(tmp_path: Path) -> None:
    module = tmp_path / "tidy"
    corpus = ROOT / "tests" / "corpus"
    module.mkdir()
    for file in (corpus / "accepted" / "always_slow").glob("*.*"):
        (module / file.name).write_bytes(file.read_bytes())
    command = [sys.executable, "-m", "aeros", "verify", str(module), "--watch", "--no-lock", "--no-cache"]
    command += ["--site", str(corpus / "site" / "table.yaml")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        assert process.stdout is not None
        shown = []
        for line in process.stdout:
            shown.append(line)
            if line.startswith("watching "):
                if any("AE" in one for one in shown):
                    break
                time.sleep(0.05)
                manifest = module / "ecm.yaml"
                manifest.write_text(manifest.read_text() + "surplus: 1\n")
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == Exit.INTERRUPTED
    before, changed, after = "".join(shown).partition("ecm.yaml changed")
    assert "proved" in before
    assert changed
    assert "error[AE" in after
    assert "Traceback" not in after


def test_a_report_for_programs_is_not_written_again_and_again(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", str(ROOT / "ecms"), "--watch", "--format", "json"]) == Exit.USAGE
    assert "--watch prints text" in capsys.readouterr().err
