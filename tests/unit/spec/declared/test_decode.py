from __future__ import annotations

import time
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Annotated, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.declared.decode import decode
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.diagnostics.render import render_text
from aeros.spec.diagnostics.source import Source, SourceSpan
from aeros.spec.text.fields import (
    BooleanField,
    ChoiceField,
    ExpressionField,
    IntegerField,
    LengthBounds,
    MappingField,
    NumberField,
    Pattern,
    TextField,
    ValueBounds,
)
from aeros.spec.text.yaml_reader import read_yaml

Identifier = Annotated[TextField, Pattern("identifier")]


@dataclass(frozen=True, kw_only=True)
class Retry:
    span: SourceSpan
    key_span: SourceSpan | None = None
    times: Annotated[IntegerField, ValueBounds(0, 5)]
    wait: NumberField | None = None


@dataclass(frozen=True, kw_only=True)
class Step:
    span: SourceSpan
    do: Identifier
    then: tuple[Step, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Skill:
    span: SourceSpan
    name: Identifier = field(metadata={"doc": "what plans call it"})
    when: ExpressionField | None = None
    guarded: BooleanField | None = None
    speed: Annotated[NumberField, ValueBounds(lo=0)] | None = None
    on_failure: Literal["halt", "replan"] = "halt"
    risk: ChoiceField[Literal["low", "high"]] | None = None
    from_: TextField | None = None
    tags: Annotated[tuple[Identifier, ...], LengthBounds(1, 2)] = ()
    retry: IntegerField | Retry | tuple[IntegerField, ...] | None = None
    inputs: Annotated[MappingField[Retry], Pattern("identifier")] = field(default_factory=MappingField)
    steps: tuple[Step, ...] = ()


def read(text: str) -> tuple[Skill | None, list[Diagnostic]]:
    sink = Diagnostics()
    node = read_yaml(Source("a.yaml", text), sink)
    assert node is not None, list(sink)
    began = time.monotonic()
    skill = decode(node, Skill, sink)
    assert time.monotonic() - began < 2.0
    assert (skill is None) == sink.has_errors
    return skill, list(sink)


def accepted(text: str) -> Skill:
    skill, found = read(text)
    assert found == []
    assert skill is not None
    return skill


def refused(text: str) -> list[Diagnostic]:
    skill, found = read(text)
    assert skill is None
    return found


def problem_in(text: str) -> tuple[str, str, str]:
    """Code, headline and underlined text of the only problem."""
    (found,) = refused(text)
    assert found.primary is not None
    return found.code, found.headline, found.primary.span.text


def test_every_form_is_decoded_with_its_place() -> None:
    skill = accepted(
        "name: pick\nwhen: speed < 1\nguarded: true\nspeed: 1.10\non_failure: replan\nrisk: low\nfrom: here\n"
        "tags: [a, b]\nretry: 3\ninputs:\n  x: {times: 1, wait: 1e-3}\nsteps:\n- do: a\n  then:\n  - do: b\n"
    )
    assert (skill.name.value, str(skill.name), skill.name.span.line) == ("pick", "pick", 1)
    assert skill.when is not None
    assert skill.when.value == "speed < 1"
    assert skill.guarded is not None
    assert skill.guarded.value is True
    assert skill.speed is not None
    assert (skill.speed.value, skill.speed.span.text) == (Fraction(11, 10), "1.10")
    assert skill.on_failure == "replan"
    assert skill.risk is not None
    assert (skill.risk.value, skill.risk.span.line) == ("low", 6)
    assert skill.from_ is not None
    assert skill.from_.value == "here"
    assert [tag.value for tag in skill.tags] == ["a", "b"]
    assert isinstance(skill.retry, IntegerField)
    ((key, retry),) = skill.inputs
    assert retry.wait is not None
    assert (key.value, retry.wait.value) == ("x", Fraction(1, 1000))
    assert retry.key_span == key.span
    assert retry.span.text == "{times: 1, wait: 1e-3}"
    assert skill.steps[0].then[0].do.value == "b"
    assert skill.span.line == 1


def test_a_union_is_decided_by_the_kind_of_node() -> None:
    assert isinstance(accepted("name: a\nretry: {times: 2}\n").retry, Retry)
    assert isinstance(accepted("name: a\nretry: [1, 2]\n").retry, tuple)
    assert problem_in("name: a\nretry: x\n") == ("AE107", "`retry`: expected an integer, found `x`", "x")
    assert problem_in("name: a\nspeed: [1]\n") == ("AE103", "`speed`: expected a number, found a list", "[1]")
    assert problem_in("name: a\nsteps: {do: b}\n")[1] == "`steps`: expected a list, found a mapping"
    assert problem_in("[name]\n")[:2] == ("AE103", "expected a mapping, found a list")
    assert problem_in("inputs: 3\nname: a\n")[1] == "`inputs`: expected a mapping, found a single value"


@pytest.mark.parametrize("text", ["0", "5", "-3"])
def test_integers_are_decimal_digits(text: str) -> None:
    retry = accepted(f"name: a\nretry: {text}\n").retry
    assert isinstance(retry, IntegerField)
    assert retry.value == int(text)


@pytest.mark.parametrize(
    "text", ["0x10", "010", "1_000", "1.0", "1e3", "+1", "٣", "9" * 65, "9" * 900_000, "5 s", "true", ".inf"]
)
def test_nothing_else_is_an_integer(text: str) -> None:
    assert problem_in(f"name: a\nretry: {text}\n")[0] == "AE107"


@pytest.mark.parametrize(
    ("text", "value"),
    [("1.10", Fraction(11, 10)), ("1e-3", Fraction(1, 1000)), ("2E2", Fraction(200)), ("0", Fraction(0))],
)
def test_numbers_are_exact(text: str, value: Fraction) -> None:
    speed = accepted(f"name: a\nspeed: {text}\n").speed
    assert speed is not None
    assert speed.value == value


@pytest.mark.parametrize(
    "text",
    [
        ".nan",
        "nan",
        ".inf",
        "inf",
        "-.inf",
        "1e99999999",
        "1.",
        ".5",
        "1/2",
        "0x1p3",
        "1_0.5",
        "12:30",
        "٣.٥",
    ],
)
def test_nothing_else_is_a_number(text: str) -> None:
    assert problem_in(f"name: a\nspeed: {text}\n")[0] == "AE108"


@pytest.mark.parametrize("text", ["yes", "no", "on", "True", "TRUE", "1", "y"])
def test_only_true_and_false_are_booleans(text: str) -> None:
    assert problem_in(f"name: a\nguarded: {text}\n") == (
        "AE106",
        f"`guarded`: expected `true` or `false`, found `{text}`",
        text,
    )


def test_a_boolean_field_has_no_truth_value() -> None:
    guarded = accepted("name: a\nguarded: false\n").guarded
    with pytest.raises(MisuseError):
        assert guarded


def test_a_quoted_number_is_refused_and_says_so() -> None:
    (found,) = refused('name: a\nspeed: "20"\n')
    assert (
        render_text(found)
        == """\
error[AE109] quoted-value: `speed`: expected a number, found quoted text
 --> a.yaml:2:8
2 | speed: "20"
  |        ^^^^
help: remove the quotes
"""
    )


def test_bounds_and_lengths_are_inclusive() -> None:
    accepted("name: a\nspeed: 0\nretry: {times: 5}\ntags: [a, b]\n")
    assert problem_in("name: a\nspeed: -0.1\n") == ("AE111", "`speed`: `-0.1` is outside its bounds", "-0.1")
    assert refused("name: a\nretry: {times: 6}\n")[0].help == ("write a value from 0 to 5",)
    assert refused("name: a\nspeed: -1\n")[0].help == ("write a value of at least 0",)
    assert problem_in("name: a\ntags: []\n") == ("AE112", "`tags`: 0 entries are not allowed here", "tags")
    assert problem_in("name: a\ntags: [a, b, c]\n")[0] == "AE112"


def test_a_missing_field_is_reported_at_the_key_with_an_example() -> None:
    (found,) = refused("when: x\n")
    assert (
        render_text(found)
        == """\
error[AE102] missing-field: the field `name` is missing
 --> a.yaml:1:1
1 | when: x
  | ^^^^
help: add `name: move_tool` (what plans call it)
"""
    )
    assert problem_in("name: a\nretry: {}\n") == ("AE102", "the field `times` is missing in `retry`", "retry")
    assert problem_in("name: a\nsteps:\n- then: []\n") == (
        "AE102",
        "the field `do` is missing in `steps`",
        "then",
    )
    assert problem_in("{}")[2] == "{}"


def test_an_unknown_field_is_underlined_with_the_near_name_and_all_names() -> None:
    (found,) = refused("name: a\nretry: {times: 1, wiat: 2}\n")
    assert (
        render_text(found)
        == """\
error[AE101] unknown-field: unknown field `wiat` in `retry`
 --> a.yaml:2:19
2 | retry: {times: 1, wiat: 2}
  |                   ^^^^
help: did you mean `wait`?
help: the fields are `times`, `wait`
"""
    )
    for filled in ("span", "key_span", "from_"):
        assert problem_in(f"name: a\n{filled}: x\n")[0] == "AE101"


def test_a_field_without_a_value_is_refused_even_when_it_may_be_left_out() -> None:
    assert problem_in("name: a\nwhen:\n") == (
        "AE104",
        "`when`: expected an expression, found nothing",
        "when",
    )
    assert problem_in("name: a\nwhen: null\n")[2] == "null"
    assert problem_in("name: a\ninputs:\n")[:2] == ("AE104", "`inputs`: expected a mapping, found nothing")
    assert problem_in("---\n")[:2] == ("AE104", "expected a mapping, found nothing")


def test_names_have_their_form() -> None:
    assert problem_in("name: Pick-Up\n") == (
        "AE105",
        "`name`: `Pick-Up` is not a well-formed identifier",
        "Pick-Up",
    )
    assert problem_in("name: a\ninputs: {X: {times: 1}}\n") == (
        "AE105",
        "`inputs`: `X` is not a well-formed identifier",
        "X",
    )
    assert problem_in('name: "a\\n"\n')[0] == "AE105"


def test_a_choice_names_the_allowed_words() -> None:
    (found,) = refused("name: a\non_failure: replna\n")
    assert found.code == "AE110"
    assert found.help == ("did you mean `replan`?", "write one of `halt`, `replan`")
    assert problem_in("name: a\nrisk: Low\n") == (
        "AE110",
        "`risk`: `Low` is not one of the allowed words",
        "Low",
    )
    assert problem_in("name: a\nrisk: []\n")[1] == "`risk`: expected one of `low`, `high`, found a list"


def test_every_problem_is_reported() -> None:
    found = refused(
        "nmae: a\nspeed: fast\ntags: [A, b, C]\nretry: {times: 9, x: 1}\nsteps:\n- {}\n- do: [1]\n"
    )
    assert [problem.code for problem in found] == [
        "AE101",
        "AE102",
        "AE108",
        "AE112",
        "AE105",
        "AE105",
        "AE111",
        "AE101",
        "AE102",
        "AE103",
    ]


@pytest.mark.slow
def test_a_hostile_number_of_problems_is_refused_in_time() -> None:
    many = "".join(f"nam{number}: x\n" for number in range(40_000))
    assert len(refused(many)) == 200
    assert len(refused("name: a\ntags: [" + "A," * 90_000 + "]")) == 200
    assert len(refused("name: a\ninputs: {" + ",".join(f"A{n}: 1" for n in range(40_000)) + "}")) == 200


@dataclass(frozen=True)
class Placeless:
    name: TextField


@dataclass(frozen=True)
class Ambiguous:
    span: SourceSpan
    name: TextField | IntegerField


@dataclass(frozen=True)
class Undecodable:
    span: SourceSpan
    name: int


def test_a_schema_that_cannot_be_decoded_is_misuse() -> None:
    node = read_yaml(Source("a.yaml", "name: a\n"), Diagnostics())
    assert node is not None
    for schema in (Placeless, Ambiguous, Undecodable, int):
        with pytest.raises(MisuseError):
            decode(node, schema, Diagnostics())
    with pytest.raises(MisuseError):
        Pattern("no_such_pattern")


SCRAPS = st.recursive(
    st.sampled_from(["a", "1", "1.5", "true", "'q'", "~", "", "x < 1", "halt", "-"]),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3).map(lambda items: f"[{', '.join(items)}]"),
        st.dictionaries(
            st.sampled_from(
                ["name", "when", "tags", "retry", "inputs", "steps", "do", "then", "times", "zz"]
            ),
            inner,
            max_size=4,
        ).map(lambda entries: "{" + ", ".join(f"{key}: {value}" for key, value in entries.items()) + "}"),
    ),
    max_leaves=12,
)


@given(SCRAPS)
def test_any_yaml_is_decoded_or_refused_with_a_reason(text: str) -> None:
    sink = Diagnostics()
    node = read_yaml(Source("a.yaml", text), sink)
    if node is not None:
        assert (decode(node, Skill, sink) is None) == sink.has_errors
        for found in sink:
            render_text(found)
