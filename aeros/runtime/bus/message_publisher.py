"""Which message says what of a run, and where.  What cannot be said is counted, and hides nothing else."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Generic, NamedTuple

from aeros.runtime.bus.measurement_messages import (
    chain_joints_of,
    joints_of,
    place,
    places_of,
    single,
    singles_of,
)
from aeros.runtime.bus.messages import Decision, Event, JointState, PointStamped, TFMessage, Time, stamp
from aeros.runtime.bus.names import checked_name
from aeros.runtime.bus.port import M, Publisher, Publishing
from aeros.runtime.bus.record_messages import event_of
from aeros.runtime.bus.transforms import transforms
from aeros.runtime.ports import Body, Readings, Triple
from aeros.spec.model.model import Site


class Chain(NamedTuple):
    """What a plant has said of its robot: the body, and where its base is in W, m; None: not known."""

    body: Body | None = None
    base: Triple | None = None


class Telling:
    """Publishes records and states on `bus`.

    site: whose vocabulary is spoken; a name of it that ROS 2 does not allow in a topic is not told.
    missed: called, with the reason, for each message that cannot be made or published.
    """

    def __init__(self, bus: Publishing, site: Site, missed: Callable[[str], None]) -> None:
        self._missed = missed
        self._last = Time()  # on the plant's clock
        self._joints = [(one, _News(bus.publisher("/joint_states", JointState))) for one in joints_of(site)]
        self._places = {
            name: _News(bus.publisher(f"/aeros/state/{name}", PointStamped))
            for name in places_of(site)
            if _is_token(name)
        }
        self._singles = {
            name: (kind, _News(bus.publisher(f"/aeros/state/{name}", kind)))
            for name, kind in singles_of(site).items()
            if _is_token(name)
        }
        self._chain_joints = chain_joints_of(site)
        self._transforms = _News(bus.publisher("/tf", TFMessage))
        self._events = bus.publisher("/aeros/events", Event)
        self._decisions = bus.publisher("/aeros/decisions", Decision)

    def record(self, line: bytes) -> None:
        """A record of the audit log."""
        with self._missing():
            event, decision = event_of(line, self._last)
            self._events.publish(event)
            if decision is not None:
                self._decisions.publish(decision)

    def state(self, readings: Readings, chain: Chain) -> None:
        """What was measured, of a robot of which `chain` is known."""
        if not readings:
            return
        with self._missing():
            self._last = stamp(max(reading.time for reading in readings.values()))
        for joints, states in self._joints:
            with self._missing():
                for message in joints.states(readings):
                    states.publish(message)
        for name, places in self._places.items():
            if name in readings:
                with self._missing():
                    places.publish(place(readings[name]))
        for name, (kind, singles) in self._singles.items():
            if name in readings:
                with self._missing():
                    singles.publish(single(readings[name], kind))
        with self._missing():
            self._tell_chain(readings, chain)

    def _tell_chain(self, readings: Readings, chain: Chain) -> None:
        if self._chain_joints is None or chain.body is None:
            return
        name, joints = self._chain_joints
        if name in readings:
            q, time = readings[name].value, readings[name].time
            self._transforms.publish(transforms(chain.body, chain.base, joints, q, stamp(time)))

    @contextmanager
    def _missing(self) -> Iterator[None]:
        try:
            yield
        # Whatever is wrong with a value or a bus, the run goes on, and so does what else there is to say.
        except Exception as wrong:
            self._missed(str(wrong) or type(wrong).__name__)


class _News(Generic[M]):
    """Publishes what is not the same as what it published last: one instant is looked at more than once."""

    def __init__(self, publisher: Publisher[M]) -> None:
        self._publisher = publisher
        self._last: M | None = None

    def publish(self, message: M) -> None:
        if message != self._last:
            self._last = message
            self._publisher.publish(message)


def _is_token(name: str) -> bool:
    try:
        checked_name(f"/{name}")
    except ValueError:
        return False
    return True
