"""A plant with tools: calls beside motions, answers as readings, and failures as unknown values."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from math import inf
from typing import Any

import pytest

from aeros.runtime.execution.governor import FixedGovernor
from aeros.runtime.gate.configuration import make_configuration
from aeros.runtime.ports import MotionCompletion, MotionHandle, NoMotion, Reading
from aeros.runtime.tools.exchange import ToolError
from aeros.runtime.tools.service import ServiceCall
from aeros.runtime.tools.tool_plant import ToolPlant
from aeros.sim.fake import FakePlant
from aeros.skill import Action
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.policy import IsolationPolicy
from aeros.spec.model.site import Site
from aeros.spec.model.tools import Program, Tool
from tests.unit.spec.faults import TABLE

ASK = Action("wipe", {"tool": "brush", "pressure": 1.0})
MOVE = Action("move", {"target": (0.1, 0.1, 0.1), "speed": 0.1})


class Services:
    """Stands for services: what the next call gives, and what was asked."""

    def __init__(self) -> None:
        self.answer: Any = {"load": 2.0}
        self.asked: list[Mapping[str, Any]] = []
        self.go = threading.Event()
        self.go.set()

    def __call__(self, tool: Tool, policy: IsolationPolicy) -> ServiceCall:
        def call(parameters: Mapping[str, Any], seconds: float) -> Any:
            self.asked.append(parameters)
            self.go.wait(10.0)
            if isinstance(self.answer, Exception):
                raise self.answer
            return self.answer

        return call


def site_with_tool(timeout: Fraction = Fraction(5)) -> Site:
    """The corpus's site, in which wiping is a tool that answers with the load."""
    site = load_site(TABLE, Diagnostics())
    assert site is not None
    tool = Tool(Program(("ask",)), timeout, ("load",))
    return replace(site, kinds={**site.kinds, "wipe": replace(site.kinds["wipe"], tool=tool)})


class RealTimePlant(FakePlant):
    """A plant that does not wait for the monitor."""

    runs_in_real_time = True


class Bench:
    """A plant with a tool, and what it recorded."""

    def __init__(self, timeout: Fraction = Fraction(5), *, in_real_time: bool = False) -> None:
        self.inner = (RealTimePlant if in_real_time else FakePlant)({"table_tidy": True})
        self.services, self.events = Services(), list[tuple[str, Mapping[str, Any]]]()
        governor = FixedGovernor(make_configuration(site_with_tool(timeout), {}))
        self.plant = ToolPlant(
            self.inner, governor, lambda event, details: self.events.append((event, details)), self.services
        )
        self.rule: str | None = None

    def monitor(self, now: float, measured: Mapping[str, Any]) -> str | None:
        return self.rule

    def begin(self, action: Action) -> MotionHandle:
        handle = self.plant.begin(action)
        assert not isinstance(handle, MotionCompletion)
        return handle

    def ask(self) -> MotionCompletion:
        handle = self.begin(ASK)
        return self.plant.advance(self.monitor, inf)[handle]


@pytest.fixture(params=[False, True], ids=["simulated", "real-time"])
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    made = Bench(in_real_time=request.param)
    yield made
    made.services.go.set()
    made.plant.close()


def test_an_answer_is_a_reading_of_the_time_at_which_it_came(bench: Bench) -> None:
    bench.inner.time = 7.0
    assert "load" not in bench.plant.observe()
    assert bench.ask().completed
    reading = bench.plant.observe()["load"]
    assert (reading.value, reading.time) == (2.0, bench.plant.now())
    assert bench.plant.observe()["table_tidy"].value is True
    assert bench.services.asked == [ASK.parameters]
    assert bench.events == [
        ("tool-answered", {"tool": "wipe", "time": bench.plant.now(), "answer": {"load": 2.0}})
    ]
    assert bench.inner.executed == []


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (ToolError("it cannot be reached"), "it cannot be reached"),
        ({"load": 99.0}, "outside"),
        ({"dirt": 1.0}, "does not declare"),
        (ValueError("x"), "ValueError: x"),
        (ImportError(name="mcp"), "it needs a package that is not installed: mcp"),
    ],
)
def test_a_failed_call_leaves_its_values_unknown(bench: Bench, answer: Any, reason: str) -> None:
    assert bench.ask().completed
    bench.services.answer = answer
    assert bench.ask().completed  # it was made; what it would have said is unknown
    assert "load" not in bench.plant.observe()
    event, details = bench.events[-1]
    assert event == "tool-failed"
    assert reason in details["reason"]
    assert details["unknown"] == ["load"]


def test_an_older_answer_is_unknown_from_the_next_question_on(bench: Bench) -> None:
    bench.ask()
    bench.services.go.clear()
    bench.begin(ASK)
    assert "load" not in bench.plant.observe()


def test_a_service_that_does_not_answer_in_time_is_given_up() -> None:
    for in_real_time in (False, True):
        bench = Bench(Fraction(1, 10), in_real_time=in_real_time)
        bench.services.go.clear()
        bench.inner.duration = 0.001
        began = time.monotonic()
        handle = bench.begin(ASK)
        ended: Mapping[MotionHandle, MotionCompletion] = {}
        while not ended:
            ended = bench.plant.advance(bench.monitor, bench.plant.now() + 0.01)
        assert ended[handle].completed
        assert 0.1 <= time.monotonic() - began < 5.0
        assert "did not answer within 0.1 s" in bench.events[-1][1]["reason"]
        bench.services.go.set()


def test_the_simulators_clock_stands_still_during_a_call() -> None:
    bench = Bench()
    bench.inner.time = 3.0
    moving = bench.begin(MOVE)
    bench.ask()
    assert bench.inner.time == 3.0
    assert moving in bench.plant.advance(bench.monitor, inf)


def test_motions_continue_during_a_call_in_real_time() -> None:
    bench = Bench(in_real_time=True)
    bench.services.go.clear()
    asking, moving = bench.begin(ASK), bench.begin(MOVE)
    ended = bench.plant.advance(bench.monitor, inf)
    assert list(ended) == [moving]
    bench.services.go.set()
    assert list(bench.plant.advance(bench.monitor, inf)) == [asking]


def test_advance_returns_at_its_time_limit_during_a_call_in_real_time() -> None:
    bench = Bench(in_real_time=True)
    bench.services.go.clear()
    bench.begin(ASK)
    assert bench.plant.advance(bench.monitor, 0.5) == {}
    assert bench.plant.now() == 0.5
    bench.services.go.set()


def test_a_rule_ends_a_call_with_everything_else(bench: Bench) -> None:
    bench.services.go.clear()
    asking, moving = bench.begin(ASK), bench.begin(MOVE)
    bench.rule = "stop-button"
    ended = bench.plant.advance(bench.monitor, inf)
    assert {handle: one.reason for handle, one in ended.items()} == dict.fromkeys(
        (asking, moving), "monitor:stop-button"
    )
    bench.rule = None
    bench.services.go.set()
    assert bench.plant.advance(bench.monitor, bench.plant.now() + 1.0) == {}
    assert "load" not in bench.plant.observe()


def test_a_halted_call_ends_at_once_and_its_answer_is_dropped(bench: Bench) -> None:
    bench.services.go.clear()
    handle = bench.begin(ASK)
    bench.plant.halt(handle)
    ended = bench.plant.advance(bench.monitor, inf)
    assert (ended[handle].completed, ended[handle].reason) == (False, "the call was halted")
    bench.services.go.set()
    assert "load" not in bench.plant.observe()


def test_everything_else_is_the_plants(bench: Bench) -> None:
    assert bench.plant.plan(ASK) == NoMotion("a tool is called")
    assert bench.plant.plan(MOVE) == bench.inner.planned
    handle = bench.begin(MOVE)
    assert bench.plant.advance(bench.monitor, inf)[handle].completed
    halted = bench.begin(MOVE)
    bench.plant.halt(halted)
    bench.plant.skill_began("tidy.wipe")
    bench.plant.skill_ended("tidy.wipe", finished=True)
    bench.plant.stop()
    assert bench.plant.pictures() == {}
    assert {"begin", "halt", "skill_began", "skill_ended", "stop"} <= {one[0] for one in bench.inner.calls}
    assert bench.plant.observe()["table_tidy"] == Reading(True, bench.plant.now())


class PlantWithWords(FakePlant):
    """A plant that says which action kinds it can do."""

    action_kinds = ("move_tool", "stop")


@pytest.mark.parametrize(("inner", "word"), [(PlantWithWords(), "move_tool"), (FakePlant(), "move")])
def test_a_plant_that_says_its_action_kinds_gets_the_action_under_its_own_name(
    inner: FakePlant, word: str
) -> None:
    site = load_site(TABLE, Diagnostics())
    assert site is not None
    site = replace(site, kinds={**site.kinds, "move": replace(site.kinds["move"], means="move_tool")})
    plant = ToolPlant(inner, FixedGovernor(make_configuration(site, {})), lambda event, details: None)
    plan = plant.plan(MOVE)
    assert not isinstance(plant.begin(MOVE, plan), MotionCompletion)
    stop = Action("stop", {})
    assert not isinstance(plant.begin(stop), MotionCompletion)
    assert inner.executed == [Action(word, MOVE.parameters), stop]
    assert next(call for call in inner.calls if call[0] == "plan")[1] == Action(word, MOVE.parameters)
