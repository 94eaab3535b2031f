"""Cache of plant behaviour: trials share what a plant did while their requests and random draws are the same.

What a plant did is kept as a trace while trials run whose plants might do the same (`random_stream.py`).  A
trial follows traces, and nothing is simulated, until it makes a request that no trace has at that point, or
its draws differ there.  Then it opens a plant of its own, which is given all earlier requests again and must
give the same answers; what follows becomes the next trace.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
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
    Obstacle,
    Readings,
    Runtime,
    StepHandle,
    StepRequest,
    StepResult,
)
from aeros.sim.referee import truth_of
from aeros.spec.diagnostics.errors import InternalError, MisuseError
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.verification.certificate import Certificate


class PlantState(NamedTuple):
    """State of a plant that is known without a request to it.

    Attributes:
        now: plant time, s.
        readings: value (SI) and plant time (s) of each state variable, by name.
        counts: see `trial_plants.OpenPlant`.
        draws: random draws so far, see `random_stream.RandomStream.observed_draws`.
        truth: truth of each state variable that the plant's scene defines; only the referee reads it.
    """

    now: float
    readings: Readings
    counts: Mapping[str, int]
    draws: Any
    truth: Mapping[str, int]


class RuntimeCall(NamedTuple):
    """A call to the runtime.

    Attributes:
        request: name of the method, and its arguments.
        answer: its return value.
        state_after: state of the plant after it.
        took_s: processor time, s.
    """

    request: tuple[str, tuple[Any, ...]]
    answer: Any
    state_after: PlantState
    took_s: float


@dataclass
class PlantTrace:
    """Record of what one plant did.

    Attributes:
        initial_state: state before the first call.
        calls: calls in order.
        open_s: processor time for opening and closing the plant, s.
    """

    initial_state: PlantState
    calls: list[RuntimeCall] = field(default_factory=list)
    open_s: float = 0.0


class PlantTraceCache:
    """Cache of traces, of the one group of plants that was used last."""

    def __init__(self) -> None:
        self._whose = ""
        self._traces: list[PlantTrace] = []

    def traces(self, plants: str) -> list[PlantTrace]:
        """Return the traces of a group of plants, and forget those of any other.

        Args:
            plants: name of the group; plants of a group may be compared.

        Returns:
            A list that the caller follows and adds to.
        """
        if plants != self._whose:
            self._whose, self._traces = plants, []
        return self._traces


class LivePlant(NamedTuple):
    """An open plant, and a runtime on it.

    Attributes:
        runtime: runtime that runs skills on it.
        opened: the open plant.
    """

    runtime: Runtime
    opened: OpenPlant


class _TraceRecorder:
    """Recorder of the trace of an open plant."""

    def __init__(self, live: LivePlant, stream: RandomStream) -> None:
        self._live = live
        self._stream = stream
        self.trace = PlantTrace(self._state())

    def call(self, request: tuple[str, tuple[Any, ...]]) -> RuntimeCall:
        """Call the runtime, and add the call to the trace."""
        name, arguments = request
        began = process_time()
        answer = getattr(self._live.runtime, name)(*arguments)
        call = RuntimeCall(request, answer, self._state(), process_time() - began)
        self.trace.calls.append(call)
        return call

    def _state(self) -> PlantState:
        runtime, opened = self._live
        return PlantState(
            runtime.now(),
            runtime.observe(),
            dict(opened.counts),
            self._stream.observed_draws(opened),
            truth_of(opened.plant),
        )


class ReplayingRuntime:
    """Runtime that follows traces as far as it can, and then records another.

    An agent's notes are not kept, and there is no record to read back.

    Args:
        configuration: the modules under their site.
        traces: of plants that may be compared; a new one is added where a plant is opened.
        stream: random draws of the trial.
        opened: returns a context that opens a plant for the trial's condition and seed, and a runtime on it;
            what `opened` does itself, once for many trials, does not count as time of a trial.
    """

    def __init__(
        self,
        configuration: Configuration,
        traces: list[PlantTrace],
        stream: RandomStream,
        opened: Callable[[], AbstractContextManager[LivePlant]],
    ) -> None:
        self._configuration = configuration
        self._traces = traces
        self._stream = stream
        self._opened = opened
        self._done: list[RuntimeCall] = []
        self._spent_s = 0.0
        self._stack = ExitStack()
        self._live: _TraceRecorder | None = None
        self._followed = [one for one in traces if stream.reproduces(one.initial_state.draws)]
        if not self._followed:
            self._live = self._open_and_replay()
        self._state = self._live.trace.initial_state if self._live else self._followed[0].initial_state

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        began = process_time()
        self._stack.close()
        if self._live is not None:
            closing_s = process_time() - began
            self._live.trace.open_s += closing_s
            self._spent_s += closing_s

    @property
    def state(self) -> PlantState:
        """State of the plant after the last call."""
        return self._state

    @property
    def cpu_time_s(self) -> float:
        """Processor time of a plant of its own so far, repeated requests included, s."""
        return self._spent_s

    @property
    def unshared_cpu_time_s(self) -> float:
        """Processor time that would have been needed with nothing shared or repeated, s."""
        trace = self._live.trace if self._live else self._followed[0]
        return trace.open_s + sum(one.took_s for one in self._done)

    @property
    def is_live(self) -> bool:
        """True once a plant of its own has been opened."""
        return self._live is not None

    def obstacles(self) -> Sequence[Obstacle]:
        """Implement `Runtime.obstacles`: what a recorded plant saw is not kept."""
        return ()

    @property
    def site(self) -> Site:
        """The site of the configuration."""
        return self._configuration.site

    @property
    def is_stopped(self) -> bool:
        """False: no operator stops a trial."""
        return False

    def active_modules(self) -> Mapping[str, Ecm]:
        """Implement `Runtime.active_modules`."""
        return self._configuration.modules

    def certificate(self, module: str) -> Certificate | None:
        """Implement `Runtime.certificate`."""
        return self._configuration.certificates.get(module)

    def now(self) -> float:
        """Implement `Runtime.now`."""
        return self._state.now

    def attend(self, modules: frozenset[str] | None) -> None:
        """Implement `Runtime.attend`: nothing is perceived here."""

    def set_memories(self, memories: Mapping[str, Mapping[str, Any]]) -> None:
        """Implement `Runtime.set_memories`: nothing is perceived here."""

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        """Implement `Runtime.set_parameters`: every trial has the defaults.

        Raises:
            MisuseError: other values are given.
        """
        known = {
            name: one for ecm in self.active_modules().values() for name, one in ecm.task_parameters.items()
        }
        if any(value != known[name].default for name, value in values.items()):
            raise MisuseError("a trial has the default parameters of its task")

    def observe(self) -> Readings:
        """Implement `Runtime.observe`."""
        return self._state.readings

    def start(self, request: StepRequest) -> StepHandle | StepResult:
        """Implement `Runtime.start`."""
        started: StepHandle | StepResult = self._call("start", request)
        return started

    def wait(self, until: float = inf) -> EndedStep | None:
        """Implement `Runtime.wait`."""
        ended: EndedStep | None = self._call("wait", until)
        return ended

    def cancel(self, step: StepHandle, reason: str) -> None:
        """Implement `Runtime.cancel`."""
        self._call("cancel", step, reason)

    def note(self, event: str, details: Mapping[str, Any]) -> None:
        """Implement `Runtime.note`: discards the note."""

    def log_head(self) -> LogHead:
        """Implement `Runtime.log_head`: the head of an empty log."""
        return EMPTY_LOG_HEAD

    def events_since(self, head: LogHead) -> tuple[AuditEvent, ...]:
        """Implement `Runtime.events_since`: nothing is recorded."""
        return ()

    def _call(self, name: str, *arguments: Any) -> Any:
        request, place = (name, arguments), len(self._done)
        if self._live is None:
            self._followed = [
                one
                for one in self._followed
                if len(one.calls) > place
                and one.calls[place].request == request
                and self._stream.reproduces(one.calls[place].state_after.draws)
            ]
            if not self._followed:
                self._live = self._open_and_replay()
        if self._live is None:
            found = self._followed[0].calls[place]
        else:
            found = self._live.call(request)
            self._spent_s += found.took_s
        self._done.append(found)
        self._state = found.state_after
        return found.answer

    def _open_and_replay(self) -> _TraceRecorder:
        """Open a plant of its own, and repeat all earlier calls on it.

        Raises:
            InternalError: the plant is not deterministic.
        """
        began = process_time()
        opening = self._opened()
        open_from = process_time()
        recorder = _TraceRecorder(self._stack.enter_context(opening), self._stream)
        recorder.trace.open_s = process_time() - open_from
        for old in self._done:
            new = recorder.call(old.request)
            is_same = (new.answer, new.state_after.now) == (old.answer, old.state_after.now)
            if not is_same or not self._stream.reproduces(new.state_after.draws):
                raise InternalError(f"plant is not deterministic: {old.answer} before, {new.answer} now")
        self._traces.append(recorder.trace)
        self._spent_s += process_time() - began
        return recorder
