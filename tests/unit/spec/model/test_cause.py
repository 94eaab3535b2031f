"""Causes as text and as records hold them."""

from __future__ import annotations

import pytest

from aeros.spec.diagnostics.source import Source
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.model.cause import Cause, causes_to_json, file_and_line

NEAR = UnmetBound("human_distance", 0.41, "at least", 0.5, "m")
UNKNOWN = UnmetBound("holding", None, "equal to", True, reason="is not measured")


@pytest.mark.parametrize(
    ("shortfalls", "text"),
    [
        ((), "separation: human_distance >= 500 mm"),
        ((NEAR,), "separation: human_distance is 0.41 m (at least 0.5 m)"),
        ((NEAR, UNKNOWN), "separation: human_distance is 0.41 m (at least 0.5 m), `holding` is not measured"),
    ],
)
def test_a_cause_names_the_parts_that_did_not_hold_or_else_the_condition(
    shortfalls: tuple[UnmetBound, ...], text: str
) -> None:
    assert str(Cause("rule", "separation", "human_distance >= 500 mm", shortfalls=shortfalls)) == text


def test_a_place_is_the_line_of_the_first_character() -> None:
    source = Source("sites/table.yaml", "one\ntwo\nthree\n")
    assert file_and_line(source.span(0, 3)) == "sites/table.yaml:1"
    assert file_and_line(source.span(4, 13)) == "sites/table.yaml:2"


def test_records_have_their_own_names_and_no_empty_text() -> None:
    cause = Cause(
        "rule", "separation", "far", location="site.yaml:7", shortfalls=(NEAR, UNKNOWN), code="AE750"
    )
    near = {"quantity": "human_distance", "value": 0.41, "asked": "at least", "bound": 0.5, "unit": "m"}
    unknown = {"quantity": "holding", "value": None, "asked": "equal to", "bound": True, "unit": ""}
    assert causes_to_json([cause]) == [
        {
            "kind": "rule",
            "rule": "separation",
            "text": "far",
            "at": "site.yaml:7",
            "shortfalls": ({**near, "why": ""}, {**unknown, "why": "is not measured"}),
            "code": "AE750",
        }
    ]


def test_causes_stay_in_order_and_none_gives_an_empty_list() -> None:
    assert causes_to_json([]) == []
    two = causes_to_json([Cause("hold", "a", "x"), Cause("rule", "b", "y", source="ISO 13850")])
    assert two == [
        {"kind": "hold", "rule": "a", "text": "x", "shortfalls": ()},
        {"kind": "rule", "rule": "b", "text": "y", "source": "ISO 13850", "shortfalls": ()},
    ]
