"""Answers of tools: whole, declared, typed and in range, or nothing of them counts."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest

from aeros.runtime.tools.answer import check_answer
from aeros.runtime.tools.exchange import ToolError
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from aeros.spec.model.tools import Program, Tool
from tests.unit.spec.faults import TABLE

TOOL = Tool(Program(("ask",)), Fraction(1), ("load", "table_tidy", "fetched", "hand"))


@pytest.fixture
def site() -> Site:
    found = load_site(TABLE, Diagnostics())
    assert found is not None
    return found


def test_values_are_those_of_readings(site: Site) -> None:
    answer = {"load": 2, "table_tidy": True, "fetched": "brush", "hand": [0, 0.5, -1]}
    assert check_answer(answer, TOOL, site) == {
        "load": 2.0,
        "table_tidy": True,
        "fetched": "brush",
        "hand": (0.0, 0.5, -1.0),
    }
    assert check_answer({"load": None}, TOOL, site) == check_answer({}, TOOL, site) == {}


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        ([1], "not an object"),
        (None, "not an object"),
        ({"load": 6}, "outside 0 kg to 5 kg"),
        ({"load": -0.001}, "outside"),
        ({"load": True}, "is not a number"),
        ({"load": "2"}, "is not a number"),
        ({"load": [2]}, "is not a number"),
        ({"table_tidy": 1}, "is not true or false"),
        ({"fetched": "fork"}, "is not a member of tools"),
        ({"hand": [1, 2]}, "is not a list of 3 values"),
        ({"hand": [1, 2, 99]}, "outside"),
        ({"load": 1, "dirt": 2}, "'dirt', which it does not declare"),
        ({"stop_pressed": False}, "does not declare"),
        ({"load": 10**400}, "is not a number"),
    ],
)
def test_an_answer_with_a_fault_counts_for_nothing(site: Site, answer: Any, reason: str) -> None:
    with pytest.raises(ToolError, match=reason):
        check_answer(answer, TOOL, site)
