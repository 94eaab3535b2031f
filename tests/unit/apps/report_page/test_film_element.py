"""A film is inside the page, or linked if it is large."""

from __future__ import annotations

from pathlib import Path

import pytest

from aeros.apps.report_page import film_element
from aeros.apps.report_page.film_element import FILM_NAMES, FilmFile, find_film
from aeros.apps.report_page.page import page_of
from aeros.apps.report_page.run_data import RunData


def test_a_page_has_the_film_of_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert find_film(tmp_path, tmp_path) is None
    assert "<video" not in page_of(RunData(), "run", {}, "")
    for name, element in zip(reversed(FILM_NAMES), ("<img", "<img", "<video"), strict=True):
        (tmp_path / name).write_bytes(b"film")
        film = find_film(tmp_path, tmp_path)
        assert film == FilmFile(name, b"film")
        page = page_of(RunData(), "run", {}, "", film)
        assert element in page
        assert ";base64,ZmlsbQ==" in page
        assert "media-src data:" in page
    monkeypatch.setattr(film_element, "_MAX_BYTES", 3)
    film = find_film(tmp_path, tmp_path)
    assert film == FilmFile("film.mp4", None)
    assert '<a href="film.mp4">' in page_of(RunData(), "run", {}, "", film)
    # A page elsewhere links the film from there.
    for folder, link in (
        (tmp_path / "a b" / "c", "../../film.mp4"),
        (tmp_path.parent, f"{tmp_path.name}/film.mp4"),
    ):
        film = find_film(tmp_path, folder)
        assert film == FilmFile(link, None)
        assert f'<a href="{link}">{link}</a>, which lies in another folder' in page_of(
            RunData(), "run", {}, "", film
        )
    monkeypatch.undo()
    assert "<video" in page_of(RunData(), "run", {}, "", find_film(tmp_path, tmp_path / "c"))
