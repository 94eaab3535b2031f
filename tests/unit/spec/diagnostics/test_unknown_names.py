"""Uses of one unknown name are one error, at the misspelt declaration if there is one."""

from __future__ import annotations

import pytest

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.source import Source
from aeros.spec.diagnostics.unknown_names import merge_unknown_names


def uses(text: str, name: str, code: str = "AE202") -> list[Diagnostic]:
    """An error at each place of a name."""
    source, found, start = Source("a.yaml", text), [], text.find(name)
    while start >= 0:
        label = SpanLabel(source.span(start, start + len(name)))
        found.append(Diagnostic(code, f"`{name}` is not declared here", label))
        start = text.find(name, start + 1)
    return found


@pytest.mark.parametrize(
    ("text", "misspelt"),
    [
        ("state:\n  person_nere: {}\nuse: person_near\nalso: person_near\n", "person_nere"),
        ("state: {prson_near: 1}\nuse: person_near\nalso: person_near\n", "prson_near"),
        ("list:\n  - id: person_naer\nuse: person_near\nalso: person_near\n", "person_naer"),
    ],
    ids=["letter", "missing letter", "swapped letters"],
)
def test_the_error_is_at_the_misspelt_declaration(text: str, misspelt: str) -> None:
    (merged,) = merge_unknown_names(uses(text, "person_near"))
    assert merged.primary is not None
    assert merged.primary.span.text == misspelt
    assert [one.span.text for one in merged.secondary] == ["person_near"] * 2
    assert f"`{misspelt}` is declared and never used" in merged.headline


@pytest.mark.parametrize(
    "text",
    [
        "state: {person_far_away: 1}\nuse: person_near\nalso: person_near\n",
        "state: {person_nere: 1}\nuse: person_near and person_nere\nalso: person_near\n",
        "state: {person_nera: 1, person_naer: 2}\nuse: person_near\nalso: person_near\n",
    ],
    ids=["not similar", "used", "two are similar"],
)
def test_without_a_misspelt_declaration_the_error_is_at_the_first_use(text: str) -> None:
    first, *_ = given = uses(text, "person_near")
    (merged,) = merge_unknown_names(given)
    assert (merged.headline, merged.primary) == (first.headline, first.primary)
    assert [one.text for one in merged.secondary] == ["and here"]


def test_a_single_use_and_other_errors_stay() -> None:
    (single,) = uses("use: person_near\nstate: {person_nere: 1}\n", "person_near")
    other = Diagnostic("AE101", "`person_near` is unknown", single.primary)
    assert merge_unknown_names([other, single, other]) == (other, single, other)


def test_different_names_stay_different() -> None:
    text = "a: first first\nb: second second\n"
    merged = merge_unknown_names([*uses(text, "first"), *uses(text, "second", "AE122")])
    assert [one.primary.span.text for one in merged if one.primary] == ["first", "second"]
