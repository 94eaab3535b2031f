"""Text of a look: units, digits, reasons, and values that the truth contradicts."""

from __future__ import annotations

import json
from typing import Any

from aeros.apps.look.looking import DefinedValue, Look, PerceiverLook, SeenValue
from aeros.cli.author.look_report import as_json, text_lines
from aeros.runtime.ports import Reading
from tests.unit.runtime.perception.kettle import full_site, kettle

STATE = kettle().state
EYE = kettle().perceivers["kettle_view"]


def seen(name: str, value: Any, uncertainty: Any = None, reason: str = "", truth: Any = None) -> SeenValue:
    return SeenValue(STATE[f"kettle.{name}"], value, uncertainty, 1.0, reason, truth)


def report(*values: SeenValue, fault: str = "", defined: tuple[DefinedValue, ...] = ()) -> Look:
    return Look(full_site(), 1.0, {}, (PerceiverLook(EYE, fault, 0.02, values),), defined)


def test_a_value_has_its_unit_its_uncertainty_and_the_declared_one() -> None:
    lines = list(
        text_lines(report(seen("water_level", 0.123456, 0.001), seen("water_hot", True, truth=True)))
    )
    assert lines == [
        "kettle_view  (20 ms)",
        "  water_level  0.1235 m ± 0.001 m (at most 0.005 m)",
        "  water_hot    true  truth true",
    ]


def test_unknown_and_false_values_say_so() -> None:
    found = report(
        seen("water_level", None, 0.2, "less certain than declared"), seen("filled", True, truth=False)
    )
    assert list(text_lines(found))[1:] == [
        "  water_level  unknown ± 0.2 m (at most 0.005 m) (less certain than declared)",
        "  filled       true  truth false, DIFFERS",
    ]
    assert not found.is_right


def test_a_fault_comes_before_the_values() -> None:
    assert list(text_lines(report(fault="it crashed")))[1:] == ["  gave no values: it crashed"]


def test_a_definition_is_shown_with_what_it_reads() -> None:
    parts = {"tool_position": Reading((0.5, 1e-19, 0.3), 1.0)}
    defined = DefinedValue(seen("water_hot", None), "tool_position.z\n > water_level", parts, ("kettle.x",))
    assert list(text_lines(report(defined=(defined,))))[1:] == [
        "definitions",
        "  water_hot  unknown",
        "    tool_position.z > water_level  [tool_position = (0.5, 0, 0.3) m, kettle.x is unknown]",
    ]
    (one,) = json.loads(as_json(report(defined=(defined,)), "kettle", "bare", ["saved a.png"]))["definitions"]
    assert (one["reads"], one["unknown"]) == ({"tool_position": [0.5, 1e-19, 0.3]}, ["kettle.x"])
