"""An executor with everything around it fake but the audit log, and skills to run on it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, cast

from aeros.runtime.audit.log import AuditLog, verify_log
from aeros.runtime.execution.executor import Executor
from aeros.runtime.gate.compiled.rules import MonitorRules
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind, Reason
from aeros.runtime.gate.port import Gate
from aeros.runtime.ports import Readings, StepRequest, StepResult
from aeros.runtime.skills.in_process_run import InProcessRun, SkillRunProtocol, run_in_process
from aeros.sim.fake import FakePlant
from aeros.skill import Action, Inputs, Observation, SkillBody, act
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.site import Site

STEP = StepRequest("handling", "lift", {})
VALUES = {"tool_position": (0.3, 0.0, 0.5), "human_distance": 20.0, "holding": False}
DENIAL = Decision(DecisionKind.DENY, None, (Reason("AE750", "workspace", "outside"),))


class FakeGate:
    """Gate that allows everything, unless configured otherwise; remembers the requests."""

    def __init__(self, site: Site) -> None:
        self.monitor_rules = MonitorRules(site)
        self.answers: list[Decision | BaseException] = []
        self.asked: list[tuple[Caller, Readings, Action, float, Mapping[str, int]]] = []

    def decide(
        self, caller: Caller, readings: Readings, action: Action, now: float, usage: Mapping[str, int]
    ) -> Decision:
        self.asked.append((caller, readings, action, now, usage))
        answer = self.answers.pop(0) if self.answers else Decision(DecisionKind.ALLOW, action, ())
        if isinstance(answer, BaseException):
            raise answer
        return answer


class Bench:
    """An executor with everything around it fake but the audit log."""

    def __init__(self, site: Site, ecm: Ecm, log_path: Path, body: Callable[..., Any] | None) -> None:
        self.plant = FakePlant(VALUES)
        self.gate = FakeGate(site)
        self.log_path = log_path
        self.audit = AuditLog(log_path)
        configuration = Configuration(site=site, modules={"handling": ecm}, certificates={}, digest="c" * 64)

        def open_run(site: Site, ecm: Ecm, skill: Skill, inputs: Mapping[str, Any]) -> SkillRunProtocol:
            return run_in_process(site, ecm, skill, inputs) if body is None else InProcessRun(body, inputs)

        self.executor = Executor(configuration, cast("Gate", self.gate), self.plant, self.audit, open_run)

    def submit(self, request: StepRequest = STEP) -> StepResult:
        return self.executor.run_step(request)

    def records(self, event: str | None = None) -> list[dict[str, Any]]:
        assert verify_log(self.log_path).is_sound
        every = [json.loads(line) for line in self.log_path.read_bytes().splitlines()]
        return [record for record in every if event in (None, record["event"])]

    def assert_cleaned_up(self, *, finished: bool) -> None:
        """Exactly once, in order, whatever happened."""
        assert self.plant.call_count("stop") == (0 if finished else 1)
        assert self.plant.call_count("skill_ended") == 1
        assert self.plant.calls[-1] == ("skill_ended", "handling.lift", finished)


MakeBench = Callable[..., Bench]


def twice(observed: Observation, inputs: Inputs) -> SkillBody:
    yield act("move", speed=0.1)
    yield act("move", speed=0.2)


def watched(ends: list[str]) -> Callable[[Observation, Inputs], SkillBody]:
    """A skill that goes on for ever and notes each time it is closed."""

    def body(observed: Observation, inputs: Inputs) -> SkillBody:
        try:
            while True:
                yield act("move", speed=0.1)
        finally:
            ends.append("closed")

    return body
