"""The page of a run under way is that of the report, as of now."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.apps.live_page.run_page import RunPage

RUN = Path(__file__).parents[1] / "data" / "run_with_a_person"


def test_the_page_grows_with_the_run(tmp_path: Path) -> None:
    out = tmp_path / "under-way"
    page = RunPage(lambda: (out, True), lambda _: {})
    assert "no audit.jsonl in " in page.html()
    out.mkdir()
    lines = (RUN / "audit.jsonl").read_bytes().splitlines(keepends=True)
    (out / "audit.jsonl").write_bytes(b"".join(lines[:10]))
    first = page.html()
    assert "make dumplings: under way · " in first
    assert "sound</span>, 10 records" in first
    assert page.html() is first
    (out / "film.mp4").touch()
    assert page.html() is not first
    (out / "audit.jsonl").write_bytes(b"".join(lines[:20]))
    assert "sound</span>, 20 records" in page.html()


def test_a_line_that_is_being_written_is_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path
    log = (RUN / "audit.jsonl").read_bytes()
    (out / "audit.jsonl").write_bytes(log[:-30])

    def end_of_line(_: float) -> None:
        (out / "audit.jsonl").write_bytes(log)

    monkeypatch.setattr("aeros.apps.live_page.run_page.time.sleep", end_of_line)
    assert "NOT SOUND" not in RunPage(lambda: (out, True), lambda _: {}).html()
    (out / "audit.jsonl").write_bytes(log[:-30])
    assert "NOT SOUND" in RunPage(lambda: (out, False), lambda _: {}).html()


def test_without_a_run_it_says_so(tmp_path: Path) -> None:
    assert "<h1>no run yet</h1>" in RunPage(lambda: None, lambda _: {}).html()
