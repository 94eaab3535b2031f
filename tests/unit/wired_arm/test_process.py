"""Processes of a robot's parts: how they report that one cannot be opened, and how they are started."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import pytest

from aeros.wired_arm.link import ProcessLink, open_link
from aeros.wired_arm.process import drive, open_part

Ends = tuple[ProcessLink, ProcessLink]


def test_a_part_that_opens_is_returned_and_nothing_is_reported(ends: Ends) -> None:
    assert open_part(ends[1], lambda: "arm", OSError) == "arm"
    assert ends[0].receive(0.0) is None


def test_a_part_that_cannot_be_opened_is_reported(ends: Ends) -> None:
    def refuse() -> str:
        raise OSError("no route to it")

    assert open_part(ends[1], refuse, OSError) is None
    assert ends[0].receive() == {"is": "failed", "reason": "no route to it"}
    ends[0].close()
    assert open_part(ends[1], refuse, OSError) is None  # the plant is gone, too


def test_a_program_gets_its_order_and_ignores_requests_to_end(monkeypatch: pytest.MonkeyPatch) -> None:
    here, there = open_link()
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = {number: signal.getsignal(number) for number in numbers}
    order = {"part": "arm", "link": there.detach()}
    seen: list[Mapping[str, Any]] = []

    def run(given: Mapping[str, Any], link: ProcessLink) -> None:
        seen.append(given)
        assert all(signal.getsignal(number) is signal.SIG_IGN for number in numbers)
        link.send({"is": "open"})
        link.close()

    monkeypatch.setattr(sys, "argv", ["process", json.dumps(order)])
    try:
        drive(run)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    assert seen == [order]
    assert here.receive() == {"is": "open"}
    with suppress(Exception):
        here.close()
