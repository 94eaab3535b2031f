from __future__ import annotations

import pytest

from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.instructions.sentences.spoken_sentences import spoken_sentences, with_labelled_values


@pytest.mark.parametrize(
    ("text", "sentences"),
    [
        ("Clean it, please. Cook!", ["clean it , please", "cook"]),
        ("The table: clean it", ["the table : clean it"]),
        ("One: clean it. Two: cook", ["clean it", "cook"]),
        ("To do: 1. clean it 2. cook", ["clean it", "cook"]),
        ("a) clean it b) cook", ["clean it", "cook"]),
        ("(1) clean it (2) cook", ["clean it", "cook"]),
        ("- clean it\n- cook", ["clean it", "cook"]),
        ("Um, clean the, er, table", ["clean the table"]),
        (
            "cook and then, you know, if it is hot, well, clean it",
            ["cook and then , if it is hot , clean it"],
        ),
        ("cook, and then, like, clean it", ["cook , and then clean it"]),
        ("you know, clean it, okay?", ["you know , clean it , okay"]),
        ("2x teas, 3 X cups", ["x2 teas , x3 cups"]),
    ],
)
def test_a_text_is_split_into_sentences_without_labels(text: str, sentences: list[str]) -> None:
    assert [" ".join(tokens) for tokens, _ in spoken_sentences(text)] == sentences


@pytest.mark.parametrize("text", ["make -1 dumplings", "make 1/2 dumplings", "make ~2 dumplings"])
def test_a_number_with_a_sign_is_refused(text: str) -> None:
    with pytest.raises(InstructionError, match="the number"):
        list(spoken_sentences(text))


@pytest.mark.parametrize(
    ("text", "sentences"),
    [
        ("Fetch the can. Destination: left.", ["fetch the can , destination left"]),
        ("Destination: left.", ["destination : left"]),
        ("Cook. Quantity: 2. Clean it.", ["cook , quantity 2", "clean it"]),
    ],
)
def test_a_labelled_value_belongs_to_the_sentence_before(text: str, sentences: list[str]) -> None:
    found = with_labelled_values(list(spoken_sentences(text)))
    assert [" ".join(tokens) for tokens, _ in found] == sentences
