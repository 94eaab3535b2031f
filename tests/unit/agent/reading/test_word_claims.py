"""Account for words: every claim is about words that are there, and carries them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.reading.word_claims import WordClaim, check_claims
from aeros.spec.diagnostics.words import normalized_words
from tests.hypothesis_profiles import examples

NOUNS = frozenset({("table",), ("red", "can")})
GOALS = {"request 1": "table_wiped", "request 2": "count == 2", "condition 1": "a", "prohibition 1": "m.t"}
CLEAN = ("clean the table", "request 1")


def problems(instruction: str, *claims: tuple[str, str]) -> str:
    parts = {part for _, part in claims}
    goals = {part: goal for part, goal in GOALS.items() if part in parts}
    return "; ".join(check_claims(instruction, [WordClaim(*one) for one in claims], goals, NOUNS).problems)


@pytest.mark.parametrize(
    ("instruction", "claims"),
    [
        ("Clean the table!", [CLEAN]),
        ("please, clean the table", [("please", "courtesy"), CLEAN]),
        ("don't forget to clean the table", [("don't forget to", "courtesy"), CLEAN]),
        ("if it is hot, clean the table", [("if it is hot", "condition 1"), CLEAN]),
        ("clean the table, never cook", [CLEAN, ("never cook", "prohibition 1")]),
        ("clean the table, then make 2", [CLEAN, ("then", "order"), ("make 2", "request 2")]),
        ("make two after you clean the table", [("make two", "request 2"), ("after you", "order"), CLEAN]),
        ("clean one table", [("clean one table", "request 1")]),
    ],
)
def test_right_accounts_have_no_problems(instruction: str, claims: list[tuple[str, str]]) -> None:
    assert problems(instruction, *claims) == ""


@pytest.mark.parametrize(
    ("instruction", "claims", "problem"),
    [
        ("clean the table", [CLEAN, ("twice", "courtesy")], "has no `twice`"),
        ("clean the table", [CLEAN, ("", "courtesy")], "has no ``"),
        ("clean the table", [CLEAN, ("table", "request 1")], "not yet accounted for"),
        ("clean the table", [("clean", "request 1"), ("the table", "courtesy")], "names an object"),
        ("clean the table twice", [("clean the table twice", "request 1")], "`twice`"),
        ("do not clean the table", [("do not clean the table", "request 1")], "`not`"),
        ("clean the table now or never", [CLEAN, ("now or never", "courtesy")], "`or`"),
        ("clean the table if hot", [("clean the table if hot", "request 1")], "`if`"),
        ("clean the table until noon", [CLEAN, ("until noon", "courtesy")], "`until`"),
        ("clean three tables", [("clean three tables", "request 1")], "`three`"),
        (
            "make two, clean the table",
            [("make two", "request 2"), CLEAN],
            "has the order request 2, request 1",
        ),
        (
            "make two then clean the table",
            [("make two", "request 2"), ("then", "order"), CLEAN],
            "no word accounts for another order",
        ),
    ],
)
def test_a_wrong_claim_is_a_problem(instruction: str, claims: list[tuple[str, str]], problem: str) -> None:
    assert problem in problems(instruction, *claims)


def test_a_part_without_words_and_a_part_that_is_not_there_are_problems() -> None:
    claims = [WordClaim("clean the table", "request 2")]
    account = check_claims("clean the table", claims, {"request 1": "table_wiped"}, NOUNS)
    assert account.problems == (
        "`clean the table` accounts for `request 2`, which the answer lacks",
        "no word accounts for request 1",
    )


@examples(100)
@given(st.lists(st.sampled_from(["please", "clean", "the", "table", "now"]), max_size=6), st.data())
def test_each_word_is_claimed_once_or_unaccounted(words: list[str], data: st.DataObject) -> None:
    at = data.draw(st.integers(0, len(words)))
    end = data.draw(st.integers(at, len(words)))
    claims = [WordClaim(" ".join(words[at:end]), "request 1")] if at < end else []
    account = check_claims(" ".join(words), claims, {}, NOUNS)
    assert len(account.unaccounted) == len(normalized_words(" ".join(words))) - (end - at)
