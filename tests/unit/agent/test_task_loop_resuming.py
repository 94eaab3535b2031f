"""An agent that ends at any instant, and one that goes on from there: nothing is done twice or forgotten."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import count, groupby
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from aeros.agent.agent import start_agent
from aeros.agent.errors import AgentError
from aeros.agent.execution.report import RunReport
from aeros.agent.instructions.meaning import Errand, Spoken, Understanding
from aeros.agent.planning.base import Planner, RulePlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import Part, PlanStep, TaskGraph
from aeros.agent.recovery.checkpoint import SCHEMA
from aeros.agent.world.world import WorldModel
from aeros.runtime.ports import AuditEvent, EndedStep, StepHandle, StepRequest, StepResult, StepStatus
from aeros.spec.migrations.formats import CHECKPOINT
from aeros.spec.migrations.rewriting import rewrite
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.step_graph import Fallback, If, Par, RetriedPart, Seq
from tests.unit.agent.dumplings import (
    DUMPLING,
    MAKE_DUMPLINGS,
    SPAN,
    module,
    outcome,
    rule,
    site,
    skill,
    task,
    term,
)
from tests.unit.agent.fake_runtime import FakeRuntime

STATE_OF_CHECKPOINT_2 = Path(__file__).parents[1] / "spec/migrations/data/state_of_checkpoint_2"
"""State of the same agent as in the fixture `left`, in checkpoints of version 2 (before 5d9039d)."""
STATE_OF_CHECKPOINT_3 = Path(__file__).parents[1] / "spec/migrations/data/state_of_checkpoint_3"
"""The folder of an agent that d66fafc ran, which died amid its second try to wrap (checkpoint of version 3).

Its plan: prepare; recover; if `wrapper_aligned`, wrap (2 retries, and recover before each), else the same if
a condition with `since`, `count within` and a constant family holds; boil. `final.json` is the checkpoint
after that AEROS had resumed it to the goal.
"""


class Killed(BaseException):
    """The agent's process ends here."""


class Mortal(FakeRuntime):
    """A runtime and a plant that outlive the agent, which dies at the `dying`-th instant that it is seen at.

    The instants: each of its own records, each note, and within each step before and after its effect.
    done: the skills that ran to their ends, in order.
    """

    def __init__(self, dying: float, modules: Mapping[str, Ecm] | None = None, **more: Any) -> None:
        super().__init__(modules, **more)
        self.dying = dying
        self.lived = 0
        self.done: list[str] = []

    def note(self, event: str, details: Mapping[str, Any]) -> None:
        super().note(event, details)
        self.live()

    def start(self, request: StepRequest) -> StepHandle | StepResult:
        handle = super().start(request)
        self.live()
        self.say("step-began", request)
        return handle

    def wait(self, until: float = inf) -> EndedStep | None:
        self.live()
        return super().wait(until)

    def submit(self, request: StepRequest) -> StepResult:
        self.live()
        result = super().submit(request)
        self.done.append(request.skill)
        self.live()
        self.say("step-ended", request, status=result.status.value, reason=result.reason)
        return result

    def say(self, event: str, request: StepRequest, **more: Any) -> None:
        about = {"module": request.module, "skill": request.skill, "inputs": dict(request.inputs)}
        more["time"] = self.clock
        self.reported.append(
            AuditEvent(len(self.reported), event, json.loads(json.dumps({**about, **more}, default=float)))
        )
        self.live()

    def live(self) -> None:
        self.lived += 1
        if self.lived == self.dying:
            self.under_way.clear()  # what nobody decides on any more stops
            raise Killed


class Unlucky(Mortal):
    """Dies a second time, `again` instants after it died first."""

    def __init__(self, dying: float, again: float, modules: Mapping[str, Ecm]) -> None:
        super().__init__(dying, modules)
        self.again = again

    def live(self) -> None:
        try:
            super().live()
        except Killed:
            self.dying, self.again = self.dying + self.again, inf
            raise


class Given:
    """A planner that proposes one plan, whatever is measured."""

    name = "given"

    def __init__(self, *parts: Part) -> None:
        self.parts = parts

    def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        return TaskGraph(self.parts)


def survive(
    folder: Path, runtime: Mortal, planner: Planner, instruction: Spoken = "dumplings"
) -> tuple[RunReport, int]:
    """Run, and resume for as long as the agent dies; the report, and how often that was."""
    deaths = 0
    while True:
        try:
            with start_agent(folder, "chef", runtime, planner) as agent:
                return (agent.resume if deaths else agent.run)(instruction), deaths
        except Killed:
            deaths += 1


def at_every_instant(
    folder: Path, make: Callable[[float], Mortal], planner: Planner, instruction: Spoken = "dumplings"
) -> list[tuple[Mortal, RunReport]]:
    whole = make(inf)
    report, _ = survive(folder / "whole", whole, planner, instruction)
    runs = [(whole, report)]
    for instant in range(1, whole.lived + 1):
        runtime = make(instant)
        report, deaths = survive(folder / str(instant), runtime, planner, instruction)
        assert deaths == 1
        runs.append((runtime, report))
    return runs


@pytest.fixture
def tmp_path() -> Iterator[Path]:
    """In memory, where there is such a place: it is agents that die here, and syncs take minutes."""
    memory = Path("/dev/shm")  # noqa: S108
    with TemporaryDirectory(dir=memory if memory.is_dir() else None) as folder:
        yield Path(folder)


SALT = skill("salt", outcome("salted", {}), outcome("spilt", {}, failure=True))
WITH_SALT = module("dumpling", (*DUMPLING.skills.values(), SALT), MAKE_DUMPLINGS)


def do(name: str, **more: Any) -> PlanStep:
    return PlanStep("dumpling", name, **more)


def test_by_rules_every_step_happens_once_wherever_the_agent_dies(tmp_path: Path) -> None:
    runs = at_every_instant(tmp_path, Mortal, RulePlanner())
    assert len(runs) > 30
    for runtime, report in runs:
        assert report.reached
        assert runtime.done == ["prepare", "recover", "wrap", "boil"]


# `area` is not measured before, so the skill is repeated only because it may be.
POLISH = replace(skill("polish", outcome("polished", {"area": "table"})), idempotent=True)
POLISHING = module(
    "polishing", (POLISH,), task("polish_it", ("polish",), "area == table", rule("area == table", "polish"))
)


def test_the_tasks_of_an_instruction_are_each_done_once_wherever_the_agent_dies(tmp_path: Path) -> None:
    modules = {"dumpling": DUMPLING, "polishing": POLISHING}
    runs = at_every_instant(
        tmp_path, lambda dying: Mortal(dying, modules), RulePlanner(), "dumplings, then polish"
    )
    (_, whole), *_ = runs
    assert whole.goal == "(dumpling_cooked), then (area == table)"
    for runtime, report in runs:
        assert report.reached
        assert report.goal == whole.goal
        assert list(dict.fromkeys(runtime.done)) == ["prepare", "recover", "wrap", "boil", "polish"]
        assert len(runtime.done) <= 5 + runtime.done.count("polish") - 1


@pytest.mark.parametrize(
    ("condition", "done", "goal"),
    [
        (
            "not dumpling_cooked",
            ["prepare", "recover", "wrap", "boil"],
            "(if not dumpling_cooked: dumpling_cooked), "
            "then (otherwise, if not (not dumpling_cooked): area == table) skipped",
        ),
        (
            "dumpling_cooked",
            ["polish"],
            "(if dumpling_cooked: dumpling_cooked) skipped, "
            "then (otherwise, if not (dumpling_cooked): area == table)",
        ),
    ],
)
def test_one_of_two_branches_is_done_wherever_the_agent_dies(
    tmp_path: Path, condition: str, done: list[str], goal: str
) -> None:
    modules = {"dumpling": DUMPLING, "polishing": POLISHING}
    first = Errand(RoutedTask("dumpling", MAKE_DUMPLINGS), term(condition), condition)
    other = first.otherwise(RoutedTask("polishing", POLISHING.tasks["polish_it"]))
    meaning = Understanding("dumplings, otherwise polish", (first, other))
    runs = at_every_instant(tmp_path, lambda dying: Mortal(dying, modules), RulePlanner(), meaning)
    for runtime, report in runs:
        assert (report.reached, report.skipped, report.goal) == (True, False, goal)
        assert list(dict.fromkeys(runtime.done)) == done


def test_the_other_branch_of_one_that_fails_is_not_begun(tmp_path: Path) -> None:
    runtime = FakeRuntime(
        {"dumpling": DUMPLING, "polishing": POLISHING}, endings={"wrap": ["misaligned"] * 200}
    )
    first = Errand(RoutedTask("dumpling", MAKE_DUMPLINGS), term("not dumpling_cooked"), "not dumpling_cooked")
    other = first.otherwise(RoutedTask("polishing", POLISHING.tasks["polish_it"]))
    with start_agent(tmp_path, "chef", runtime, RulePlanner()) as agent:
        report = agent.run(Understanding("dumplings, otherwise polish", (first, other)))
    assert report.has_failed
    assert "polish" not in runtime.submitted


def test_a_plan_without_conditions_is_resumed_where_it_was(tmp_path: Path) -> None:
    plan = Given(do("prepare"), do("recover"), do("wrap"), do("boil"))
    for runtime, report in at_every_instant(tmp_path, Mortal, plan):
        assert report.reached
        assert runtime.done == ["prepare", "recover", "wrap", "boil"]


def test_budgets_are_not_renewed_by_dying(tmp_path: Path) -> None:
    def make(dying: float) -> Mortal:
        return Mortal(dying, endings={"wrap": ["misaligned"] * 200}, at=site(replans=1))

    runs = at_every_instant(tmp_path, make, RulePlanner())
    (_, whole), *_ = runs
    assert not whole.reached
    for _, report in runs:
        assert (report.reached, report.replans) == (False, whole.replans)
        # Of the tries of one plan at most the one under way is not in the report of the resumed run.
        assert len(whole.steps) - 1 <= len(report.steps) <= len(whole.steps) + 1


def test_an_unmeasurable_step_is_not_done_twice(tmp_path: Path) -> None:
    plan = Given(do("salt"), do("prepare"), do("recover"), do("wrap"), do("boil"))
    ends = set()
    for runtime, report in at_every_instant(
        tmp_path, lambda dying: Mortal(dying, {"dumpling": WITH_SALT}), plan
    ):
        assert runtime.done.count("salt") <= 1
        assert max(runtime.done.count(name) for name in ("prepare", "recover", "wrap", "boil")) <= 1
        ends.add(report.reached)
        if not report.reached:
            assert "do not exclude that `salted` happened" in str(report.reason)
    # Where it died amid the salting nobody knows, and it says so; else it goes on.
    assert ends == {True, False}


def test_an_unmeasurable_step_is_not_repeated_after_a_second_death_either(tmp_path: Path) -> None:
    plan, modules = Given(do("salt"), do("prepare")), {"dumpling": WITH_SALT}

    def salted_and_dead(instant: int) -> bool:
        runtime = Mortal(instant, modules)
        with suppress(Killed), start_agent(tmp_path / str(instant), "chef", runtime, plan) as agent:
            agent.run("dumplings")
        return runtime.done == ["salt"] and runtime.reported[-1].event == "step-began"

    first = next(filter(salted_and_dead, count(1)))
    died = []
    for again in range(1, 20):
        runtime = Unlucky(first, again, modules)
        _, deaths = survive(tmp_path / f"again-{again}", runtime, plan)
        died.append(deaths)
        assert runtime.done.count("salt") == 1
    # Unless it gives up before, as the same step could not start in the same state twice.
    assert died == sorted(died, reverse=True)
    assert died.count(2) > 5


def test_a_repeatable_step_is_done_again(tmp_path: Path) -> None:
    salt = replace(SALT, idempotent=True)
    modules = {"dumpling": module("dumpling", (*DUMPLING.skills.values(), salt), MAKE_DUMPLINGS)}
    plan = Given(do("salt"), do("prepare"), do("recover"), do("wrap"), do("boil"))
    runs = at_every_instant(tmp_path, lambda dying: Mortal(dying, modules), plan)
    assert all(report.reached for _, report in runs)
    assert {runtime.done.count("salt") for runtime, _ in runs} == {1, 2}


def test_branches_and_conditions_are_resumed_where_they_were(tmp_path: Path) -> None:
    dough = skill("dough", outcome("there", {"dough_on_workspace": True}))
    filling = skill("filling", outcome("there", {"filling_on_workspace": True}))
    modules = {"dumpling": module("dumpling", (*DUMPLING.skills.values(), dough, filling), MAKE_DUMPLINGS)}
    plan = Given(
        Par((do("dough"), do("filling")), SPAN),
        If(term("wrapper_aligned"), "wrapper_aligned", do("wrap"), Seq((do("recover"), do("wrap"))), SPAN),
        do("boil"),
    )
    for runtime, report in at_every_instant(tmp_path, lambda dying: Mortal(dying, modules), plan):
        assert report.reached
        assert sorted(runtime.done) == ["boil", "dough", "filling", "recover", "wrap"]


def test_alternatives_and_tries_are_resumed_where_they_were(tmp_path: Path) -> None:
    turn, press = (
        skill(name, outcome("aligned", {"wrapper_aligned": True}), outcome("askew", {}, failure=True))
        for name in ("turn", "press")
    )
    modules = {"dumpling": module("dumpling", (*DUMPLING.skills.values(), turn, press), MAKE_DUMPLINGS)}
    either = Fallback((do("turn"), RetriedPart(do("press"), 1, SPAN)), SPAN)
    plan = Given(do("prepare"), either, do("wrap"), do("boil"))

    def make(dying: float) -> Mortal:
        return Mortal(dying, modules, endings={"turn": ["askew"], "press": ["askew"]})

    for runtime, report in at_every_instant(tmp_path, make, plan):
        assert report.reached
        # A try that failed as the agent died may be made again; an alternative that was left may not.
        order = [name for name, _ in groupby(runtime.done)]
        assert order in (["prepare", "turn", "press", "wrap", "boil"], ["prepare", "turn", "wrap", "boil"])


def test_a_recovery_skill_between_two_tries_is_not_run_again(tmp_path: Path) -> None:
    knead = skill("knead", outcome("aligned", {"wrapper_aligned": True}))
    modules = {"dumpling": module("dumpling", (*DUMPLING.skills.values(), knead), MAKE_DUMPLINGS)}
    plan = Given(
        do("prepare"),
        do("knead"),
        do("wrap", retry=2, between_tries=do("recover"), needs_recovery=True),
        do("boil"),
    )

    def make(dying: float) -> Mortal:
        return Mortal(dying, modules, endings={"wrap": ["misaligned", "misaligned"]})

    for runtime, report in at_every_instant(tmp_path, make, plan):
        assert report.reached
        assert runtime.done == ["prepare", "knead", "wrap", "recover", "wrap", "recover", "wrap", "boil"]


def test_an_operators_stop_can_be_resumed(tmp_path: Path) -> None:
    runtime = Mortal(inf, endings={"wrap": [StepStatus.HALTED]})
    with start_agent(tmp_path, "chef", runtime) as agent:
        assert not agent.run("dumplings").reached
    with start_agent(tmp_path, "chef", runtime) as agent:
        assert agent.resume("dumplings").reached
    assert runtime.done == ["prepare", "recover", "wrap", "wrap", "boil"]


def test_a_stop_while_it_thinks_can_be_resumed(tmp_path: Path) -> None:
    class Thinking(RulePlanner):
        def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
            time.sleep(1000.0)
            raise AssertionError

    runtime = Mortal(inf)
    runtime.stopped = True
    with start_agent(tmp_path, "chef", runtime, Thinking(), within=30.0) as agent:
        report = agent.run("dumplings")
    assert "the operator has stopped everything" in str(report.reason)
    runtime.stopped = False
    assert resume(tmp_path, runtime).reached
    assert runtime.done == ["prepare", "recover", "wrap", "boil"]


def test_a_stop_of_one_of_two_that_are_under_way_can_be_resumed(tmp_path: Path) -> None:
    dough = skill("dough", outcome("there", {"dough_on_workspace": True}))
    filling = skill("filling", outcome("there", {"filling_on_workspace": True}))
    modules = {"dumpling": module("dumpling", (*DUMPLING.skills.values(), dough, filling), MAKE_DUMPLINGS)}
    plan = Given(Par((do("dough"), do("filling")), SPAN), do("recover"), do("wrap"), do("boil"))
    runtime = Mortal(inf, modules, endings={"dough": [StepStatus.HALTED]})
    with start_agent(tmp_path, "chef", runtime, plan) as agent:
        report = agent.run("dumplings")
    assert [one.status for one in report.steps] == [StepStatus.HALTED, StepStatus.CANCELLED]
    with start_agent(tmp_path, "chef", runtime, plan) as agent:
        assert agent.resume("dumplings").reached


@pytest.mark.parametrize("endings", [{}, {"wrap": ["misaligned"] * 200}])
def test_a_task_that_had_ended_is_reported_as_it_ended_and_nothing_more_is_done(
    endings: Mapping[str, Any], tmp_path: Path
) -> None:
    runtime = Mortal(inf, endings=endings, at=site(replans=1))
    with start_agent(tmp_path, "chef", runtime) as agent:
        report = agent.run("dumplings")
    assert report.reached == (not endings)
    done, notes = list(runtime.done), len(runtime.notes)
    assert resume(tmp_path, runtime) == resume(tmp_path, runtime) == report
    assert runtime.done == done
    assert [kind for kind, _ in runtime.notes[notes:]] == ["task-selected", "run-already-ended"] * 2


def test_without_a_readable_end_nothing_is_resumed(tmp_path: Path) -> None:
    runtime = Mortal(inf)
    with start_agent(tmp_path, "chef", runtime) as agent:
        agent.run("dumplings")
    path = tmp_path / "checkpoint.json"
    path.write_text(path.read_text().replace("recover", "rewover", 1))
    with pytest.raises(AgentError, match=r"cannot be resumed: .+damaged.+; start it again"):
        resume(tmp_path, runtime)
    path.unlink()
    with pytest.raises(AgentError, match="cannot be resumed: its checkpoint is gone; start it again"):
        resume(tmp_path, runtime)


# Checkpoints that are not to be gone on from.


@pytest.fixture
def left(tmp_path: Path) -> tuple[Path, Mortal]:
    """A folder and a runtime that an agent died over, amid its third step."""
    runtime = Mortal(22)
    with pytest.raises(Killed), start_agent(tmp_path, "chef", runtime) as agent:
        agent.run("dumplings")
    assert len(runtime.done) == 2
    return tmp_path, runtime


def resume(folder: Path, runtime: Mortal, instruction: Spoken = "dumplings") -> RunReport:
    with start_agent(folder, "chef", runtime) as agent:
        return agent.resume(instruction)


@pytest.mark.parametrize(
    ("damage", "why"),
    [
        (lambda text: text[: len(text) // 2], "Unterminated string"),
        (lambda text: text.replace("recover", "rewover", 1), "its digest does not match"),
        (
            lambda text: text.replace(f'"schema": {SCHEMA}', '"schema": 99'),
            "`99` was written by a newer AEROS, and this one reads `9`; install a newer AEROS",
        ),
        (lambda text: "[]", "does not have the layout"),
    ],
)
def test_after_a_damaged_checkpoint_the_previous_one_is_resumed(
    left: tuple[Path, Mortal], damage: Callable[[str], str], why: str
) -> None:
    folder, runtime = left
    path = folder / "checkpoint.json"
    path.write_text(damage(path.read_text()))
    assert resume(folder, runtime).reached
    refused = [details["reason"] for kind, details in runtime.notes if kind == "checkpoint-rejected"]
    assert len(refused) == 1
    assert why in refused[0]
    assert runtime.done == ["prepare", "recover", "wrap", "boil"]


def test_where_no_checkpoint_is_whole_nothing_is_resumed(left: tuple[Path, Mortal]) -> None:
    folder, runtime = left
    for name in ("checkpoint.json", "checkpoint.previous.json"):
        (folder / name).write_text("{}")
    with pytest.raises(AgentError, match=r"cannot be resumed: .+damaged.+; start it again"):
        resume(folder, runtime)
    assert runtime.done == ["prepare", "recover"]


def test_a_checkpoint_of_an_older_version_is_resumed_once_it_is_migrated(
    left: tuple[Path, Mortal],
) -> None:
    folder, runtime = left
    for path in STATE_OF_CHECKPOINT_2.iterdir():
        shutil.copy(path, folder)
    (folder / "checkpoint.previous.json").unlink()
    path = folder / "checkpoint.json"
    with pytest.raises(AgentError, match=rf"`2` is an older format.+run `aeros migrate {path}`"):
        resume(folder, runtime)
    path.write_text(rewrite(path, path.read_text(), CHECKPOINT).text)
    assert resume(folder, runtime).reached
    assert runtime.done == ["prepare", "recover", "wrap", "boil"]


@pytest.fixture
def left_amid_wrap(tmp_path: Path) -> tuple[Path, Mortal]:
    """The run of `STATE_OF_CHECKPOINT_3` in this AEROS: its folder, runtime and plant when the agent died."""
    aligned, wrap = (
        term("wrapper_aligned"),
        do("wrap", retry=2, between_tries=do("recover"), needs_recovery=True),
    )
    plan = Given(do("prepare"), do("recover"), If(aligned, "wrapper_aligned", wrap, wrap, SPAN), do("boil"))
    runtime = Mortal(33, endings={"wrap": ["misaligned"]})
    with pytest.raises(Killed), start_agent(tmp_path, "chef", runtime, plan) as agent:
        agent.run("dumplings")
    assert runtime.done == ["prepare", "recover", "wrap", "recover"]
    assert runtime.reported[-1].event == "step-began"
    return tmp_path, runtime


def test_a_checkpoint_of_version_3_is_resumed_once_it_is_migrated(
    left_amid_wrap: tuple[Path, Mortal],
) -> None:
    folder, runtime = left_amid_wrap
    (folder / "checkpoint.previous.json").unlink()
    for name in ("checkpoint.json", "identity.json", "phase.json"):
        shutil.copy(STATE_OF_CHECKPOINT_3 / name, folder)
    path = folder / "checkpoint.json"
    with pytest.raises(AgentError, match=rf"`3` is an older format.+run `aeros migrate {path}`"):
        resume(folder, runtime)
    path.write_text(rewrite(path, path.read_text(), CHECKPOINT).text)
    report = resume(folder, runtime)
    assert report.reached
    assert report.replans == 0
    assert runtime.done == ["prepare", "recover", "wrap", "recover", "wrap", "boil"]


def test_the_end_in_a_checkpoint_of_version_3_is_reported_once_it_is_migrated(
    left_amid_wrap: tuple[Path, Mortal],
) -> None:
    folder, runtime = left_amid_wrap
    ended = resume(folder, runtime)
    done = list(runtime.done)
    shutil.copy(STATE_OF_CHECKPOINT_3 / "identity.json", folder)
    path = folder / "checkpoint.json"
    path.write_text(rewrite(path, (STATE_OF_CHECKPOINT_3 / "final.json").read_text(), CHECKPOINT).text)
    assert ended.reached
    assert resume(folder, runtime) == ended
    assert runtime.done == done


def test_a_checkpoint_of_another_robot_is_refused(left: tuple[Path, Mortal]) -> None:
    folder, runtime = left
    (folder / "identity.json").unlink()
    with pytest.raises(AgentError, match="belongs to another agent"):
        resume(folder, runtime)


def test_a_checkpoint_of_another_record_is_refused(left: tuple[Path, Mortal]) -> None:
    folder, runtime = left
    runtime.reported.clear()
    with pytest.raises(AgentError, match="does not hold the record"):
        resume(folder, runtime)


def test_a_checkpoint_of_another_plant_is_refused(left: tuple[Path, Mortal]) -> None:
    folder, runtime = left
    runtime.clock = 0.0
    with pytest.raises(AgentError, match="it is another plant"):
        resume(folder, runtime)


def test_a_plant_from_before_the_last_record_is_another_one(tmp_path: Path) -> None:
    def ended(instant: int) -> Mortal | None:
        runtime = Mortal(instant)
        with suppress(Killed), start_agent(tmp_path / str(instant), "chef", runtime) as agent:
            agent.run("dumplings")
        return runtime if runtime.reported[-1:] and runtime.reported[-1].event == "step-ended" else None

    # Its checkpoint is from before that step, which takes a second.
    instant, runtime = next((one, runtime) for one in count(1) if (runtime := ended(one)) is not None)
    runtime.clock -= 0.5
    with pytest.raises(AgentError, match=r"is at 100\.5 s, and was at 101 s: it is another plant"):
        resume(tmp_path / str(instant), runtime)


def test_a_checkpoint_of_another_task_is_refused(left: tuple[Path, Mortal]) -> None:
    folder, runtime = left
    with pytest.raises(AgentError, match="of another task: “dumplings”"):
        resume(folder, runtime, "Dumplings, please")


def test_without_a_started_step_the_task_starts(tmp_path: Path) -> None:
    assert resume(tmp_path, Mortal(inf)).reached


def test_a_plan_whose_skills_were_removed_is_not_resumed(left: tuple[Path, Mortal]) -> None:
    folder, runtime = left
    (wrap,) = [one for one in DUMPLING.skills.values() if one.id == "wrap"]
    rest = tuple(one for one in DUMPLING.skills.values() if one.id not in ("wrap", "boil"))
    fold = skill("fold", *wrap.outcomes.values())
    cook = skill("cook", outcome("cooked", {"dumpling_cooked": True}), precondition="dumpling_wrapped")
    runtime.modules = {"dumpling": module("dumpling", (*rest, fold, cook), MAKE_DUMPLINGS)}
    with start_agent(folder, "chef", runtime, Given(do("fold"), do("cook"))) as agent:
        report = agent.resume("dumplings")
    assert report.reached
    assert runtime.done == ["prepare", "recover", "fold", "cook"]
