"""Field types of a schema, and the forms of names."""

from __future__ import annotations

import pytest

from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.diagnostics.source import Source
from aeros.spec.text.fields import (
    PATTERNS,
    BooleanField,
    ExpressionField,
    MappingField,
    Pattern,
    TextField,
    undotted_names,
)
from aeros.spec.text.nodes import ScalarNode

SPAN = Source("a.yaml", "x").span(0, 1)
NODE = ScalarNode("x", SPAN)


def test_text_is_shown_as_it_is_written() -> None:
    assert (str(TextField("a b", SPAN, NODE)), str(ExpressionField("a < b", SPAN, NODE))) == ("a b", "a < b")


@pytest.mark.parametrize("value", [True, False])
def test_a_boolean_field_is_never_taken_for_its_value(value: bool) -> None:
    with pytest.raises(MisuseError, match="use its value"):
        bool(BooleanField(value, SPAN, NODE))


def test_a_mapping_keeps_the_order_that_was_written() -> None:
    one, other = ((TextField(key, SPAN, NODE), number) for number, key in enumerate("zb"))
    mapping = MappingField((one, other))
    assert (list(mapping), len(mapping), len(MappingField())) == ([one, other], 2, 0)


def test_a_pattern_is_one_of_those_that_exist() -> None:
    names = ["identifier", "slug", "dotted", "full name", "reference", "entry"]
    assert [Pattern(name).name for name in PATTERNS] == names
    with pytest.raises(MisuseError, match="there is no pattern 'name'"):
        Pattern("name")


@pytest.mark.parametrize(
    ("name", "fits", "others"),
    [
        ("identifier", ["a", "move_tool2"], ["", "_a", "2a", "A", "a-b", "a.b", "é"]),
        ("slug", ["a", "move-tool2"], ["", "-a", "2a", "a_b", "a.b"]),
        ("dotted", ["a", "a.b_2.c"], ["", ".a", "a.", "a..b", "a.2"]),
        ("entry", ["skills:wrap", "a:b"], ["skills", "skills.py:wrap", ":a", "a:", "a:b:c"]),
    ],
)
def test_a_form_admits_its_example_and_nothing_else(name: str, fits: list[str], others: list[str]) -> None:
    form = PATTERNS[name]
    assert all(form.regex.fullmatch(text) for text in [*fits, form.example])
    assert not any(form.regex.fullmatch(text) for text in others)


def test_a_name_within_a_dotted_one_does_not_stand_alone() -> None:
    assert undotted_names("hot and kettle.full or not hot_2(lid.open)") == {
        "hot",
        "and",
        "or",
        "not",
        "hot_2",
    }
