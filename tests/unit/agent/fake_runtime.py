"""A runtime in memory: skills change the state as their script or their first success outcome says."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import inf
from typing import Any

from aeros.runtime.ports import (
    AuditEvent,
    EndedStep,
    LogHead,
    Obstacle,
    Reading,
    Readings,
    StepHandle,
    StepRequest,
    StepResult,
    StepStatus,
)
from aeros.spec.expr.effects import state_after
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.verification.certificate import Certificate
from tests.unit.agent.dumplings import DUMPLING, PREDICATES, site

Ending = str | StepStatus | StepResult | Mapping[str, Any] | BaseException
"""The outcome measured, how the step is halted, what it comes to with nothing changed, a state set that may
be undeclared, or what is raised."""


class FakeRuntime:
    """Implement `ports.Runtime`.

    endings: what becomes of the next submissions of a skill, in order; then its first success outcome.
    chance: if given, chooses the outcome of every submission instead.
    last: skills that end after whatever else is under way.
    """

    def __init__(
        self,
        modules: Mapping[str, Ecm] | None = None,
        endings: Mapping[str, list[Ending]] | None = None,
        chance: Callable[[str, list[str]], str] | None = None,
        at: Site | None = None,
    ) -> None:
        self.modules = dict(modules or {"dumpling": DUMPLING})
        self.endings = {name: list(listed) for name, listed in (endings or {}).items()}
        self.chance = chance
        self.state: dict[str, Any] = dict.fromkeys(PREDICATES, False)
        self.ages: dict[str, float] = {}
        self.started = 0
        self.under_way: dict[StepHandle, StepRequest] = {}
        self.cancelled: dict[StepHandle, str] = {}
        self.last: list[str] = []
        self.stopped = False
        self.submitted: list[str] = []
        self.requests: list[StepRequest] = []
        self.notes: list[tuple[str, dict[str, Any]]] = []
        self.reported: list[AuditEvent] = []
        self.clock = 100.0
        self.early = 0.0
        """Time before its end at which a wait returns, as one of a simulator may by less than a tick, s."""
        self.certificates: dict[str, Certificate] = {}
        self.attended: list[frozenset[str] | None] = []
        self.parameters: list[dict[str, Any]] = []
        self.memories: list[Mapping[str, Mapping[str, Any]]] = []
        self.obstructing: list[Obstacle] = []
        self._site = at or site()

    @property
    def site(self) -> Site:
        return self._site

    @property
    def is_stopped(self) -> bool:
        return self.stopped

    def active_modules(self) -> Mapping[str, Ecm]:
        return self.modules

    def certificate(self, module: str) -> Certificate | None:
        return self.certificates.get(module)

    def obstacles(self) -> list[Obstacle]:
        return self.obstructing

    def attend(self, modules: frozenset[str] | None) -> None:
        self.attended.append(modules)

    def set_memories(self, memories: Mapping[str, Mapping[str, Any]]) -> None:
        self.memories.append(memories)

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        self.parameters.append(dict(values))

    def now(self) -> float:
        return self.clock

    def observe(self) -> Readings:
        return {
            name: Reading(value, self.clock - self.ages.get(name, 0.0)) for name, value in self.state.items()
        }

    def start(self, request: StepRequest) -> StepHandle | StepResult:
        self.started += 1
        self.under_way[StepHandle(self.started)] = request
        return StepHandle(self.started)

    def wait(self, until: float = inf) -> EndedStep | None:
        for handle in self.cancelled:
            if self.under_way.pop(handle, None) is not None:
                return EndedStep(handle, StepResult(StepStatus.CANCELLED, self.cancelled[handle]))
        if not self.under_way or self.clock + 1.0 > until:
            self.clock = max(self.clock, until - self.early)
            return None
        handle = min(self.under_way, key=lambda one: self.last.count(self.under_way[one].skill))
        return EndedStep(handle, self.submit(self.under_way.pop(handle)))

    def cancel(self, step: StepHandle, reason: str) -> None:
        self.cancelled[step] = reason

    def submit(self, request: StepRequest) -> StepResult:
        self.submitted.append(request.skill)
        self.requests.append(request)
        self.clock += 1.0
        skill = self.modules[request.module].skills[request.skill]
        ending: Ending
        if self.chance is not None:
            ending = self.chance(request.skill, list(skill.outcomes))
        else:
            script = self.endings.get(request.skill)
            ending = script.pop(0) if script else skill.success_outcomes[0].id
        if isinstance(ending, BaseException):
            raise ending
        if isinstance(ending, StepResult):
            return ending
        if isinstance(ending, StepStatus):
            return StepResult(ending, "as scripted", allowed=1, denied=int(ending is StepStatus.DENIED))
        self.state |= (
            state_after(skill.outcomes[ending].effects, self.state) if isinstance(ending, str) else ending
        )
        return StepResult(StepStatus.FINISHED, "", allowed=2, attenuated=1)

    def note(self, event: str, details: Mapping[str, Any]) -> None:
        self.notes.append((event, dict(details)))

    def log_head(self) -> LogHead:
        return LogHead(len(self.reported), str(len(self.reported)))

    def events_since(self, head: LogHead) -> Sequence[AuditEvent] | None:
        return self.reported[head.records :] if head.records <= len(self.reported) else None

    def kinds(self) -> list[str]:
        return [kind for kind, _ in self.notes]
