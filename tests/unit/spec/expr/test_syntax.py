"""The parts of an expression as it is written."""

from __future__ import annotations

from aeros.spec.expr.parser import parse
from aeros.spec.expr.syntax import Name, NumberLiteral, children


def parts(text: str) -> list[str]:
    """The text of each direct part."""
    return [text[one.extent.start : one.extent.end] for one in children(parse(text))]


def test_the_parts_are_the_operands_in_the_order_written() -> None:
    assert parts("a + b * 2") == ["a", "b * 2"]
    assert parts("a < b <= c") == ["a", "b", "c"]
    assert parts("a and not b and c") == ["a", "not b", "c"]
    assert parts("if a then b else c") == ["a", "b", "c"]
    assert parts("not a") == ["a"]


def test_the_parts_of_calls_indices_and_quantifiers_include_their_names() -> None:
    assert parts("max(a, 1 m)") == ["max", "a", "1 m"]
    assert parts("joint[j1]") == ["joint", "j1"]
    assert parts("p.x") == ["p", "x"]
    assert parts("all(ready[i] for i in Joint)") == ["ready[i]", "i", "Joint"]


def test_the_parts_of_a_membership_are_its_members_or_its_volume() -> None:
    assert parts("mode in {idle, stop}") == ["mode", "idle", "stop"]
    assert parts("p not in cell") == ["p", "cell"]


def test_a_past_operator_has_its_conditions_and_its_window() -> None:
    assert parts("once within 2 s a") == ["a", "2 s"]
    assert parts("previously a") == ["a"]


def test_a_name_and_a_number_have_no_parts() -> None:
    name, number = parse("a"), parse("2 m")
    assert isinstance(name, Name)
    assert isinstance(number, NumberLiteral)
    assert [*children(name), *children(number)] == []
