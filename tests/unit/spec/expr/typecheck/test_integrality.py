"""Terms that are whole by their structure."""

from __future__ import annotations

import pytest

from aeros.spec.expr.parser import parse
from aeros.spec.expr.typecheck.check import infer
from aeros.spec.expr.typecheck.integrality import is_integral
from tests.unit.spec.expr.scope import SCOPE


@pytest.mark.parametrize(
    ("text", "whole"),
    [
        ("3", True),
        ("1.5", False),
        ("laps * 2 - 7", True),
        ("laps / 2", False),
        ("count(ready[j] for j in Joint)", True),
        ("sum((if ready[j] then 1 else laps) for j in Joint)", True),
        ("sum((if ready[j] then 0.5 else laps) for j in Joint)", False),
        ("max(abs(laps), 3)", True),
        ("n", False),
        ("n - n", False),
    ],
)
def test_a_term_is_whole_if_its_parts_are(text: str, whole: bool) -> None:
    term, _ = infer(parse(text), SCOPE)
    assert is_integral(term) is whole
