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

from aeros.experiments.random_stream import RandomStream
from aeros.experiments.trial_plants import OpenPlant
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.ports import (
    EMPTY_LOG_HEAD,
    AuditEvent,
    EndedStep,
    LogHead,
    Readings,
    Runtime,
    StepHandle,
    StepRequest,
    StepResult,
)
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.model.model import Ecm, Site
from aeros.spec.verification.certificate import Certificate


class PlantState(NamedTuple):
    """What can be told of a plant without asking anything of it.

    counts: see `plants.OpenPlant`.
    chance: what chance has done to it, see `luck.RandomStream.observed_draws`.
    """

    now: float
    readings: Readings
    counts: Mapping[str, int]
    draws: Any


class RuntimeCall(NamedTuple):
    """What was asked, what came of it, how the plant was left, and what it took, seconds of processor."""

    request: tuple[str, tuple[Any, ...]]
    answer: Any
    state_after: PlantState
    took_s: float


@dataclass
class PlantTrace:
    """What one plant has done.

    open_s: seconds of processor that opening the plant and closing it took.
    """

    initial_state: PlantState
    calls: list[RuntimeCall] = field(default_factory=list)
    open_s: float = 0.0


class PlantTraceCache:
    """Of plants that may be compared, the takes: those of the plants that were asked for last."""

    def __init__(self) -> None:
        self._whose = ""
        self._takes: list[PlantTrace] = []

    def traces(self, plants: str) -> list[PlantTrace]:
        """Those there are, to be followed and added to."""
        if plants != self._whose:
            self._whose, self._takes = plants, []
        return self._takes


class LivePlant(NamedTuple):
    """A plant that is open, and a runtime on it."""

    runtime: Runtime
    opened: OpenPlant


class _TraceRecorder:
    """A plant that is open, and the take that is made of it."""

    def __init__(self, live: LivePlant, luck: RandomStream) -> None:
        self._live = live
        self._luck = luck
        self.take = PlantTrace(self._state())

    def call(self, asked: tuple[str, tuple[Any, ...]]) -> RuntimeCall:
        """Ask it, and add what comes of it to the take."""
        name, arguments = asked
        began = process_time()
        answer = getattr(self._live.runtime, name)(*arguments)
        exchange = RuntimeCall(asked, answer, self._state(), process_time() - began)
        self.take.calls.append(exchange)
        return exchange

    def _state(self) -> PlantState:
        runtime, opened = self._live
        return PlantState(
            runtime.now(), runtime.observe(), dict(opened.counts), self._luck.observed_draws(opened)
        )


class ReplayingRuntime:
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
        takes: list[PlantTrace],
        luck: RandomStream,
        opened: Callable[[], AbstractContextManager[LivePlant]],
    ) -> None:
        self._configuration = configuration
        self._takes = takes
        self._luck = luck
        self._opened = opened
        self._done: list[RuntimeCall] = []
        self._spent_s = 0.0
        self._stack = ExitStack()
        self._live: _TraceRecorder | None = None
        self._followed = [one for one in takes if luck.reproduces(one.initial_state.draws)]
        if not self._followed:
            self._live = self._open_and_replay()
        self._state = self._live.take.initial_state if self._live else self._followed[0].initial_state

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
    def state(self) -> PlantState:
        """How the plant is left."""
        return self._state

    @property
    def cpu_time_s(self) -> float:
        """Seconds of processor that a plant of its own has taken so far, with whatever was asked again."""
        return self._spent_s

    @property
    def unshared_cpu_time_s(self) -> float:
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
        started: StepHandle | StepResult = self._call("start", request)
        return started

    def wait(self, until: float = inf) -> EndedStep | None:
        """See `ports.Runtime`."""
        ended: EndedStep | None = self._call("wait", until)
        return ended

    def cancel(self, step: StepHandle, reason: str) -> None:
        """See `ports.Runtime`."""
        self._call("cancel", step, reason)

    def note(self, event: str, details: Mapping[str, Any]) -> None:
        """Nobody reads it."""

    def log_head(self) -> LogHead:
        """Where nothing is recorded yet."""
        return EMPTY_LOG_HEAD

    def events_since(self, head: LogHead) -> tuple[AuditEvent, ...]:
        """Nothing is recorded."""
        return ()

    # Inside.

    def _call(self, name: str, *arguments: Any) -> Any:
        asked, place = (name, arguments), len(self._done)
        if self._live is None:
            self._followed = [
                one
                for one in self._followed
                if len(one.calls) > place
                and one.calls[place].request == asked
                and self._luck.reproduces(one.calls[place].state_after.draws)
            ]
            if not self._followed:
                self._live = self._open_and_replay()
        if self._live is None:
            found = self._followed[0].calls[place]
        else:
            found = self._live.call(asked)
            self._spent_s += found.took_s
        self._done.append(found)
        self._state = found.state_after
        return found.answer

    def _open_and_replay(self) -> _TraceRecorder:
        """A plant of its own, asked everything that was asked so far."""
        began = process_time()
        opening = self._opened()
        open_from = process_time()
        recorder = _TraceRecorder(self._stack.enter_context(opening), self._luck)
        recorder.take.open_s = process_time() - open_from
        for old in self._done:
            new = recorder.call(old.request)
            is_same = (new.answer, new.state_after.now) == (old.answer, old.state_after.now)
            if not is_same or not self._luck.reproduces(new.state_after.draws):
                raise InternalError(f"asked the same, a plant did something else: {old.answer}, {new.answer}")
        self._takes.append(recorder.take)
        self._spent_s += process_time() - began
        return recorder
