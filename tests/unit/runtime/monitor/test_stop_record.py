"""The record of a stop holds its extremes, ways and time; malformed values are left out."""

from __future__ import annotations

from math import nan

from aeros.runtime.monitor.stop_record import StopQuantities, StopRecorder, StopRecords
from aeros.runtime.ports import Reading

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


def test_malformed_values_are_left_out() -> None:
    recorder = StopRecorder(QUANTITIES, "collision", 0.0)
    for odd in (None, nan, "x", True, (1.0,), (nan, 0.0, 0.0), (1.0, "y", 2.0)):
        recorder.add({"force": odd, "tool": odd})
    details = recorder.details(1.0)
    assert details["ways"] == {}
    assert details["quantities"] == {"force": {"least": 1.0, "greatest": 1.0, "unit": "N"}}


def test_a_stop_and_a_halt_are_recorded_side_by_side_and_end_once() -> None:
    records = StopRecords(QUANTITIES)
    assert not records.are_open
    records.begin_halt(7, "late", 0.0)
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
