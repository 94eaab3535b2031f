"""One perceiver of an active module: when it is called, what it sees, and what its values are."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from math import floor, inf, isfinite
from typing import Any, Final

from aeros.runtime.execution.step import ObservationFilter
from aeros.runtime.perception.perceiver_run import (
    OpenPerceiver,
    PerceiverError,
    PerceiverRun,
    ViewInput,
)
from aeros.runtime.perception.value_check import InvalidValuesError, PerceivedValueCheck
from aeros.runtime.ports import CameraPicture, Reading, Readings
from aeros.runtime.records.failed_measurements import RecordEvent
from aeros.runtime.skills.contract import SkillRefusedError
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import MEMORY, Perceiver
from aeros.spec.model.site import Site

MAX_SAMPLES: Final = 1000
"""Limit on the samples of one reading in a view; the newest are kept."""

FIRST_BACK_OFF: Final = 0.5
"""Plant time from the first failure to the next call, s; doubled with each further failure in a row."""

LAST_BACK_OFF: Final = 30.0
"""Greatest plant time from a failure to the next call, s."""

_ROUNDING: Final = 1e-9
"""Share of a period by which a tick may come before a sample is due: ticks are rounded."""


class ActivePerceiver:
    """A perceiver of an active module.

    Its values are those of its latest answer, each with the time that it states, or else that of the oldest
    picture in the view.
    A failure leaves all of them unknown until the next answer. It is called again for a new picture after a
    time that doubles with each failure, so that nothing depends on the speed of this machine but its timeout.

    Attributes:
        values: its values by full name; unknown ones are absent.

    Args:
        site: the site in force, with the variables of the modules.
        ecm: the module.
        perceiver: the perceiver of it.
        open_perceiver: opens its runs.
        record: writes events.
        memories: returns the tables from memory, by module.
    """

    def __init__(
        self,
        site: Site,
        ecm: Ecm,
        perceiver: Perceiver,
        open_perceiver: OpenPerceiver,
        record: RecordEvent,
        memories: Callable[[], Mapping[str, Mapping[str, Any]]] = dict,
    ) -> None:
        self.values: dict[str, Reading] = {}
        self._site, self._ecm, self._perceiver = site, ecm, perceiver
        self._open, self._record, self._memories = open_perceiver, record, memories
        self._run: PerceiverRun | None = None
        self._check = PerceivedValueCheck(ecm, perceiver)
        self._unsure: frozenset[str] = frozenset()
        self._sees = ObservationFilter(ecm, site)
        self._readings = perceiver.read_as
        # What its module perceives or defines does not change between two calls.
        own = {name for name, one in ecm.state.items() if one.sensor is None or "." in one.sensor}
        self._sampled = [name for name in perceiver.readings if name not in own]
        self._samples: dict[str, deque[tuple[float, Any]]] = {
            seen_as: deque(maxlen=MAX_SAMPLES)
            for seen_as, name in self._readings.items()
            if name in self._sampled
        }
        self._is_sampling = perceiver.rate is not None
        self._rate = float(site.perception.rate if perceiver.rate is None else perceiver.rate)
        self._last_sample = self._last_call = -inf
        self._called_with: dict[str, float] | None = None
        self._failures = 0
        self._retry_at = -inf

    @property
    def needs_pictures(self) -> bool:
        """True if it asks for pictures."""
        return bool(self._perceiver.pictures)

    @property
    def needs_sampling(self) -> bool:
        """True if readings are sampled for it at control ticks."""
        return self._is_sampling and bool(self._sampled)

    def sample(self, now: float, measured: Mapping[str, Any], observe: Callable[[], Readings]) -> None:
        """Sample its readings at a control tick, if a sample is due.

        Args:
            now: plant time, s.
            measured: values or readings that the tick measured, by vocabulary name.
            observe: measures all others.
        """
        if not self._is_due(now, self._last_sample):
            return
        self._last_sample = now
        fresh = {
            name: value if type(value := measured[name]) is Reading else Reading(value, now)
            for name in self._sampled
            if name in measured
        }
        if len(fresh) < len(self._sampled):
            observed = observe()
            fresh |= {
                name: observed[name] for name in self._sampled if name in observed and name not in fresh
            }
        seen = self._sees.observe(fresh, now)
        for short, samples in self._samples.items():
            if short in seen:
                time = fresh[self._readings[short]].time
                if not samples or samples[-1][0] < time:
                    samples.append((time, seen[short]))

    def update(
        self, now: float, readings: Readings, pictures: Mapping[str, CameraPicture], least_timeout: float
    ) -> None:
        """Call the perceiver if there is something new for it to see.

        Args:
            now: plant time, s.
            readings: what is measured now, of the plant and of the modules.
            pictures: newest picture of each camera.
            least_timeout: least limit on the real time of the call, s.
        """
        chosen = self._chosen_pictures(now, pictures)
        if chosen is None or now < self._retry_at:
            return
        times = {name: one.time for name, one in chosen.items()}
        if times == self._called_with and (chosen or not self._is_due(now, self._last_call)):
            return
        self._called_with, self._last_call = times, now
        seen = self._sees.observe(readings, now)
        view = ViewInput(
            now,
            {
                **self._perceiver.constants,
                **({MEMORY: self._memories().get(self._ecm.id, {})} if self._perceiver.recalls else {}),
                **{name: seen[name] for name in self._readings if name in seen},
            },
            {name: tuple(samples) for name, samples in self._samples.items() if self._is_sampling},
            chosen,
        )
        for samples in self._samples.values():
            samples.clear()
        self._call(view, (min(times.values(), default=now), max(times.values(), default=now)), least_timeout)

    def close(self) -> None:
        """End its run and forget its values; safe to call twice."""
        self.values = {}
        if self._run is not None:
            self._run.close()
            self._run = None

    def _call(self, view: ViewInput, times: tuple[float, float], least_timeout: float) -> None:
        """Call it; `times` are those of the oldest and of the newest picture, s."""
        try:
            if self._run is None:
                self._run = self._open(self._site, self._ecm, self._perceiver)
            perceived = self._run.perceive(view, max(float(self._perceiver.timeout), least_timeout))
            values = self._check(perceived, *times)
        except (PerceiverError, SkillRefusedError) as failure:
            self.close()
            self._note_failure(view.time, str(failure))
        except InvalidValuesError as failure:
            self.values = {}
            self._note_failure(view.time, str(failure))
        else:
            self.values = values
            unsure = self._check.unsure
            if unsure.keys() != self._unsure:
                # An empty one says that all are certain again.
                self._record("perceiver-unsure", {**self._identity(), "uncertainties": dict(unsure)})
                self._unsure = frozenset(unsure)
            if self._failures:
                self._record("perceiver-recovered", {**self._identity(), "after_failures": self._failures})
                self._failures = 0

    def _note_failure(self, now: float, reason: str) -> None:
        self._failures += 1
        pause = min(FIRST_BACK_OFF * 2.0 ** min(self._failures - 1, 30), LAST_BACK_OFF)
        self._retry_at = now + pause
        self._record(
            "perceiver-failed",
            {
                **self._identity(),
                "reason": reason,
                "at": now,
                "failures": self._failures,
                "not_before": self._retry_at,
                "unknown": sorted(self._perceiver.provides),
            },
        )

    def _identity(self) -> dict[str, str]:
        return {"module": self._ecm.id, "perceiver": self._perceiver.id}

    def _is_due(self, now: float, last: float) -> bool:
        """Return True if a period of its rate, or else of the site's highest, has begun after `last`."""
        return last == -inf or (now > last and self._period(now) > self._period(last))

    def _period(self, time: float) -> int:
        return floor(time * self._rate + _ROUNDING)

    def _chosen_pictures(
        self, now: float, pictures: Mapping[str, CameraPicture]
    ) -> dict[str, CameraPicture] | None:
        """Return the pictures that it asks for and may get; None if one that it needs is missing."""
        chosen: dict[str, CameraPicture] = {}
        for asked in self._perceiver.pictures:
            picture, camera = pictures.get(asked.camera), self._site.cameras.get(asked.camera)
            if picture is None and asked.optional:
                continue
            is_allowed = (
                camera is not None
                and camera.sensor in self._ecm.requested_access.sensors
                and asked.width <= camera.width
                and asked.height <= camera.height
            )
            if picture is None or not is_allowed or not (isfinite(picture.time) and picture.time <= now):
                return None
            chosen[asked.name] = picture
        return None if self.needs_pictures and not chosen else chosen
