"""The record of a stop holds its extremes, ways and time; malformed values are left out."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan

from aeros.runtime.monitor.stop_record import (
    StopQuantities,
    StopRecorder,
    StopRecords,
    stop_quantities,
)
from aeros.runtime.ports import Reading
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, FamilyType, RealType, Type, VectorType
from aeros.spec.expr.units import ANGLE, FORCE, LENGTH
from tests.unit.runtime.bench import unproved
from tests.unit.runtime.conftest import METRES, SIDES, declare

QUANTITIES = StopQuantities({"force": "N", "rates": "rad/s"}, ("tool",))


def test_extremes_and_ways_are_of_all_ticks() -> None:
    recorder = StopRecorder(QUANTITIES, "collision", 2.0)
    recorder.add({"force": 70.0, "rates": (0.1, -0.5), "tool": (0.0, 0.0, 0.0)})
    recorder.add({"force": Reading(120.0, 2.1), "rates": [0.2, 0.3], "tool": (0.0, 0.3, 0.4)})
    recorder.add({"force": 20.0, "tool": (0.0, 0.3, 0.15)})
    assert recorder.details(2.5) == {
        "time": 2.5,
        "began": 2.0,
        "ticks": 3,
        "reason": "collision",
        "quantities": {
            "force": {"least": 20.0, "greatest": 120.0, "unit": "N"},
            "rates": {"least": 0.1, "greatest": 0.5, "unit": "rad/s"},
        },
        "ways": {"tool": 0.75},
    }


def test_of_a_family_absolute_values_count_and_of_a_single_quantity_its_own() -> None:
    recorder = StopRecorder(QUANTITIES, "collision", 0.0)
    recorder.add({"force": -70.0, "rates": (-0.5,)})
    found = recorder.details(0.0)["quantities"]
    assert (found["force"]["least"], found["force"]["greatest"]) == (-70.0, -70.0)
    assert (found["rates"]["least"], found["rates"]["greatest"]) == (0.5, 0.5)


def test_malformed_values_are_left_out() -> None:
    recorder = StopRecorder(QUANTITIES, "collision", 0.0)
    for odd in (None, nan, "x", True, (1.0,), (nan, 0.0, 0.0), (1.0, "y", 2.0)):
        recorder.add({"force": odd, "tool": odd})
    details = recorder.details(1.0)
    assert details["ways"] == {}
    assert details["quantities"] == {"force": {"least": 1.0, "greatest": 1.0, "unit": "N"}}


def test_a_stop_and_a_halt_are_recorded_side_by_side_and_end_once() -> None:
    records = StopRecords(QUANTITIES)
    assert (records.are_open, records.late_ticks) == (False, 0)
    records.begin_halt(7, "late", 0.0)
    assert (records.are_open, records.stop) == (True, None)
    records.add({"force": 1.0})
    records.begin_stop("collision", 0.5)
    records.begin_stop("another", 0.6)
    records.add({"force": 2.0})
    halt, stop = records.end_halt(7, 1.0), records.end_stop(1.0)
    assert halt is not None
    assert (halt["reason"], halt["ticks"]) == ("late", 2)
    assert stop is not None
    assert (stop["reason"], stop["ticks"]) == ("collision", 1)
    assert not records.are_open
    assert (records.end_halt(7, 2.0), records.end_stop(2.0)) == (None, None)


def test_a_second_stop_does_not_begin_a_new_record() -> None:
    records = StopRecords(QUANTITIES)
    records.begin_stop("collision", 0.5)
    assert records.are_open
    records.begin_stop("another", 0.75)
    records.begin_halt(7, "late", 1.0)
    records.begin_halt(7, "later", 1.25)
    stop = records.end_stop(2.0)
    assert stop is not None
    assert (stop["reason"], stop["began"], stop["time"]) == ("collision", 0.5, 2.0)
    assert records.are_open
    halt = records.end_halt(7, 3.0)
    assert halt is not None
    assert (halt["reason"], halt["began"], halt["time"]) == ("late", 1.0, 3.0)
    assert not records.are_open


def test_a_halt_that_ends_leaves_the_records_of_others_open() -> None:
    records = StopRecords(QUANTITIES)
    records.begin_halt(7, "late", 0.0)
    records.begin_halt(8, "far", 0.0)
    assert records.end_halt(7, 1.0) is not None
    assert records.are_open
    records.begin_stop("collision", 1.0)
    assert records.end_halt(8, 1.0) is not None
    assert records.are_open
    assert records.end_stop(1.0) is not None
    assert not records.are_open


def test_records_are_dropped_when_no_action_is_under_way() -> None:
    records = StopRecords(QUANTITIES)
    records.begin_halt(7, "late", 0.0)
    records.begin_stop("collision", 0.5)
    records.clear()
    assert (records.are_open, records.stop) == (False, None)
    assert (records.end_halt(7, 1.0), records.end_stop(1.0)) == (None, None)


def test_late_ticks_of_the_session_are_in_every_record_after_them() -> None:
    records = StopRecords(QUANTITIES)
    records.begin_halt(7, "late", 0.0)
    early = records.end_halt(7, 0.5)
    assert early is not None
    assert "late_ticks" not in early
    records.late_ticks = 3
    records.begin_stop("collision", 0.5)
    stop = records.end_stop(1.0)
    assert stop is not None
    assert (stop["late_ticks"], stop["reason"]) == (3, "collision")


def test_quantities_of_a_site_are_its_reals_but_angles_and_its_positions() -> None:
    types: dict[str, Type] = {
        "holding": BOOL,
        "hand": VectorType(LENGTH),
        "push": VectorType(FORCE),
        "force": RealType(FORCE),
        "angle": RealType(ANGLE),
        "angles": FamilyType(SIDES, RealType(ANGLE)),
        "gaps": FamilyType(SIDES, METRES),
    }
    state = {name: declare(name, type_, t.VariableRole.STATE) for name, type_ in types.items()}
    found = stop_quantities(replace(unproved().site, state=state))
    assert found == StopQuantities({"force": str(FORCE), "gaps": str(LENGTH)}, ("hand",))


def test_a_way_needs_three_coordinates_and_a_place_before() -> None:
    recorder = StopRecorder(QUANTITIES, "collision", 0.0)
    recorder.add({"tool": (1.0, 2.0, 2.0)})
    assert recorder.details(0.0)["ways"] == {}
    for odd in ((1.0, 2.0), (1.0, 2.0, 2.0, 2.0), [1.0, 2.0, inf], (1, 2, 2)):
        recorder.add({"tool": odd})
    recorder.add({"tool": [1.0, 0.0, 2.0]})
    recorder.add({"tool": (1.0, 0.0, 1.0)})
    assert recorder.details(0.0)["ways"] == {"tool": 3.0}


def test_a_malformed_place_does_not_hide_the_next_one() -> None:
    recorder = StopRecorder(StopQuantities({}, ("hand", "tool")), "collision", 0.0)
    for height in (0.0, 2.0):
        recorder.add({"hand": None, "tool": (0.0, 0.0, height)})
    assert recorder.details(0.0)["ways"] == {"tool": 2.0}
