"""A robot on the symbolic plant behind the MCP tools, in this process, and an operator who commands it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from jsonschema import Draft202012Validator

from aeros.agent.agent import start_agent
from aeros.apps.mcp.approvals import Approvals
from aeros.apps.mcp.cancellable_runtime import CancellableRuntime
from aeros.apps.mcp.plan_review import ClientPlanChecker
from aeros.apps.mcp.robot import ClientPlanner, LatestMeasurements, McpEvents, McpRobotThread, RobotParts
from aeros.apps.mcp.task_choice import TaskChoice
from aeros.apps.mcp.tool_results import OUTPUT_SCHEMAS
from aeros.apps.mcp.tools import Tools
from aeros.runtime.audit.log import AuditLog, verify_log
from aeros.runtime.execution.governor import FixedGovernor, OperatorCommand
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.isolation.run_factory import SkillRunFactory
from aeros.runtime.proving import prove_configuration
from aeros.session.assembly import build_executor
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.policy import Execute, McpPolicy
from aeros.spec.text.discovery import reference_site_path
from tests.repo.tree import ROOT

PREPARE = [{"skill": "make_dumplings.prepare"}]
LAID_OUT = "dough_on_workspace and filling_on_workspace and wrappers_suffice and fillings_suffice"
FREE = McpPolicy(Execute.ALLOWED)


class Operator(FixedGovernor):
    """Says what it was asked for last, and does something when a record of some kind is written."""

    def __init__(self, configuration: Configuration) -> None:
        super().__init__(configuration)
        self.in_force = configuration
        self.asked = OperatorCommand.RUN
        self.at_first: dict[str, Callable[[], None]] = {}
        self.after_asked: Callable[[], None] | None = None

    @property
    def command(self) -> OperatorCommand:
        return self.asked

    @property
    def generation(self) -> int:
        return hash(self.in_force.digest)

    def configuration(self) -> tuple[int, Configuration]:
        return self.generation, self.in_force

    def hold_generation(self, generation: int) -> AbstractContextManager[bool]:
        return nullcontext(generation == self.generation)

    def ask(self, command: OperatorCommand) -> None:
        # A pause does not take back a stop, whichever comes first on a busy machine.
        if (self.asked, command) != (OperatorCommand.STOP, OperatorCommand.PAUSE):
            self.asked = command
        if self.after_asked is not None:
            self.after_asked()

    def hear(self, line: bytes) -> None:
        do = self.at_first.pop(json.loads(line)["event"], None)
        if do is not None:
            do()


class Cell:
    """A robot on the symbolic plant, and a client of its tools."""

    def __init__(self, tools: Tools, operator: Operator, robot: McpRobotThread, folder: Path) -> None:
        self.tools, self.operator, self.robot, self.folder = tools, operator, robot, folder

    def call(self, tool: str, **arguments: Any) -> dict[str, Any]:
        """The answer, which is as the tool's schema says."""
        answer = self.tools.call(tool, arguments, "a client 1.0")
        Draft202012Validator(OUTPUT_SCHEMAS[tool]).validate(answer)
        return answer

    def proposed(self) -> str:
        name: str = self.call("propose_plan", steps=PREPARE, goal=LAID_OUT)["plan"]
        return name

    def records(self) -> list[dict[str, Any]]:
        self.robot.call(lambda _: None).result()
        return [json.loads(line) for line in (self.folder / "audit.jsonl").read_text().splitlines()]

    def noted(self, event: str) -> list[dict[str, Any]]:
        notes = [one["details"] for one in self.records() if one["event"] == "note"]
        return [note["details"] for note in notes if note["event"] == event]

    def decisions(self) -> int:
        return sum(one["event"] == "decision" for one in self.records())


@cache
def shipped() -> Mapping[str, Ecm]:
    """All shipped modules, as their locks certify them."""
    return prove_configuration([ROOT / "ecms"], reference_site_path(), certified=True)[0].modules


@cache
def dumplings() -> Configuration:
    """The reference site with `make_dumplings`, as its lock certifies it."""
    return prove_configuration([ROOT / "ecms" / "make_dumplings"], reference_site_path(), certified=True)[0]


@contextmanager
def cell(
    configuration: Configuration,
    folder: Path,
    policy: McpPolicy,
    seed: int = 0,
    instruction: str | None = "make dumplings",
) -> Iterator[Cell]:
    configuration = replace(configuration, site=replace(configuration.site, mcp=policy))
    tasks = TaskChoice(instruction, configuration.modules)
    operator, heard, events = Operator(configuration), LatestMeasurements(), McpEvents()

    start = configuration.modules["make_dumplings"].tasks["make_dumplings"].initial

    @contextmanager
    def opened() -> Iterator[RobotParts]:
        site = configuration.site
        plant = SymbolicPlant(site, configuration.modules, seed, to_doubles(start))
        with (
            SkillRunFactory(site, configuration.modules.values()) as skills,
            AuditLog(folder / "audit.jsonl", listener=operator.hear) as audit,
            build_executor(
                configuration, plant, audit, skills, governor=operator, listeners=(heard,)
            ) as executor,
            start_agent(
                folder / "state",
                "panda",
                CancellableRuntime(executor, events.cancel_reason),
                planner := ClientPlanner(ClientPlanChecker(lambda: executor.site)),
                events.on_event,
            ) as agent,
        ):
            yield RobotParts(executor, agent, planner)

    robot = events.robot = McpRobotThread(opened, lambda: operator.ask(OperatorCommand.STOP))
    try:
        approvals = Approvals(folder / "state")
        tools = Tools(robot, heard, tasks, approvals, operator.ask, lambda: operator.command)
        yield Cell(tools, operator, robot, folder)
    finally:
        robot.close()
    assert verify_log(folder / "audit.jsonl").is_sound
