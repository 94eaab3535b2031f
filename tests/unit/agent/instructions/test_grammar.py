from __future__ import annotations

import pytest

from aeros.agent.instructions.grammar import check_scopes, parse_instruction
from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.segments import Link, Mood

R, P, C = Mood.REQUEST, Mood.PROHIBITION, Mood.CONDITION


@pytest.mark.parametrize(
    ("instruction", "segments"),
    [
        ("please clean it, thanks", [[(R, "clean it", Link.START)]]),
        ("clean it and cook", [[(R, "clean it", Link.START), (R, "cook", Link.JOINED)]]),
        ("clean it, then cook", [[(R, "clean it", Link.START), (R, "cook", Link.THEN)]]),
        ("clean it. Cook!", [[(R, "clean it", Link.START)], [(R, "cook", Link.START)]]),
        ("1. clean it\n2. cook", [[(R, "clean it", Link.START)], [(R, "cook", Link.START)]]),
        ("do not cook", [[(P, "cook", Link.START)]]),
        ("clean it without cooking", [[(R, "clean it", Link.START), (P, "cooking", Link.ADJUNCT)]]),
        ("if it is hot, cook", [[(C, "it is hot", Link.START), (R, "cook", Link.JOINED)]]),
        ("cook if it is hot", [[(R, "cook", Link.START), (C, "it is hot", Link.ADJUNCT)]]),
        ("don't forget to cook", [[(R, "cook", Link.START)]]),
    ],
)
def test_an_instruction_is_split_into_segments(
    instruction: str, segments: list[list[tuple[Mood, str, Link]]]
) -> None:
    parsed = [
        [(one.mood, " ".join(one.words), one.link) for one in sentence]
        for sentence in parse_instruction(instruction)
    ]
    assert parsed == segments


@pytest.mark.parametrize(
    "instruction",
    ["is it clean?", "who cooks", "cook?", "", "!", "cook until noon", "cook and", "word " * 201],
)
def test_questions_times_and_endless_or_empty_texts_are_refused(instruction: str) -> None:
    with pytest.raises(InstructionError):
        parse_instruction(instruction)


@pytest.mark.parametrize(
    ("instruction", "order"),
    [
        ("cook after cleaning", ["cleaning", "cook"]),
        ("cook before cleaning", ["cook", "cleaning"]),
        ("before cooking, clean", ["clean", "cooking"]),
        ("after cooking, clean", ["cooking", "clean"]),
    ],
)
def test_requests_come_in_the_order_in_which_they_are_done(instruction: str, order: list[str]) -> None:
    (sentence,) = parse_instruction(instruction)
    assert [" ".join(one.words) for one in check_scopes(sentence)] == order


@pytest.mark.parametrize(
    "instruction",
    [
        "do not cook and clean",
        "do not cook, clean",
        "if it is hot, cook and clean",
        "cook and clean if it is hot",
        "cook after you clean and drive",
    ],
)
def test_an_uncertain_scope_or_order_is_refused(instruction: str) -> None:
    (sentence,) = parse_instruction(instruction)
    with pytest.raises(InstructionError):
        check_scopes(sentence)


@pytest.mark.parametrize(
    ("instruction", "reason"),
    [
        ("bring tea if the table is clean, either way", "contradicts `either way`"),
        ("if the table is clean, bring tea regardless", "contradicts `regardless`"),
        ("if you find the time to make tea, bring the cup", "wanted in any case"),
    ],
)
def test_a_condition_that_decides_nothing_is_refused(instruction: str, reason: str) -> None:
    (sentence,) = parse_instruction(instruction)
    with pytest.raises(InstructionError, match=reason):
        check_scopes(sentence)


def test_either_way_does_not_contradict_even_if() -> None:
    (sentence,) = parse_instruction("even if the table is clean, wipe it in any case")
    assert [one.mood for one in check_scopes(sentence)] == [Mood.CONDITION, Mood.REQUEST]


@pytest.mark.parametrize("text", ["tea now?", "the tea made right now?", "the tea made at once?"])
def test_a_question_with_now_is_no_wish(text: str) -> None:
    with pytest.raises(InstructionError, match="is a question; only requests are understood"):
        parse_instruction(text)
