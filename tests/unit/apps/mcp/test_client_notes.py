"""Notes about clients are limited in rate; those of what moves or stops the robot are not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.apps.mcp.client_notes import BURST, ClientNotes


def test_after_a_burst_one_note_a_second_is_written_and_the_dropped_ones_are_counted() -> None:
    written: list[Mapping[str, Any]] = []
    now = 100.0
    notes = ClientNotes(lambda _, details: written.append(details), lambda: now)
    assert [notes.add("rejected", {}) for _ in range(BURST + 7)] == [True] * BURST + [False] * 7
    now = 100.9
    assert not notes.add("rejected", {})
    now = 101.1
    assert notes.add("rejected", {"reason": "x"})
    assert written[-1] == {"reason": "x", "dropped_before": 8}
    assert not notes.add("rejected", {})
    notes.write_always("stopped", {"client": "c"})
    assert written[-1] == {"client": "c"}
    now = 1e6
    assert [notes.add("rejected", {}) for _ in range(BURST + 1)] == [True] * BURST + [False]
