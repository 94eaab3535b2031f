"""An executor of several steps at a time, with everything around it fake but gate, monitor and audit log."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from functools import cache
from pathlib import Path
from typing import Any

from aeros.runtime.audit.log import AuditLog, verify_log
from aeros.runtime.execution.executor import Executor
from aeros.runtime.execution.governor import Governor, OperatorCommand
from aeros.runtime.execution.step import required_resources
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.ports import StepHandle, StepRequest, StepResult
from aeros.runtime.skills.in_process_run import InProcessRun, SkillRunProtocol
from aeros.sim.fake import FakePlant
from aeros.skill import Action, Inputs, Observation, SkillBody, act
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.site import Site

FOLDER = Path(__file__).parent / "data" / "together"
VALUES = {"charge": 0.5, "hand": 0.0, "stop_pressed": False, "done": False, "moved": False}
Asking = Callable[[Observation, Inputs], SkillBody]


@cache
def configuration() -> Configuration:
    """With no certificates, so that everything is decided at the gate."""
    sink = Diagnostics()
    site = load_site(FOLDER / "site.yaml", sink)
    assert site is not None, list(sink)
    loaded = load_ecm(FOLDER, site, sink)
    assert loaded is not None, list(sink)
    return Configuration(site, {"cart": loaded.ecm}, {}, "c" * 64)


def asking(*actions: Action, ends: list[str] | None = None, name: str = "") -> Asking:
    """A skill that asks for these; notes when it is closed."""

    def body(observed: Observation, inputs: Inputs) -> SkillBody:
        try:
            yield from (action for action in actions)
        finally:
            if ends is not None:
                ends.append(name)

    return body


def move(speed: float = 0.25) -> Action:
    return act("move", speed=speed)


def roll(pace: float = 0.25) -> Action:
    return act("roll", pace=pace)


class Cart:
    """A cart whose skills ask for the actions that `bodies` has, by skill."""

    def __init__(
        self,
        log: Path,
        bodies: Mapping[str, Asking],
        mode: GateMode = GateMode.COMPILED,
        governor: Governor | None = None,
        plant: FakePlant | None = None,
        under: Configuration | None = None,
    ) -> None:
        self.log = log
        self.bodies = bodies
        self.plant = plant or FakePlant(VALUES)
        self.audit = AuditLog(log)
        under = under or configuration()
        self.executor = Executor(
            under, CompiledGate(under, mode), self.plant, self.audit, self._open, governor
        )

    def _open(self, site: Site, ecm: Ecm, skill: Skill, inputs: Mapping[str, Any]) -> SkillRunProtocol:
        return InProcessRun(self.bodies[skill.id], inputs)

    def start(self, skill: str) -> StepHandle:
        started = self.executor.start(StepRequest("cart", skill, {}))
        assert not isinstance(started, StepResult), started
        return started

    def ends(self, count: int) -> dict[StepHandle, StepResult]:
        """The next steps that end."""
        found = {}
        for _ in range(count):
            ended = self.executor.wait()
            assert ended is not None
            found[ended.step] = ended.result
        return found

    def started_kinds(self) -> list[str]:
        return [action.kind for action in self.plant.executed]

    def calls(self, *methods: str) -> list[Any]:
        return [call[1:] if len(call) > 2 else call[1] for call in self.plant.calls if call[0] in methods]

    def records(self, event: str) -> list[dict[str, Any]]:
        assert verify_log(self.log).is_sound
        every = [json.loads(line) for line in self.log.read_bytes().splitlines()]
        return [
            {**record["details"], "sequence": record["sequence"]}
            for record in every
            if record["event"] == event
        ]

    def assert_nothing_is_held(self) -> None:
        skills = configuration().modules["cart"].skills.values()
        names = {name for skill in skills for name in required_resources(skill)}
        assert {name: self.executor._resources.held_count(name) for name in names} == dict.fromkeys(names, 0)


MakeCart = Callable[..., Cart]


class Operator:
    """A governor in the test's hands."""

    def __init__(self) -> None:
        self.generation = 0
        self.command = OperatorCommand.RUN
        self.revoked: set[str] = set()
        self.in_force = configuration()
        self.held = 0

    def configuration(self) -> tuple[int, Configuration]:
        return self.generation, self.in_force

    def hold_generation(self, generation: int) -> AbstractContextManager[bool]:
        return nullcontext(generation == self.generation)

    def revocation_reason(self, module: str, skill: str, kind: str) -> str | None:
        return "the test says so" if skill in self.revoked else None
