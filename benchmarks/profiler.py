"""Profiler of processor time: how much each part of a run takes, without the parts that it calls."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

Part = tuple[str, Any, tuple[str, ...]]
"""Part whose time is counted: its name, a class or module, and the functions by which others call it."""


class TimeShares:
    """Processor seconds spent in each part, without the parts that it calls.

    Args:
        rest: name of the time that is in no part.
    """

    def __init__(self, rest: str) -> None:
        self.seconds: defaultdict[str, float] = defaultdict(float)
        self._rest = rest
        self._inside: list[str] = []
        self._since = time.process_time()

    def _switch_to(self, part: str | None) -> None:
        now = time.process_time()
        self.seconds[self._inside[-1] if self._inside else self._rest] += now - self._since
        self._since = now
        if part is None:
            self._inside.pop()
        else:
            self._inside.append(part)

    def wrap(self, part: str, method: Callable[..., Any]) -> Callable[..., Any]:
        """Wrap `method` so that its time counts for `part`."""

        def call(*arguments: Any, **named: Any) -> Any:
            self._switch_to(part)
            try:
                return method(*arguments, **named)
            finally:
                self._switch_to(None)

        return call


@contextmanager
def measure_shares(parts: Sequence[Part], rest: str) -> Iterator[TimeShares]:
    """Count the time of each part while the block runs; reading the clock so often takes time, too."""
    shares = TimeShares(rest)
    methods = [
        (part, next(one for one in owner.__mro__ if name in vars(one)), name)
        for part, owner, names in parts
        for name in names
    ]
    kept = [(owner, name, vars(owner)[name]) for _, owner, name in methods]
    for part, owner, name in methods:
        setattr(owner, name, shares.wrap(part, vars(owner)[name]))
    try:
        yield shares
    finally:
        for owner, name, method in kept:
            setattr(owner, name, method)
