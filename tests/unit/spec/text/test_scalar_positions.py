"""Each character of a scalar is found where it is written, or no place is claimed."""

from __future__ import annotations

import random

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.text import yaml_reader
from aeros.spec.text.nodes import ScalarNode
from aeros.spec.text.scalar_positions import source_offsets, sub_span
from tests.unit.spec.text.reading import value_of

LETTERS = [chr(code) for code in range(ord("α"), ord("ω"))] + list("abcdefgh日本語")


@st.composite
def scalars(draw: st.DrawFn) -> str:
    """A key and a scalar in which no letter is written twice, so that where it is written is certain."""
    letters = iter(random.Random(draw(st.integers(0, 99))).sample(LETTERS, len(LETTERS)))  # noqa: S311
    style = draw(st.sampled_from(["", "'", '"', "|", ">", "|-", ">+", "|2", ">1-"]))

    def word() -> str:
        return "".join(next(letters) for _ in range(draw(st.integers(1, 3))))

    words = [word() for _ in range(draw(st.integers(1, 8)))]
    if style == "" or style in "'\"":
        joints = [" ", "  ", "\n  ", " \n   ", "\n\n  ", " \r\n ", "\n \n\n  "]
        joints += ["''"] if style == "'" else []
        joints += ["\\n", "\\u0041", "\\\\", '\\"', "\\\n  ", " \\\n\n  ", "\\x41\\t"] if style == '"' else []
        body = words[0] + "".join(draw(st.sampled_from(joints)) + w for w in words[1:])
        edge = draw(st.sampled_from(["", " "])) if style else ""
        return f"key: {style}{edge}{body}{edge}{style}\nKEY: 1\n"
    indent = {"2": "  ", "1": " "}.get(style[1:2], draw(st.sampled_from([" ", "   "])))
    lead = draw(st.sampled_from(["", "  "])) if style[1:2] in ("1", "2") else ""
    joints = [
        "\n" + indent,
        "\n\n" + indent,
        "\n" + indent + "  ",
        "\r\n" + indent,
        "\n\n\n" + indent + " ",
        " ",
        "  ",
    ]
    body = lead + words[0] + "".join(draw(st.sampled_from(joints)) + w for w in words[1:])
    note = draw(st.sampled_from(["", "  # note"]))
    blank = draw(st.sampled_from(["", "\n"]))
    trail = draw(st.sampled_from(["", "\n", "\n\n\n"]))
    return f"key: {style}{note}\n{blank}{indent}{body}{trail}"


@given(scalars())
def test_every_letter_of_a_scalar_is_found_where_it_is_written(text: str) -> None:
    body = text.index(":")
    for loader in (yaml.CSafeLoader, yaml.SafeLoader):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(yaml_reader, "_LOADER", loader)
            value = value_of(text)
        offsets = source_offsets(value)
        assert len(offsets) == len(value.text)
        for character, offset in zip(value.text, offsets, strict=True):
            if character in LETTERS:
                assert offset == text.rindex(character)
                assert offset > body


@pytest.mark.parametrize(
    ("text", "word", "written"),
    [
        ("r: speed <= reach\n", "reach", "reach"),
        ("r: speed\n  <= reach\n", "<= reach", "<= reach"),
        ("r: 'it''s <= reach'\n", "'s <=", "''s <="),
        ('r: "a \\u0062 <= c"\n', "b <=", "\\u0062 <="),
        ("r: >\n  speed\n  <= reach\n", "speed <=", "speed\n  <="),
        ("r: |\n    speed\n      <= reach\n", "  <= r", "  <= r"),
        ("r: |2\n    speed\n", "  speed", "  speed"),
    ],
)
def test_a_part_of_a_scalar_is_underlined_exactly(text: str, word: str, written: str) -> None:
    value = value_of(text)
    start = value.text.index(word)
    assert sub_span(value, start, start + len(word)).text == written


def test_the_end_of_a_scalar_is_a_place_and_an_impossible_part_is_the_whole() -> None:
    value = value_of("r: 'a +'\n")
    end = sub_span(value, 3, 3)
    assert (end.text, end.column) == ("", 8)
    assert sub_span(value, 2, 9) == value.span
    assert sub_span(value_of("r: ''"), 0, 0).text == "''"


def test_a_scalar_whose_text_cannot_be_found_has_no_offsets() -> None:
    value = value_of("r: abc\n")
    assert source_offsets(ScalarNode("abd", value.span)) == []


def test_large_scalars_are_mapped() -> None:
    folded = "r: >\n" + "  a b\n" * 20_000
    plain_lines = "r: " + "a\n  " * 40_000
    escapes = 'r: "' + "\\x41 \n" * 20_000 + '"'
    blanks = "r: 'a" + " " * 200_000 + "b'"
    blank_lines = "r: |\n  a\n" + "\n" * 200_000
    for text in (folded, plain_lines, escapes, blanks, blank_lines):
        value = value_of(text)
        assert len(source_offsets(value)) == len(value.text)


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("r: ab c\n", ["a", "b", " ", "c"]),
        ("r: 'a''b'\n", ["a", "''", "b"]),
        ('r: "a\\tb\\x41\\u0042\\U00000043\\\\"\n',
         ["a", "\\t", "b", "\\x41", "\\u0042", "\\U00000043", "\\\\"]),
        ("r: a\n  b\n", ["a", "\n", "b"]),
        ("r: a\n\n  b\n", ["a", "\n", "b"]),
        ('r: "a\\\n  b"\n', ["a", "b"]),
        ("r: |\n  a\n   b\n", ["a", "\n", " ", "b", "\n"]),
        ("r: >\n  a\n  b\n\n  c\n", ["a", "\n", "b", "\n", "c", "\n"]),
    ],
)  # fmt: skip
def test_each_character_is_where_its_writing_begins(text: str, written: list[str]) -> None:
    value = value_of(text)
    assert len(value.text) == len(written)
    for index, sign in enumerate(written):
        found = sub_span(value, index, index + 1)
        assert found.text == sign
        assert found.start == source_offsets(value)[index]


def test_a_part_that_ends_before_it_begins_is_the_whole() -> None:
    value = value_of("r: abc\n")
    assert sub_span(value, 2, 1) == sub_span(value, -1, 2) == sub_span(value, 0, 4) == value.span
    assert [sub_span(value, 1, 1).text, sub_span(value, 0, 3).text] == ["", "abc"]
