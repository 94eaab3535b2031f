"""Trials share what a plant has done, as long as they ask the same of it and chance would do the same.

What a plant does is kept, as a *take*, while trials go on whose plants might do the same (`luck.py`).  A
trial follows takes, and nothing is simulated, until it asks what nobody has asked there, or its luck is
another there; then a plant of its own is asked everything again, which has to come to the same, and what
follows is the next take.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, field
from math import inf
from time import process_time
from typing import Any, NamedTuple, Self

from aeros.experiments.random_stream import Luck
from aeros.experiments.trial_plants import Opened
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.ports import (
    BEGINNING,
    Ended,
    Head,
    Readings,
    Runtime,
    Said,
    StepHandle,
    StepRequest,
    StepResult,
)
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.model.model import Ecm, Site
from aeros.spec.verification.certificate import Certificate


class State(NamedTuple):
    """What can be told of a plant without asking anything of it.

    counts: see `plants.Opened`.
    chance: what chance has done to it, see `luck.Luck.seen`.
    """

    now: float
    readings: Readings
    counts: Mapping[str, int]
    chance: Any


class Exchange(NamedTuple):
    """What was asked, what came of it, how the plant was left, and what it took, seconds of processor."""

    asked: tuple[str, tuple[Any, ...]]
    answer: Any
    after: State
    took_s: float


@dataclass
class Take:
    """What one plant has done.

    open_s: seconds of processor that opening the plant and closing it took.
    """

    before: State
    exchanges: list[Exchange] = field(default_factory=list)
    open_s: float = 0.0


class Takes:
    """Of plants that may be compared, the takes: those of the plants that were asked for last."""

    def __init__(self) -> None:
        self._whose = ""
        self._takes: list[Take] = []

    def of(self, plants: str) -> list[Take]:
        """Those there are, to be followed and added to."""
        if plants != self._whose:
            self._whose, self._takes = plants, []
        return self._takes


class Live(NamedTuple):
    """A plant that is open, and a runtime on it."""

    runtime: Runtime
    opened: Opened


class _Recorder:
    """A plant that is open, and the take that is made of it."""

    def __init__(self, live: Live, luck: Luck) -> None:
        self._live = live
        self._luck = luck
        self.take = Take(self._state())

    def ask(self, asked: tuple[str, tuple[Any, ...]]) -> Exchange:
        """Ask it, and add what comes of it to the take."""
        name, arguments = asked
        began = process_time()
        answer = getattr(self._live.runtime, name)(*arguments)
        exchange = Exchange(asked, answer, self._state(), process_time() - began)
        self.take.exchanges.append(exchange)
        return exchange

    def _state(self) -> State:
        runtime, opened = self._live
        return State(runtime.now(), runtime.observe(), dict(opened.counts), self._luck.seen(opened))


class FollowingRuntime:
    """A runtime (`ports.Runtime`) that follows takes as far as it can, and then makes another.

    takes: of plants that may be compared.
    luck: the trial's.
    opened: gives what opens the plant, as the trial's condition and seed have it, and a runtime on it; what
        it does by itself, once for many trials, is no part of what a trial takes.
    What an agent notes is kept nowhere, and there is no record to read back.
    """

    def __init__(
        self,
        configuration: Configuration,
        takes: list[Take],
        luck: Luck,
        opened: Callable[[], AbstractContextManager[Live]],
    ) -> None:
        self._configuration = configuration
        self._takes = takes
        self._luck = luck
        self._opened = opened
        self._done: list[Exchange] = []
        self._spent_s = 0.0
        self._stack = ExitStack()
        self._live: _Recorder | None = None
        self._followed = [one for one in takes if luck.would_do(one.before.chance)]
        if not self._followed:
            self._live = self._opened_anew()
        self._state = self._live.take.before if self._live else self._followed[0].before

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        began = process_time()
        self._stack.close()
        if self._live is not None:
            closing_s = process_time() - began
            self._live.take.open_s += closing_s
            self._spent_s += closing_s

    @property
    def state(self) -> State:
        """How the plant is left."""
        return self._state

    @property
    def spent_s(self) -> float:
        """Seconds of processor that a plant of its own has taken so far, with whatever was asked again."""
        return self._spent_s

    @property
    def alone_s(self) -> float:
        """Seconds of processor that it would have taken, if nothing had been shared or asked again."""
        take = self._live.take if self._live else self._followed[0]
        return take.open_s + sum(one.took_s for one in self._done)

    @property
    def is_live(self) -> bool:
        """Whether a plant of its own has been opened."""
        return self._live is not None

    @property
    def site(self) -> Site:
        """See `ports.Runtime`."""
        return self._configuration.site

    @property
    def is_stopped(self) -> bool:
        """See `ports.Runtime`; in a trial nobody does."""
        return False

    def active_modules(self) -> Mapping[str, Ecm]:
        """See `ports.Runtime`."""
        return self._configuration.modules

    def certificate(self, module: str) -> Certificate | None:
        """See `ports.Runtime`."""
        return self._configuration.certificates.get(module)

    def now(self) -> float:
        """See `ports.Runtime`."""
        return self._state.now

    def observe(self) -> Readings:
        """See `ports.Runtime`."""
        return self._state.readings

    def start(self, request: StepRequest) -> StepHandle | StepResult:
        """See `ports.Runtime`."""
        started: StepHandle | StepResult = self._ask("start", request)
        return started

    def wait(self, until: float = inf) -> Ended | None:
        """See `ports.Runtime`."""
        ended: Ended | None = self._ask("wait", until)
        return ended

    def cancel(self, step: StepHandle, reason: str) -> None:
        """See `ports.Runtime`."""
        self._ask("cancel", step, reason)

    def note(self, event: str, details: Mapping[str, Any]) -> None:
        """Nobody reads it."""

    def head(self) -> Head:
        """Where nothing is recorded yet."""
        return BEGINNING

    def said_since(self, head: Head) -> tuple[Said, ...]:
        """Nothing is recorded."""
        return ()

    # Inside.

    def _ask(self, name: str, *arguments: Any) -> Any:
        asked, place = (name, arguments), len(self._done)
        if self._live is None:
            self._followed = [
                one
                for one in self._followed
                if len(one.exchanges) > place
                and one.exchanges[place].asked == asked
                and self._luck.would_do(one.exchanges[place].after.chance)
            ]
            if not self._followed:
                self._live = self._opened_anew()
        if self._live is None:
            found = self._followed[0].exchanges[place]
        else:
            found = self._live.ask(asked)
            self._spent_s += found.took_s
        self._done.append(found)
        self._state = found.after
        return found.answer

    def _opened_anew(self) -> _Recorder:
        """A plant of its own, asked everything that was asked so far."""
        began = process_time()
        opening = self._opened()
        open_from = process_time()
        recorder = _Recorder(self._stack.enter_context(opening), self._luck)
        recorder.take.open_s = process_time() - open_from
        for old in self._done:
            new = recorder.ask(old.asked)
            is_same = (new.answer, new.after.now) == (old.answer, old.after.now)
            if not is_same or not self._luck.would_do(new.after.chance):
                raise InternalError(f"asked the same, a plant did something else: {old.answer}, {new.answer}")
        self._takes.append(recorder.take)
        self._spent_s += process_time() - began
        return recorder
