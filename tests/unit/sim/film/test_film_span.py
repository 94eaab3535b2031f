"""The part of a run that a film shows is read from the film's file, or not at all."""

from __future__ import annotations

import json

import pytest

from aeros.sim.film.film_span import FilmSpan, read_film_span
from tests.unit.sim.film.mp4_boxes import film_bytes

SPAN = FilmSpan(1.5, 9.0, 4.0)


@pytest.mark.parametrize("is_long", [False, True])
def test_the_part_is_in_the_comment(*, is_long: bool) -> None:
    assert read_film_span(film_bytes(SPAN.comment(), is_long=is_long)) == SPAN


@pytest.mark.parametrize(
    "comment",
    [
        "holiday",
        "[" * 100_000,
        "[1]",
        '{"aeros_film": 3}',
        *(
            json.dumps({"aeros_film": SPAN._asdict() | changes})
            for changes in (
                {"speed": 0.0}, {"speed": -1.0}, {"end": 1.5}, {"start": None}, {"end": float("inf")},
                {"start": float("nan")}, {"speed": "4"}, {"start": True}, {"speed": 10**400},
            )
        ),
    ],
)  # fmt: skip
def test_another_comment_says_nothing(comment: str) -> None:
    assert read_film_span(film_bytes(comment)) is None


def test_a_file_of_another_form_says_nothing() -> None:
    whole = film_bytes(SPAN.comment())
    for end in range(len(whole)):
        assert read_film_span(whole[:end]) is None
    assert read_film_span(b"\0\0\0\0moov" + whole) is None
    assert read_film_span(whole.replace(b"udta", b"free")) is None
