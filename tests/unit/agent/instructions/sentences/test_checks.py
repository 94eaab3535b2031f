from __future__ import annotations

import pytest

from aeros.agent.instructions.sentences.checks import without_checks

IF_DIRTY = "if the table is dirty , clean it"


@pytest.mark.parametrize(
    ("sentences", "plain"),
    [
        (["is the table dirty ?", "if so , clean it"], [IF_DIRTY]),
        (["is the table dirty ?", "then clean it"], [IF_DIRTY]),
        (["is the table clean ?", "if not , clean it"], ["unless the table is clean , clean it"]),
        (
            ["please check whether the table is dirty", "if so , clean it"],
            ["? please check whether the table is dirty", IF_DIRTY],
        ),
        (
            ["check if the table is dirty and clean it if so"],
            ["? check whether the table is dirty", IF_DIRTY],
        ),
        (
            ["see whether the table is clean , and if it isn t , clean it"],
            ["? see whether the table is clean", "unless the table is clean , clean it"],
        ),
        (
            ["look at the table and clean it if it is dirty"],
            ["? look at the table", "clean the table if it is dirty"],
        ),
        (["is the table dirty ?", "clean it"], ["is the table dirty", "clean it"]),
        (["check whether the table is dirty"], ["check whether the table is dirty"]),
        (["look at the table"], ["look at the table"]),
        (["check if the table is dirty"], ["check whether the table is dirty"]),
        (["look at it and tell me if it s clean"], ["look at it and tell me whether it is clean"]),
        (["wipe it if it is dirty"], ["wipe it if it is dirty"]),
    ],
)
def test_a_check_with_what_depends_on_it_is_a_condition(sentences: list[str], plain: list[str]) -> None:
    spoken = [(tuple(one.removesuffix(" ?").split()), one.endswith("?")) for one in sentences]
    assert [" ".join(tokens) for tokens, _ in without_checks(spoken)] == plain
