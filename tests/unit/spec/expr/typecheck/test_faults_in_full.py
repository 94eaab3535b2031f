"""Errors of expressions in full: code, message, both places with their labels, and the remedy.

AEROS_UPDATE_GOLDEN=1 pytest tests/unit/spec/expr/typecheck/test_faults_in_full.py   rewrites `faults.txt`,
and fails
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.scope import ExpressionTypeError, Scope
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, IntegerType, RealType, Type
from aeros.spec.expr.units import TEMPERATURE, TIME
from tests.unit.spec.expr.scope import SCOPE, SPEED
from tests.unit.spec.expr.typecheck.test_check import FAULTS

GOLDEN = Path(__file__).parent / "data" / "faults.txt"
PAST = replace(SCOPE, past=True)
MORE = {
    "pushing": t.Variable("pushing", BOOL, t.VariableRole.PARAMETER),
    "delay": t.Variable("delay", RealType(TIME), t.VariableRole.STATE),
    "warm": t.Variable("warm", RealType(TEMPERATURE), t.VariableRole.STATE),
    "cold": t.Variable("cold", RealType(TEMPERATURE), t.VariableRole.STATE),
}
OTHERS: list[tuple[str, Scope, Type]] = [
    ("k", SCOPE, IntegerType()),
    ("a", SCOPE, IntegerType()),
    ("speed", SCOPE, SPEED),
    ("x", SCOPE, SPEED),
    ("a", SCOPE, SPEED),
    *[
        (text, PAST, BOOL)
        for text in (
            "once a",
            "once within 0 s a",
            "once within 2 m a",
            "once within k a",
            "once within delay a",
            "previously x",
            "a since x",
            "x since a",
            "count within 1 s (x) <= 2",
            "once pushing",
        )
    ],
    *[
        (text, SCOPE, BOOL)
        for text in (
            "k <= 20 °C",
            "20 °C + 1 K <= 300 K",
            "cell.lowr == p",
            "cell.centre == p",
            "pot.hot",
            "inputs.place",
            "kettle.hott",
            "mode.x == idle",
            "count(x for j in Joint) <= 2",
            "all(x for j in Joint)",
            "dot(p, x) <= 1 m^2",
            "vec(a, x, x) == p",
            "abs(p) <= 1 m",
            "clamp(x, y) <= 1 m",
            "dist(p, q) <= 1 m",
            "p[j1] <= x",
            "joint[j9] <= x",
            "idle in {idle}",
            "a in cell",
            "(if x then a else b)",
            "(if a then mode else x) == idle",
            "x / p <= x",
            "-a",
            "a - x <= x",
            "x - a <= x",
            "x - speed <= x",
            "a implies x",
            "twirl(x) <= 1 m",
            "p in warehouse",
            "all(a for j in Sockets)",
            "kettel.hot",
            "kettle.cold",
            "teapot.cold",
            "sum(joint[j] for j in Joint) <= 1 s",
            "p.x <= 1 s",
            "p.x + 1 s <= p.x",
            "max(warm, cold) <= 20 °C",
            "(if a then warm else cold) <= 20 °C",
            "(if a then warm else cold + 1 K) <= 20 °C",
            "(if a then cold - 1 K else warm) <= 20 °C",
            "min(warm, cold + 1 K) <= 20 °C",
            "(if a then 20 °C else warm) <= cold",
            "(if a then 20 °C else warm + 1 K) <= cold",
            "(if a then warm + 1 K else 20 °C) <= cold",
            "abs(warm) <= 20 °C",
            "20 °C == -warm",
            "x or a",
        )
    ],
    (
        "busy",
        replace(SCOPE, definitions={"busy": t.Not(t.Variable("motor", BOOL, t.VariableRole.STATE))}),
        BOOL,
    ),
    ("place", replace(SCOPE, recalled=frozenset({"place"})), BOOL),
    ("moving.speeed <= 1 m/s", replace(SCOPE, roles={"moving": {"speed": SCOPE.variables["speed"]}}), BOOL),
]


def _lines() -> Iterator[str]:
    for text, scope, expected in [*((text, SCOPE, BOOL) for text, *_ in FAULTS), *OTHERS]:
        try:
            check(parse(text), replace(scope, variables={**scope.variables, **MORE}), expected)
        except ExpressionTypeError as fault:
            yield f"{text}\n  {fault.code} {fault.message}"
            places = [("at", fault.extent, fault.label)]
            if fault.related is not None:
                places.append(("and", *fault.related))
            for word, extent, label in places:
                yield f"  {word} `{text[extent.start : extent.end]}`" + (f": {label}" if label else "")
            yield f"  {fault.cure or 'no remedy'}"
        else:
            yield f"{text}\n  is a condition"


def test_every_error_has_its_message_places_and_remedy() -> None:
    shown = "\n".join(_lines()) + "\n"
    if os.environ.get("AEROS_UPDATE_GOLDEN") == "1":
        GOLDEN.write_text(shown, encoding="utf-8")
        pytest.fail("the golden file was rewritten: read the difference, then run without the variable")
    assert shown == GOLDEN.read_text(encoding="utf-8")
