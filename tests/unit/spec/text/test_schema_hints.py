"""Type hints of a schema say how each field may be written."""

from __future__ import annotations

from dataclasses import dataclass, field, make_dataclass
from typing import Annotated, Any, Literal

import pytest

from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import (
    BooleanField,
    ChoiceField,
    ExpressionField,
    IntegerField,
    MappingField,
    NumberField,
    Pattern,
    TextField,
)
from aeros.spec.text.nodes import MappingNode, ScalarNode, SequenceNode
from aeros.spec.text.schema_hints import (
    SchemaField,
    admitted_forms,
    allowed_words,
    example_text,
    fields_of,
    node_kind,
    split_annotated,
)

NAME = Annotated[TextField, Pattern("slug")]


@dataclass(frozen=True)
class Inner:
    span: SourceSpan


@dataclass(frozen=True)
class Whole:
    span: SourceSpan
    key_span: SourceSpan
    id: NAME = field(metadata={"doc": "its name"})
    from_: TextField
    all_: TextField
    end_: TextField
    steps: tuple[Inner, ...] = ()
    limit: NumberField | None = field(default=None, metadata={"example": "3 s"})
    inner: Inner | TextField | None = None
    more: MappingField[Inner] = field(default_factory=MappingField)


def test_fields_are_listed_under_their_names_in_yaml() -> None:
    fields = fields_of(Whole)
    assert list(fields) == ["id", "from", "all", "end_", "steps", "limit", "inner", "more"]
    assert fields["from"].attribute == "from_"
    assert [name for name, one in fields.items() if one.is_required] == ["id", "from", "all", "end_"]
    assert fields["id"] == SchemaField("id", NAME, True, "its name", "move-tool")
    assert (fields["limit"].example, fields["steps"].example, fields["more"].example) == ("3 s", "[…]", "{…}")


def test_a_schema_without_its_place_is_refused() -> None:
    for fields in ([("id", TextField)], [("id", TextField), ("span", str)]):
        with pytest.raises(MisuseError, match="Bad must declare `span: Span`"):
            fields_of(make_dataclass("Bad", fields))


@pytest.mark.parametrize(
    "hint", [TextField | NumberField, Inner | Whole, tuple[Inner, ...] | tuple[TextField, ...]]
)
def test_forms_that_yaml_cannot_distinguish_are_refused(hint: Any) -> None:
    bad = make_dataclass("Bad", [("span", SourceSpan), ("it", hint)])
    with pytest.raises(MisuseError, match=r"Bad.it: YAML cannot tell the options"):
        fields_of(bad)


def test_the_forms_of_a_union_are_its_parts_without_none() -> None:
    assert admitted_forms(TextField | Inner | None) == (TextField, Inner)
    assert admitted_forms(TextField | None) == admitted_forms(TextField) == (TextField,)


def test_marks_are_split_from_a_hint() -> None:
    assert split_annotated(NAME) == (TextField, (Pattern("slug"),))
    assert split_annotated(TextField) == (TextField, ())


@pytest.mark.parametrize(
    "base",
    [
        TextField,
        ExpressionField,
        BooleanField,
        IntegerField,
        NumberField,
        Literal["a"],
        ChoiceField[Literal["a", "b"]],
    ],
)
def test_a_single_value_is_written_as_a_scalar(base: Any) -> None:
    assert node_kind(base) is ScalarNode


def test_lists_and_mappings_are_written_as_such() -> None:
    assert node_kind(tuple[Inner, ...]) is SequenceNode
    assert node_kind(Inner) is node_kind(MappingField[Inner]) is MappingNode


@pytest.mark.parametrize("base", [str, int, tuple[Inner], tuple[Inner, Inner], list[Inner]])
def test_any_other_hint_cannot_be_decoded(base: Any) -> None:
    with pytest.raises(MisuseError, match="cannot be decoded"):
        node_kind(base)


def test_words_are_those_of_a_literal_or_a_choice() -> None:
    assert allowed_words(Literal["a", "b"]) == allowed_words(ChoiceField[Literal["a", "b"]]) == ("a", "b")
    assert allowed_words(TextField) is allowed_words(Inner) is None


@pytest.mark.parametrize(
    ("hint", "text"),
    [
        (Literal["b", "a"], "b"),
        (ChoiceField[Literal["loud", "quiet"]] | None, "loud"),
        (NAME, "move-tool"),
        (Annotated[NumberField, Pattern("slug")], "0.25"),
        (TextField, "…"),
        (ExpressionField, "…"),
        (BooleanField | None, "true"),
        (IntegerField, "1"),
        (tuple[Inner, ...], "[…]"),
        (Inner, "{…}"),
        (MappingField[Inner], "{…}"),
    ],
)
def test_an_example_is_as_it_could_be_written(hint: Any, text: str) -> None:
    assert example_text(hint) == text
