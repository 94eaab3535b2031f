"""A record becomes an event, and a decision also a message of its own."""

from __future__ import annotations

import pytest

from aeros.runtime.bus.messages import DecisionMessage, Event, LogMessage, Time
from aeros.runtime.bus.record_messages import log_message, parse_record

LAST = Time(7, 5)


def test_a_record_becomes_an_event_with_its_details_as_canonical_json() -> None:
    line = b'{"details":{"b":[1, 2],"a":"x","time":2.5},"event":"note","sequence":3}\n'
    event, decision = parse_record(line, LAST)
    assert event == Event(Time(2, 500_000_000), 3, "note", '{"a":"x","b":[1,2],"time":2.5}')
    assert decision is None


@pytest.mark.parametrize(
    ("time", "stamp"),
    [("4", Time(4)), ("0.25", Time(0, 250_000_000)), ("true", LAST), ("null", LAST), ('"4"', LAST)],
)
def test_a_record_without_a_time_of_its_own_takes_the_last_known_one(time: str, stamp: Time) -> None:
    line = b'{"details":{"time":%b},"event":"note","sequence":0}' % time.encode()
    assert parse_record(line, LAST)[0].stamp == stamp
    assert parse_record(b'{"details":{},"event":"note","sequence":0}', LAST)[0].stamp == LAST


def test_a_decision_has_a_message_of_its_own() -> None:
    line = (
        b'{"details":{"decided":{"parameters":{"speed":0.5},"kind":"move"},"module":"m",'
        b'"reasons":[["AE750","rule"]],"skill":"s","time":1.0,"verdict":"ATTENUATE"},'
        b'"event":"decision","sequence":9}'
    )
    event, decision = parse_record(line, LAST)
    assert (event.stamp, event.record, event.event) == (Time(1), 9, "decision")
    assert decision == DecisionMessage(
        Time(1), 9, "m", "s", "ATTENUATE", '{"kind":"move","parameters":{"speed":0.5}}', '[["AE750","rule"]]'
    )


@pytest.mark.parametrize("line", [b"", b"no record", b"[]", b'{"event":"note","sequence":0}'])
def test_a_line_that_is_no_record_raises(line: bytes) -> None:
    with pytest.raises((ValueError, KeyError, TypeError)):
        parse_record(line, LAST)


DECISION = '{"module":"m","skill":"s","verdict":"%s","asked":{"kind":"move"},"reasons":%s,"time":1}'
REASONS = '[["AE1","r","too near"],["AE2","q","too fast"]]'
ENDED = '{"module":"m","skill":"s","status":"finished","reason":"","time":1}'


@pytest.mark.parametrize(
    ("event", "details", "level", "source", "text"),
    [
        ("decision", DECISION % ("ALLOW", "[]"), 20, "m.s", "ALLOW move"),
        ("decision", DECISION % ("DENY", REASONS), 40, "m.s", "DENY move: too near; too fast"),
        ("stopped", '{"reason":"monitor:near","time":1}', 40, "gate", "stopped: monitor:near"),
        ("step-ended", ENDED, 20, "m.s", "finished"),
    ],
)
def test_decisions_stops_and_ends_of_steps_are_lines_of_the_log(
    event: str, details: str, level: int, source: str, text: str
) -> None:
    line = f'{{"details":{details},"event":"{event}","sequence":3}}'.encode()
    assert log_message(line, LAST) == LogMessage(Time(1), level, source, text)


def test_other_records_are_no_lines_of_the_log() -> None:
    assert log_message(b'{"details":{},"event":"note","sequence":3}', LAST) is None
