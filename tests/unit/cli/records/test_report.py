"""`aeros report` says of a finished run what there is to say, and by its exit code whether to believe it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.spec.text.discovery import reference_site_path
from tests.unit.apps.report_page.left_runs import copied_run


@pytest.fixture(scope="module")
def left(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return copied_run(tmp_path_factory.mktemp("run"))


def _report(out: Path, *arguments: str) -> int:
    return main(["report", str(out), "--state", str(out.parent / "state"), *arguments])


def test_a_page_is_written_where_it_is_asked_for(
    left: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _report(left, "-o", str(tmp_path / "page.html")) == Exit.SUCCESS
    assert f"report     {tmp_path}/page.html, " in capsys.readouterr().out
    page = (tmp_path / "page.html").read_text()
    assert "No bounds are drawn" not in page
    assert "human_distance and its bounds" in page


def test_a_record_that_is_not_sound_is_rejected_and_shown(
    left: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    shutil.copytree(left, out)
    log = out / "audit.jsonl"
    log.write_text(log.read_text().replace('"verdict":"ALLOW"', '"verdict":"DENY"'))
    assert _report(out) == Exit.REJECTED
    assert "NOT SOUND: record 9 was edited" in capsys.readouterr().out
    assert "NOT SOUND: record 9 was edited" in (out / "report.html").read_text()


def test_a_site_that_the_run_was_not_under_is_refused(
    left: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "site.yaml"
    other.write_text(reference_site_path().read_text().replace("value: 500 mm\n", "value: 400 mm\n"))
    assert _report(left, "--site", str(other), "-o", str(tmp_path / "p.html")) == Exit.REJECTED
    assert "its digest is not in the log" in capsys.readouterr().err
    assert not (tmp_path / "p.html").exists()


def test_a_folder_without_a_record_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert _report(tmp_path) == Exit.REJECTED
    assert "there is no audit.jsonl" in capsys.readouterr().err


def test_signatures_are_checked_where_a_key_is_given(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("mine", "other"):
        assert main(["audit", "keygen", "--out", str(tmp_path / name)]) == Exit.SUCCESS
    anchor = str(tmp_path / "anchor")
    out = copied_run(tmp_path, "--audit-key", str(tmp_path / "mine"), "--anchor", anchor)
    assert _report(out, "--public-key", str(tmp_path / "mine.pub"), "--anchor", anchor) == Exit.SUCCESS
    assert "are all there" in (out / "report.html").read_text()
    assert _report(out, "--public-key", str(tmp_path / "other.pub")) == Exit.REJECTED
    assert "the checkpoint in record 1 is not signed with this key" in capsys.readouterr().out
    assert _report(out, "--anchor", anchor) == Exit.USAGE
