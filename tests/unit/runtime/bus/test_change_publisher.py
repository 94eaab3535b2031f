"""A message equal to the previous one is not published again."""

from __future__ import annotations

from aeros.runtime.bus.change_publisher import ChangePublisher
from aeros.runtime.bus.in_process import InProcessBus
from aeros.runtime.bus.messages import String


def test_only_changes_are_published() -> None:
    bus = InProcessBus()
    heard = bus.subscribe("/said", String)
    changes = ChangePublisher(bus.publisher("/said", String))
    for text in ("a", "a", "b", "a"):
        changes.publish(String(text))
    got = []
    while (message := heard.receive()) is not None:
        got.append(message.data)
    assert got == ["a", "b", "a"]
