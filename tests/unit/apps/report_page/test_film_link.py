"""Times that a film shows are linked to it; all others are plain text."""

from __future__ import annotations

import pytest

from aeros.apps.report_page.film_link import NO_FILM, FilmLink
from aeros.sim.film.film_span import FilmSpan

LINK = FilmLink(FilmSpan(2.0, 14.0, 4.0))


@pytest.mark.parametrize(("time", "linked"), [(1.99, False), (2.0, True), (14.0, True), (14.01, False)])
def test_only_times_in_the_film_are_linked(time: float, linked: bool) -> None:
    attribute = f' data-time="{time:.3f}"'
    assert LINK.attribute(time) == (attribute if linked else "")
    assert LINK.text(time, "then") == (f"<span{attribute}>then</span>" if linked else "then")


def test_without_a_film_nothing_is_linked() -> None:
    assert NO_FILM.attribute(5.0) == ""
    assert NO_FILM.text(5.0, "then") == "then"
