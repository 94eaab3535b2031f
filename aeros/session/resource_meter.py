"""Meter of the resources that modules use in a run: memory, time of answers and processes, with their limits.

It is published for people who look on (`aeros top`) and decides nothing.  A limit is enforced where the code
runs: by the worker's resource limits and by the time limit of each answer.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any, Final

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.isolation.isolated_code import IsolatedCode
from aeros.runtime.isolation.run_factory import limits_in_force
from aeros.runtime.perception.perceiver_run import OpenPerceiver, Perceived, PerceiverRun, ViewInput
from aeros.runtime.skills.in_process_run import OpenRun, SkillRunProtocol, SkillRunResult
from aeros.skill import Action, Observation
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.perception import Perceiver
from aeros.spec.model.site import Site

PERIOD_S: Final = 0.5
"""Minimum time between two readings of the memory of processes, s of real time."""


@dataclass
class _CodeUse:
    """Limits on code in processes of one kind, and what it has used so far.

    Attributes:
        memory_limit: bytes beyond the interpreter's; None in the runtime's own process.
        answer_limit: s of real time; None in the runtime's own process.
        longest_answer: s of real time.
        memory_peak: bytes beyond the interpreter's; None if it is not known.
        started: number of runs that were opened.
        running: runs that are open.
    """

    memory_limit: int | None = None
    answer_limit: float | None = None
    longest_answer: float = 0.0
    memory_peak: int | None = None
    started: int = 0
    running: list[SkillRunProtocol | PerceiverRun] = field(default_factory=list)

    def opened(self, run: SkillRunProtocol | PerceiverRun) -> None:
        """Count a run that was opened."""
        self.started += 1
        self.running.append(run)

    def closing(self, run: SkillRunProtocol | PerceiverRun) -> None:
        """Read the memory of a run for the last time; safe to call twice."""
        if run in self.running:
            self.read_memory(run)
            self.running.remove(run)

    def answered(self, seconds: float) -> None:
        """Note the time of an answer."""
        self.longest_answer = max(self.longest_answer, seconds)

    def read_memory(self, run: SkillRunProtocol | PerceiverRun) -> None:
        """Read the memory of the process of a run, if it has one."""
        peak = run.memory_peak() if isinstance(run, IsolatedCode) else None
        if peak is not None:
            self.memory_peak = max(self.memory_peak or 0, peak)

    def as_json(self) -> dict[str, Any]:
        """Return limits and use as JSON values."""
        for run in tuple(self.running):
            self.read_memory(run)
        return {
            "memory": {"used": self.memory_peak, "at_most": self.memory_limit},
            "answer": {"longest": self.longest_answer, "at_most": self.answer_limit},
            "processes": {"running": len(self.running), "started": self.started},
        }


@dataclass
class _ModuleUse:
    """Use of one module: its skills, its perceivers by name, and the access that it is permitted."""

    is_isolated: bool
    skills: _CodeUse
    perceivers: dict[str, _CodeUse]
    devices: list[str]
    channels: list[str]

    def as_json(self) -> dict[str, Any]:
        """Return everything as JSON values."""
        return {
            "is_isolated": self.is_isolated,
            **self.skills.as_json(),
            "devices": self.devices,
            "channels": self.channels,
            "perceivers": {name: one.as_json() for name, one in self.perceivers.items()},
        }


class ResourceMeter:
    """Meter that opens runs of skills and perceivers, and measures what they use.

    Args:
        configuration: modules and site at the start; others are measured once their code runs.
        open_run: opens runs of skills.
        open_perceiver: opens runs of perceivers.
        clock: real time, s.
    """

    def __init__(
        self,
        configuration: Configuration,
        open_run: OpenRun,
        open_perceiver: OpenPerceiver,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._open_run, self._open_perceiver, self._clock = open_run, open_perceiver, clock
        self._modules: dict[str, _ModuleUse] = {}
        self._limits: dict[str, tuple[Site, Ecm]] = {}
        self._published = -PERIOD_S
        for ecm in configuration.modules.values():
            self._use(configuration.site, ecm)

    def open_run(self, site: Site, ecm: Ecm, skill: Skill, inputs: Mapping[str, Any]) -> SkillRunProtocol:
        """Implement `OpenRun`."""
        use = self._use(site, ecm).skills
        run = self._open_run(site, ecm, skill, inputs)
        use.opened(run)
        return _MeasuredRun(run, use, self._clock)

    def open_perceiver(self, site: Site, ecm: Ecm, perceiver: Perceiver) -> PerceiverRun:
        """Implement `OpenPerceiver`."""
        use = self._use(site, ecm).perceivers[perceiver.id]
        run = self._open_perceiver(site, ecm, perceiver)
        use.opened(run)
        return _MeasuredPerceiver(run, use, self._clock)

    def usage(self, is_last: bool) -> Mapping[str, Any] | None:
        """Implement `Usage`.

        Args:
            is_last: return the use even if it was returned a moment ago.

        Returns:
            Limits and use of each module, by name; memory in bytes beyond the interpreter's, times in seconds
            of real time.
        """
        now = self._clock()
        if now - self._published < PERIOD_S and not is_last:
            return None
        self._published = now
        return {name: one.as_json() for name, one in self._modules.items()}

    def _use(self, site: Site, ecm: Ecm) -> _ModuleUse:
        """Return the use of a module, with the limits that are in force."""
        known = self._limits.get(ecm.id)
        if known is None or known[0] is not site or known[1] is not ecm:
            self._limits[ecm.id] = (site, ecm)
            self._set_limits(site, ecm)
        return self._modules[ecm.id]

    def _set_limits(self, site: Site, ecm: Ecm) -> None:
        is_isolated = ecm.id not in site.isolation.trusted_modules
        before = self._modules.get(ecm.id)
        skills = _CodeUse() if before is None else before.skills
        limits = limits_in_force(site, ecm)
        skills.memory_limit = limits.memory if is_isolated else None
        skills.answer_limit = float(limits.answer_within) if is_isolated else None
        perceivers = {}
        for name, perceiver in ecm.perceivers.items():
            perceivers[name] = use = _CodeUse() if before is None else before.perceivers.get(name, _CodeUse())
            use.memory_limit = perceiver.memory if is_isolated else None
            use.answer_limit = float(perceiver.timeout)
        asked, granted = ecm.requested_access, site.access_of(ecm.id)
        devices, channels = asked.compute & granted.compute, asked.channels & granted.channels
        self._modules[ecm.id] = _ModuleUse(is_isolated, skills, perceivers, sorted(devices), sorted(channels))


class _AnswerTimer:
    """Timer of the answers of one run; it reads the memory now and then, as a worker may end by itself."""

    def __init__(
        self, run: SkillRunProtocol | PerceiverRun, use: _CodeUse, clock: Callable[[], float]
    ) -> None:
        self._run, self._use, self._clock = run, use, clock
        self._began, self._read = 0.0, -inf

    def __enter__(self) -> None:
        self._began = self._clock()

    def __exit__(self, *_: object) -> None:
        now = self._clock()
        self._use.answered(now - self._began)
        if now - self._read >= PERIOD_S:
            self._read = now
            self._use.read_memory(self._run)


class _MeasuredRun:
    """Run of a skill whose answers are timed; implements `SkillRunProtocol`."""

    def __init__(self, run: SkillRunProtocol, use: _CodeUse, clock: Callable[[], float]) -> None:
        self._run, self._use = run, use
        self._timer = _AnswerTimer(run, use, clock)

    def resume(self, observation: Observation, seconds: float, denial: str = "") -> Action | SkillRunResult:
        """Implement `SkillRunProtocol.resume`."""
        with self._timer:
            return self._run.resume(observation, seconds, denial)

    def close(self) -> str | None:
        """Implement `SkillRunProtocol.close`."""
        self._use.closing(self._run)
        return self._run.close()


class _MeasuredPerceiver:
    """Run of a perceiver whose calls are timed; implements `PerceiverRun`."""

    def __init__(self, run: PerceiverRun, use: _CodeUse, clock: Callable[[], float]) -> None:
        self._run, self._use = run, use
        self._timer = _AnswerTimer(run, use, clock)

    def perceive(self, view: ViewInput, seconds: float) -> Perceived:
        """Implement `PerceiverRun.perceive`."""
        with self._timer:
            return self._run.perceive(view, seconds)

    def close(self) -> None:
        """Implement `PerceiverRun.close`."""
        self._use.closing(self._run)
        self._run.close()
