"""Kinds of faults: how a file writes each of their fields."""

from __future__ import annotations

from dataclasses import MISSING, dataclass, fields, is_dataclass
from typing import Annotated, Any, get_type_hints

import pytest

from aeros.spec.declared.decode import decode
from aeros.spec.declared.faults import (
    KINDS,
    Amount,
    CommandDelayFault,
    Direction,
    Duration,
    Fault,
    Faults,
    ImpulseFault,
    Known,
    MisplacedPictureFault,
    MissedPictureFault,
    SensorFault,
    Share,
    Written,
    marks_of,
    written_form,
)
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.expr.units import FORCE, LENGTH, TIME
from aeros.spec.text.fields import TextField
from tests.unit.spec.text.reading import accepted


@dataclass(frozen=True)
class _Blink:
    """A lamp blinks."""

    rate: Annotated[float, Share("the share of dark ticks")]
    lasts: Annotated[int, Duration("duration of the fault")] = 12


def _messages_of(text: str, schema: type) -> tuple[Any, list[str]]:
    sink = Diagnostics()
    return decode(accepted(text), schema, sink), [one.code for one in sink]


def test_the_mark_of_a_field_is_found_where_it_may_be_absent_too() -> None:
    marks = marks_of(ImpulseFault)
    assert list(marks) == ["thing", "impulse", "over", "direction"]
    assert isinstance(marks["thing"], Known)
    assert (marks["thing"].among, marks["thing"].noun) == ("things", "scene object")
    assert isinstance(marks["impulse"], Amount)
    assert (marks["impulse"].dimension, marks["impulse"].most) == (FORCE * TIME, 10)
    assert isinstance(marks["over"], Duration)
    assert isinstance(marks["direction"], Direction)


def test_a_kind_without_fields_has_no_marks() -> None:
    assert marks_of(MissedPictureFault) == {}
    assert [one.name for one in fields(written_form(MissedPictureFault))] == ["span"]


def test_a_distance_is_at_most_ten_metres() -> None:
    mark = marks_of(MisplacedPictureFault)["by"]
    assert mark == Amount("the error of the position, as in `by: 60 mm`", LENGTH, 10)


def test_a_file_writes_a_place_and_the_fields_of_the_kind() -> None:
    form = written_form(_Blink)
    assert (form.__name__, form.__doc__) == ("_Blink", "A lamp blinks.")
    assert [one.name for one in fields(form)] == ["span", "rate", "lasts"]
    assert [one.metadata.get("doc") for one in fields(form)] == [
        None,
        "the share of dark ticks",
        "duration of the fault",
    ]


def test_fields_with_a_default_are_optional_and_absent_is_none() -> None:
    rate, lasts = fields(written_form(_Blink))[1:]
    assert (rate.default, lasts.default) == (MISSING, None)
    found, message = _messages_of("rate: 0.5\n", written_form(_Blink))
    assert (message, found.lasts) == ([], None)
    assert _messages_of("lasts: 1 s\n", written_form(_Blink))[0] is None


def test_a_duration_is_text_until_its_unit_is_known() -> None:
    found, message = _messages_of("rate: 0.5\nlasts: 2 fortnights\n", written_form(_Blink))
    assert message == []
    assert isinstance(found.lasts, TextField)
    assert found.lasts.value == "2 fortnights"


@pytest.mark.parametrize(("rate", "is_read"), [("0", True), ("1", True), ("1.01", False), ("-0.1", False)])
def test_a_share_is_from_none_to_all(rate: str, is_read: bool) -> None:
    found, message = _messages_of(f"rate: {rate}\n", written_form(_Blink))
    assert (found is not None) is is_read
    assert (message == []) is is_read


@pytest.mark.parametrize(
    ("direction", "is_read"), [("[0, 1, 0]", True), ("[0, 1]", False), ("[0, 1, 0, 0]", False)]
)
def test_a_direction_is_three_numbers(direction: str, is_read: bool) -> None:
    found, _ = _messages_of(f"by: 60 mm\ndirection: {direction}\n", written_form(MisplacedPictureFault))
    assert (found is not None) is is_read


def test_a_form_is_derived_once() -> None:
    assert written_form(CommandDelayFault) is written_form(CommandDelayFault)
    assert Written[CommandDelayFault] is written_form(CommandDelayFault)


def test_each_kind_is_a_field_of_a_fault_and_all_of_its_fields_are_marked() -> None:
    declared = get_type_hints(Fault)
    assert set(KINDS) <= set(declared)
    for name, kind in KINDS.items():
        assert is_dataclass(kind)
        if name != "enter":
            assert set(marks_of(kind)) == {one.name for one in fields(kind)}
            assert declared[name] == written_form(kind) | None


def test_a_sensor_fault_needs_a_quantity_and_a_duration_alone() -> None:
    required = [one.name for one in fields(written_form(SensorFault)) if one.default is MISSING]
    assert required == ["span", "of", "lasts"]


_FILE = """\
schema: aeros/faults/1
faults:
  a: {at: {every: 1 s}, rate: 0.5, slip: {friction: 0, lasts: 1 s}}
"""


@pytest.mark.parametrize(
    "edit", [("rate: 0.5", "rate: 1.5"), ("lasts: 1 s", "last: 1 s"), ("every: 1 s", "each: 1 s")]
)
def test_a_file_of_another_form_is_refused(edit: tuple[str, str]) -> None:
    assert _messages_of(_FILE, Faults)[1] == []
    found, message = _messages_of(_FILE.replace(*edit), Faults)
    assert found is None
    assert message != []
