"""Classical planners as planners: real ones where they are installed, and such as are wrong."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from aeros.agent.planning.check_plan import PlanChecker
from aeros.agent.planning.classical import ClassicalEngineError, UnifiedPlanningEngine
from aeros.agent.planning.pddl import PddlPlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.strong_cyclic import NoPlanError
from aeros.agent.planning.task_graph import PlanStep, TaskGraph, verify_plan
from aeros.agent.world.world import world_from_readings
from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.spec.model.ecm import Ecm
from aeros.spec.planning.search_result import PlanUndecidedError
from tests.differential.real_loop import Recording
from tests.differential.reference_cases import REFERENCE, reference
from tests.unit.agent.dumplings import DUMPLING, MAKE_DUMPLINGS, module, outcome, site, skill
from tests.unit.agent.fake_runtime import FakeRuntime

ECMS = Path(__file__).parents[4] / "ecms"
DO = [
    "dumpling-prepare-prepared",
    "dumpling-recover-aligned",
    "dumpling-wrap-wrapped",
    "dumpling-boil-cooked",
]


class Saying:
    """An engine that says the same of every problem, or raises it."""

    def __init__(self, *message: list[str] | Exception | None) -> None:
        self.reported = list(message)
        self.asked: list[str] = []

    def solve(self, domain: str, problem: str) -> list[str] | None:
        self.asked.append(domain)
        message = self.reported[0] if len(self.reported) == 1 else self.reported.pop(0)
        if isinstance(message, Exception):
            raise message
        return message


SPILT = outcome("spilt", {"dough_on_workspace": False, "dumpling_wrapped": False}, failure=True)
BOIL = skill("boil", outcome("cooked", {"dumpling_cooked": True}), SPILT, precondition="dumpling_wrapped")
RISKY = module("dumpling", (*DUMPLING.skills.values(), BOIL), MAKE_DUMPLINGS)
"""Boiling may spill: then there is no dough."""


def planned(engine: Saying, ecm: Ecm = DUMPLING) -> TaskGraph:
    runtime = FakeRuntime()
    world = world_from_readings(runtime.site.state, runtime.observe(), runtime.now())
    return PddlPlanner(site(), engine).plan(RoutedTask("dumpling", MAKE_DUMPLINGS), world, {"dumpling": ecm})


def test_paths_after_failures_are_planned_too() -> None:
    engine = Saying(DO, [DO[0], *DO[2:]], DO)
    graph = planned(engine, RISKY)
    assert [step.skill for step in graph.steps] == ["prepare", "recover", "wrap", "boil"]
    assert graph.steps[2] == PlanStep("dumpling", "wrap", {}, 3, PlanStep("dumpling", "recover"))
    assert len(engine.asked) == 3  # the last: whether there is anything shorter by now


@pytest.mark.parametrize(
    ("message", "why"),
    [
        (["fly"], "the engine's plan has `fly`, which is not an action"),
        ([DO[0], DO[2], DO[3]], "the engine's plan has `dumpling-wrap-wrapped` where that is impossible"),
        ([*DO[:2], "dumpling-wrap-misaligned"], "`dumpling-wrap-misaligned` where that is impossible"),
        (DO[:3], "the engine's plan ends before the goal"),
        ([], "the engine's plan ends before the goal"),
        (ClassicalEngineError("it crashed"), "the engine gave no answer: it crashed"),
    ],
)
def test_an_engine_that_is_wrong_is_not_followed(message: list[str] | Exception, why: str) -> None:
    with pytest.raises(PlanUndecidedError) as undecided:
        planned(Saying(message))
    assert why in str(undecided.value)


def test_an_engine_that_finds_nothing_is_believed_to_have_found_nothing() -> None:
    with pytest.raises(NoPlanError, match="no plan reaches the goal"):
        planned(Saying(None))


def test_an_engine_that_goes_where_it_must_not_is_asked_for_another_plan_then_given_up() -> None:
    # From where it is spilt there is no plan, it says; so nothing may be boiled.
    engine = Saying(DO, None, DO)
    with pytest.raises(PlanUndecidedError, match="uses `dumpling-boil-cooked` where that is excluded"):
        planned(engine, RISKY)
    boiling = engine.asked[-1].partition("dumpling-boil-cooked")[2].partition(":effect")[0]
    assert boiling.count("(not (and (dough_on_workspace)") == 1


def engines() -> list[str]:
    """Those installed here."""
    asked = "import importlib.util as u; print(*[n for n in {!r} if u.find_spec(n)])"
    names = {"up_pyperplan": "pyperplan", "up_fast_downward": "fast-downward"}
    found = subprocess.run([sys.executable, "-c", asked.format([*names])], capture_output=True, text=True)
    return [names[one] for one in found.stdout.split()]


@pytest.mark.parametrize("name", REFERENCE)
def test_our_judge_finds_fault_with_a_real_engines_plan_only_where_it_is_to_be_made_anew(name: str) -> None:
    pytest.importorskip("unified_planning", reason="needs `pip install '.[pddl]'`")
    case = reference(name, 10)
    runtime = Recording(case.ecm, case.site, case.start, lambda _, names: names[0])
    world = world_from_readings(case.site.state, runtime.observe(), runtime.now())
    modules, routed = {name: case.ecm}, RoutedTask(name, case.task)
    assert engines(), "unified_planning is installed and none of the engines that it could ask"
    for engine in engines():
        graph = PddlPlanner(case.site, UnifiedPlanningEngine(engine)).plan(routed, world, modules)
        assert verify_plan(graph, modules, case.site) == []
        problems = PlanChecker(routed, world, modules, case.site).problems(graph)
        assert all(text.startswith("it ends, and the goal does not hold") for text in problems)


def run(folder: Path, *arguments: str) -> int:
    where = ["--state", str(folder / "state"), "--out", str(folder / "out"), "--ecms", str(ECMS)]
    return main(["run", "make dumplings", "--plant", "symbolic", *where, *arguments])


def test_a_run_by_a_real_engine_reaches_the_goal(tmp_path: Path) -> None:
    pytest.importorskip("unified_planning", reason="needs `pip install '.[pddl]'`")
    assert run(tmp_path, "--planner", "pddl", "--pddl-engine", "pyperplan") == Exit.SUCCESS


def test_a_missing_engine_is_reported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("unified_planning", reason="needs `pip install '.[pddl]'`")
    assert run(tmp_path, "--planner", "pddl", "--pddl-engine", "oracle") == Exit.REJECTED
    assert "the engine gave no answer: UPNoRequestedEngineAvailableException" in capsys.readouterr().out


def missing(_: str) -> None:
    return None


@pytest.mark.parametrize(
    ("arguments", "find", "code", "message"),
    [
        (["--pddl-engine", "pyperplan"], None, Exit.USAGE, "--pddl-engine requires --planner pddl"),
        (["--planner", "pddl"], missing, Exit.REJECTED, "--planner pddl needs `pip install '.[pddl]'`"),
    ],
)
def test_impossible_values_are_refused(
    arguments: list[str],
    find: Callable[[str], None] | None,
    code: Exit,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    if find is not None:
        monkeypatch.setattr("aeros.agent.planning.classical.find_spec", find)
    assert run(tmp_path, *arguments) == code
    assert message in capsys.readouterr().err
