"""The page of a run under way is that of the report, as of now."""

from __future__ import annotations

import os
from collections.abc import Mapping, Set
from pathlib import Path

import pytest

from aeros.apps.live_page.run_page import RunPage
from aeros.spec.model.site import Site

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


def test_sites_are_searched_for_once(tmp_path: Path) -> None:
    (tmp_path / "audit.jsonl").write_bytes((RUN / "audit.jsonl").read_bytes())
    searches: list[frozenset[str]] = []

    def find(digests: Set[str]) -> Mapping[str, Site]:
        searches.append(frozenset(digests))
        return {}

    page = RunPage(lambda: (tmp_path, True), find)
    page.html()
    (tmp_path / "film.mp4").touch()
    page.html()
    (searched,) = searches
    assert len(searched) == 1


@pytest.mark.parametrize("name", ["trace.jsonl", "measured.jsonl", "poses.jsonl", "film.mp4", "audit.jsonl"])
def test_a_pipe_among_the_files_does_not_stop_the_page(name: str, tmp_path: Path) -> None:
    (tmp_path / "audit.jsonl").write_bytes((RUN / "audit.jsonl").read_bytes())
    (tmp_path / name).unlink(missing_ok=True)
    os.mkfifo(tmp_path / name)
    text = RunPage(lambda: (tmp_path, False), lambda _: {}).html()
    assert ("is not a regular file" in text) == (name in ("trace.jsonl", "measured.jsonl"))
    assert ("no audit.jsonl in " in text) == (name == "audit.jsonl")
