from __future__ import annotations

import pytest

from aeros.agent.instructions.reasons.reason_clauses import without_reasons


@pytest.mark.parametrize(
    ("words", "rest", "reasons"),
    [
        ("clean it because we eat", "clean it", ["we eat"]),
        ("the table is dirty , so clean it", "clean it", ["the table is dirty"]),
        ("dinner is over so clean it", "clean it", ["dinner is over"]),
        ("thanks so much", "thanks so much", []),
        ("clean it", "clean it", []),
    ],
)
def test_a_reason_is_set_apart_from_the_rest(words: str, rest: str, reasons: list[str]) -> None:
    found, segments = without_reasons(tuple(words.split()))
    assert (" ".join(found), [" ".join(one.words) for one in segments]) == (rest, reasons)
