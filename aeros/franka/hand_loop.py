"""The loop that drives the hand, in a process of its own: its commands take seconds."""

from __future__ import annotations

import time
from contextlib import suppress
from typing import Any, Final

from aeros.franka.arm import Hand
from aeros.wired_arm.arm import ArmError
from aeros.wired_arm.link import LinkClosedError, ProcessLink, event

_POLL: Final = 0.2
"""Longest wait for a message, s."""


def run_hand(hand: Hand, link: ProcessLink) -> None:
    """Answer requests for the hand's state, and carry out commands, until the plant closes the link.

    Args:
        hand: the hand.
        link: to the plant.
    """
    try:
        while True:
            message = link.receive(_POLL)
            if isinstance(message, dict):
                if message["is"] == "close":
                    return
                link.send(_answer(hand, message))
    except LinkClosedError:
        return
    except ArmError as failure:
        with suppress(LinkClosedError):
            link.send(event("gone", reason=str(failure)))


def _answer(hand: Hand, message: dict[str, Any]) -> dict[str, Any]:
    """Do what a message asks for; `at` is on the machine's monotonic clock."""
    if message["is"] == "read":
        return event("hand", **_reading(hand))
    gap, speed, force = (float(message[name]) for name in ("gap", "speed", "force"))
    try:
        if gap >= hand.read().gap:
            hand.open(gap, speed)
        else:
            hand.close(gap, speed, force)
    except ArmError as failure:
        if not failure.is_connected:
            raise
        return event("gripped", reason=str(failure), **_reading(hand))
    return event("gripped", reason=None, **_reading(hand))


def _reading(hand: Hand) -> dict[str, Any]:
    state = hand.read()
    return {"gap": state.gap, "grasped": state.is_grasped, "at": time.monotonic()}
