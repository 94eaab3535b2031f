"""Hidden characters are those of Unicode's tables, and no character that writing needs."""

from __future__ import annotations

import sys
import unicodedata

import pytest

from aeros.spec.diagnostics.characters import (
    MAX_MARKS,
    describe_character,
    escape_hidden,
    find_hidden,
    hiding_reason,
    is_hidden,
)

# DerivedCoreProperties.txt of Unicode 15.1, Default_Ignorable_Code_Point.
DEFAULT_IGNORABLE = [
    *((0xAD, 0xAD), (0x34F, 0x34F), (0x61C, 0x61C), (0x115F, 0x1160), (0x17B4, 0x17B5), (0x180B, 0x180F)),
    *((0x200B, 0x200F), (0x202A, 0x202E), (0x2060, 0x206F), (0x3164, 0x3164), (0xFE00, 0xFE0F)),
    *((0xFEFF, 0xFEFF), (0xFFA0, 0xFFA0), (0xFFF0, 0xFFF8), (0x1BCA0, 0x1BCA3), (0x1D173, 0x1D17A)),
    (0xE0000, 0xE0FFF),
]
# PropList.txt, Bidi_Control.
BIDI_CONTROL = [(0x61C, 0x61C), (0x200E, 0x200F), (0x202A, 0x202E), (0x2066, 0x2069)]


@pytest.mark.parametrize(("first", "last"), [*DEFAULT_IGNORABLE, *BIDI_CONTROL])
def test_ignorable_characters_and_bidirectional_controls_are_hidden(first: int, last: int) -> None:
    for number in {first, (first + last) // 2, last}:
        assert is_hidden(chr(number)), hex(number)
        assert find_hidden(f"ab{chr(number)}c") == 2


@pytest.mark.parametrize(
    "character", [chr(n) for n in (*range(32), *range(0x7F, 0xA1)) if chr(n) not in "\t\n"]
)
def test_a_control_character_is_found_wherever_it_stands(character: str) -> None:
    assert find_hidden(f"{character}b") == 0
    assert find_hidden(f"a\n{character}") == 2


@pytest.mark.parametrize("category", ["Cf", "Co", "Cn", "Zl", "Zp", "Zs", "Cs", "Cc"])
def test_the_first_and_the_last_character_of_a_hidden_category_are_hidden(category: str) -> None:
    numbers = range(0xA0, sys.maxunicode + 1) if category != "Cc" else range(0x80, 0xA0)
    ascending = next(chr(n) for n in numbers if unicodedata.category(chr(n)) == category)
    descending = next(chr(n) for n in reversed(numbers) if unicodedata.category(chr(n)) == category)
    assert is_hidden(ascending)
    assert is_hidden(descending)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "a: b\r\n\tc\r\n",
        "é é 日本 😀 ½ μ µ °",
        "naïve — “quoted” ≤ ∀ ✓ → …",
        "Здравствуй שלום سلام हिन्दी",
    ],
)
def test_characters_that_scripts_need_are_not_hidden(text: str) -> None:
    assert find_hidden(text) is None


def test_the_first_hidden_character_is_found() -> None:
    assert find_hidden("a\u200bb\x00") == 1
    assert find_hidden("a\x00b\u200b") == 1
    assert find_hidden("a\rb") == 1
    assert find_hidden("a\r\n\r") == 3


@pytest.mark.parametrize(
    ("character", "description", "why"),
    [
        ("\u202e", "U+202E (RIGHT-TO-LEFT OVERRIDE)", "invisible, or reorders the text around it"),
        ("\x1b", "U+001B (ESCAPE)", "a control character"),
        ("\r", "U+000D (CARRIAGE RETURN)", "a line break for some programs and not for others"),
        ("\u2029", "U+2029 (PARAGRAPH SEPARATOR)", "a line break for some programs and not for others"),
        ("\u3164", "U+3164 (HANGUL FILLER)", "invisible"),
        ("\u2800", "U+2800 (BRAILLE PATTERN BLANK)", "invisible"),
        ("\U0001d159", "U+1D159 (MUSICAL SYMBOL NULL NOTEHEAD)", "invisible"),
        ("\ufffc", "U+FFFC (OBJECT REPLACEMENT CHARACTER)", "invisible"),
        ("\xa0", "U+00A0 (NO-BREAK SPACE)", "a space that is not the space bar's"),
        ("\ue000", "U+E000", "for private use, so every font shows it differently"),
        ("\ud800", "U+D800", "half of a character"),
    ],
)
def test_a_hidden_character_is_named_with_a_reason(character: str, description: str, why: str) -> None:
    assert is_hidden(character)
    assert (describe_character(character), hiding_reason(character)) == (description, why)


@pytest.mark.parametrize("marks", ["\u0336", "\u0336\u0301", "\u20dd", "\u0488", "\u0e31", "\u0903"])
def test_one_letter_holds_thirty_marks_and_no_more(marks: str) -> None:
    many = "a" + (marks * MAX_MARKS)[:MAX_MARKS]
    assert find_hidden(many) is None
    assert find_hidden(f"{many}b{many[1:]}") is None
    assert find_hidden(f"{many}{marks[0]}b") == MAX_MARKS + 1
    assert hiding_reason(marks[0]) == "one of more than 30 marks on one letter"
    assert "".join(escape_hidden(f"{many}{marks[0]}b", lambda one: "?")) == f"{many}?b"
