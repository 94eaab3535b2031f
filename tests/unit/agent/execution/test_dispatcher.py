"""Providers are chosen by their results in the same context, and the numbers are reported."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any
from uuid import uuid4

import pytest

from aeros.agent.agent import start_agent
from aeros.agent.execution.attempt import AttemptResult, RunningAttempt
from aeros.agent.execution.dispatcher import Dispatch, Dispatcher, DispatchError
from aeros.agent.execution.journal import Journal
from aeros.agent.execution.report import RunReport, StepRole
from aeros.agent.execution.step_attempt import StepRunner
from aeros.agent.identity import Identity
from aeros.agent.memory.context import evidence_context
from aeros.agent.memory.store import EpisodeEnd, EpisodeStart, Memory, open_memory
from aeros.agent.planning.task_graph import Part, PlanStep, TaskGraph, verify_plan
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.runtime.ports import Reading, StepResult, StepStatus
from aeros.spec.model.step_graph import Par
from tests.unit.agent.dumplings import (
    PREDICATES,
    SPAN,
    STATE,
    module,
    outcome,
    rule,
    site,
    skill,
    task,
)
from tests.unit.agent.fake_runtime import Ending as Scripted
from tests.unit.agent.fake_runtime import FakeRuntime

COOKED = outcome("cooked", {"dumpling_cooked": True})
COLD = outcome("cold", {}, failure=True)
BOIL = skill("boil", COOKED, COLD)
STEAM = skill("steam", COOKED, COLD, precondition="not wrapper_aligned")
COOK = task("cook", ("cook",), "dumpling_cooked", rule("dumpling_cooked", "cooking", retry=3))
KITCHEN = replace(
    module("kitchen", (BOIL, STEAM), COOK),
    capabilities={"cooking": ("boil", "steam")},
    code_digest="of this version",
)
TASK = "kitchen.cook"


def world(**measured: bool) -> WorldModel:
    values = dict.fromkeys(PREDICATES, False) | measured
    return world_from_readings(STATE, {name: Reading(one, 0.0) for name, one in values.items()}, 0.0)


def context(of: WorldModel | None = None) -> str:
    return evidence_context(TASK, KITCHEN, (BOIL, STEAM), of or world())


def remember(memory: Memory, skill: str, successes: int, failures: int, where: str | None = None) -> None:
    for failed in [False] * successes + [True] * failures:
        beginning = EpisodeStart(
            TASK, "kitchen", skill, "step", {}, 0.0, {}, where or context(), "of this version"
        )
        memory.end_episode(
            memory.start_episode(beginning),
            EpisodeEnd("finished", None, failed, "", 1.0, {}, counts_toward_record=True),
        )


@pytest.fixture
def memory(tmp_path: Path) -> Iterator[Memory]:
    with open_memory(tmp_path / "memory.sqlite3", Identity(uuid4(), "chef", "", 1)) as opened:
        yield opened


def chosen(memory: Memory, *, seed: int = 0, at: WorldModel | None = None) -> str:
    dispatcher = Dispatcher(FakeRuntime({"kitchen": KITCHEN}), memory, TASK, seed)
    return asked(dispatcher, at or world()).request.skill


def asked(dispatcher: Dispatcher, at: WorldModel) -> Dispatch:
    found = dispatcher.dispatch("kitchen", "cooking", {}, at)
    assert isinstance(found, Dispatch)
    return found


def times_steamed(memory: Memory, *, at: WorldModel | None = None) -> int:
    return sum(chosen(memory, seed=seed, at=at) == "steam" for seed in range(200))


def test_without_a_record_each_is_chosen_as_often_as_the_other(memory: Memory) -> None:
    assert 70 <= times_steamed(memory) <= 130


def test_the_better_skill_is_chosen_more_often_and_the_other_is_still_tried(memory: Memory) -> None:
    remember(memory, "steam", 6, 2)
    remember(memory, "boil", 2, 6)
    assert 170 <= times_steamed(memory) < 200


def test_only_what_was_in_the_same_context_speaks_for_it(memory: Memory) -> None:
    remember(memory, "steam", 30, 0)
    remember(memory, "boil", 0, 30)
    often = times_steamed(memory)
    assert often > 180  # the successes are old, so little is known of it
    aligned = world(dumpling_wrapped=True)
    assert context(aligned) == context()  # no precondition reads it
    assert times_steamed(memory, at=aligned) == often
    other = json.dumps({**json.loads(context()), "code": "of another version"}, sort_keys=True)
    remember(memory, "boil", 400, 0, where=other)
    assert times_steamed(memory) > 180


def test_predicates_of_preconditions_and_task_and_code_make_the_context() -> None:
    assert json.loads(context()) == {
        "task": TASK,
        "code": "of this version",
        "predicates": {"wrapper_aligned": False},
    }
    assert context(world(wrapper_aligned=True)) != context()


def test_the_same_memory_and_seed_choose_the_same(memory: Memory) -> None:
    remember(memory, "steam", 2, 2)
    remember(memory, "boil", 2, 2)
    assert len({chosen(memory) for _ in range(10)}) == 1
    # A choice follows another in a memory that has grown meanwhile.
    sequence = []
    for _ in range(12):
        sequence.append(chosen(memory))
        remember(memory, "elsewhere", 1, 0)
    assert set(sequence) == {"boil", "steam"}


def test_a_skill_that_may_not_start_is_not_chosen_and_the_reason_is_reported(memory: Memory) -> None:
    remember(memory, "steam", 50, 0)
    aligned = world(wrapper_aligned=True)
    dispatcher = Dispatcher(FakeRuntime({"kitchen": KITCHEN}), memory, TASK)
    dispatch = asked(dispatcher, aligned)
    assert dispatch.request.skill == "boil"
    boil, steam = dispatch.choice.options
    assert boil.sampled_success is not None
    assert steam.sampled_success is None
    assert "its precondition `not wrapper_aligned` is not met" in steam.unavailable_reason


def test_an_unknown_predicate_starts_no_provider_that_needs_it(memory: Memory) -> None:
    unknown = world_from_readings(STATE, {}, 0.0)
    assert times_steamed(memory, at=unknown) == 0


def test_where_none_may_start_every_reason_is_given(memory: Memory) -> None:
    both = replace(KITCHEN, skills={"boil": replace(STEAM, id="boil"), "steam": STEAM})
    dispatcher = Dispatcher(FakeRuntime({"kitchen": both}), memory, TASK)
    with pytest.raises(DispatchError, match=r"(wrapper_aligned is true.*){2}"):
        dispatcher.dispatch("kitchen", "cooking", {}, world(wrapper_aligned=True))


def test_a_skill_that_was_denied_for_good_is_chosen_only_where_there_is_no_other(memory: Memory) -> None:
    dispatcher = Dispatcher(FakeRuntime({"kitchen": KITCHEN}), memory, TASK)
    remember(memory, "steam", 50, 0)
    dispatcher.avoid("kitchen", "steam")
    dispatch = asked(dispatcher, world())
    assert dispatch.request.skill == "boil"
    assert str(dispatch.choice.options[1]) == (
        "`steam` 50 of 50 succeeded (by age 8.0 of 8.0), takes 1.0 s, not now: it was denied"
    )
    dispatcher.avoid("kitchen", "boil")
    assert asked(dispatcher, world()).request.skill == "steam"


# Within a run.


def pursued(
    folder: Path, endings: dict[str, list[Scripted]], *, retries: int = 3
) -> tuple[RunReport, FakeRuntime]:
    runtime = FakeRuntime({"kitchen": KITCHEN}, endings, at=site(retries=retries, replans=3))
    with start_agent(folder, "chef", runtime) as agent:
        return agent.run("cook"), runtime


def notes_of(runtime: FakeRuntime, kind: str) -> list[dict[str, Any]]:
    return [details for event, details in runtime.notes if event == kind]


def test_a_choice_is_reported_with_its_numbers(tmp_path: Path) -> None:
    report, runtime = pursued(tmp_path, {})
    assert report.reached
    (choice,) = notes_of(runtime, "provider-selected")
    (step,) = report.steps
    assert choice["capability"] == "kitchen.cooking"
    assert choice["skill"] == f"kitchen.{step.skill}"
    assert choice["context"] == json.loads(context())
    drawn = {option["skill"]: option["drawn"] for option in choice["options"]}
    assert max(drawn, key=drawn.__getitem__) == step.skill
    assert all(option["record"] == {"successes": 0, "failures": 0} for option in choice["options"])
    assert (choice["reason"], choice["explores"]) == ("least expected time until success", False)
    json.dumps(choice, allow_nan=False)


def test_a_failed_try_may_be_followed_by_one_of_the_other(tmp_path: Path) -> None:
    cold: dict[str, list[Scripted]] = {"boil": ["cold"] * 40}
    for _ in range(4):
        assert pursued(tmp_path, cold)[0].reached
    report, _ = pursued(tmp_path, cold)
    assert report.steps[-1].skill == "steam"


def test_a_denial_for_good_leads_to_the_other_provider(tmp_path: Path) -> None:
    denied: dict[str, list[Scripted]] = {"boil": [StepStatus.DENIED] * 9}
    for run in range(3):
        report, runtime = pursued(tmp_path / str(run), denied)
        assert report.reached
        assert runtime.submitted.count("boil") <= 1


def test_a_denial_that_passes_by_waiting_does_not_count_against_the_skill(tmp_path: Path) -> None:
    nearby = StepResult(StepStatus.DENIED, "somebody is near", denied=1, is_transient=True)
    pursued(tmp_path, {"boil": [nearby] * 3, "steam": [nearby] * 3})
    with open_memory(tmp_path / "memory.sqlite3", Identity(uuid4(), "chef", "", 2)) as memory:
        assert sum(memory.success_record("kitchen", name).failures for name in ("boil", "steam")) == 0
    pursued(tmp_path, {"boil": [StepStatus.DENIED], "steam": [StepStatus.DENIED]})
    with open_memory(tmp_path / "memory.sqlite3", Identity(uuid4(), "chef", "", 3)) as memory:
        assert sum(memory.success_record("kitchen", name).failures for name in ("boil", "steam")) >= 1


def test_tries_are_forgone_where_they_are_hopeless_and_never_added(tmp_path: Path) -> None:
    with open_memory(tmp_path / "memory.sqlite3", Identity(uuid4(), "chef", "", 1)) as memory:
        for name in ("boil", "steam"):
            remember(memory, name, 0, 28)
    always: dict[str, list[Scripted]] = {"boil": ["cold"] * 40, "steam": ["cold"] * 40}
    report, runtime = pursued(tmp_path, always)
    assert (len(report.steps), report.retries, report.replans) == (4, 0, 3)
    assert "`boil` 0 of" in notes_of(runtime, "retries-skipped")[0]["reason"]
    report, _ = pursued(tmp_path / "new", always)
    # Until the record is long enough, every try that the plan has.
    assert (len(report.steps), report.retries) == (16, 12)


def test_one_provider_with_hope_is_worth_a_further_try(tmp_path: Path) -> None:
    with open_memory(tmp_path / "memory.sqlite3", Identity(uuid4(), "chef", "", 1)) as memory:
        remember(memory, "boil", 0, 28)
    report, runtime = pursued(tmp_path, {"boil": ["cold"] * 40, "steam": ["cold"] * 2})
    assert report.reached
    assert notes_of(runtime, "retries-skipped") == []
    assert report.retries >= 2


def test_hopeless_tries_are_made_where_planning_again_would_be_in_a_new_state(tmp_path: Path) -> None:
    """Of that state the proof of the rules may say nothing, so the tries that it counts on are made."""
    turn = skill("turn", outcome("turned", {"wrapper_aligned": True}))
    rules = (rule("wrapper_aligned", "turn"), rule("dumpling_cooked", "boil", retry=2))
    kitchen = module("kitchen", (turn, BOIL), task("cook", ("cook",), "dumpling_cooked", *rules))
    with open_memory(tmp_path / "memory.sqlite3", Identity(uuid4(), "chef", "", 1)) as memory:
        remember(memory, "boil", 0, 28, where=evidence_context(TASK, kitchen, (BOIL,), world()))
    runtime = FakeRuntime({"kitchen": kitchen}, {"boil": ["cold"] * 40}, at=site(replans=1))
    with start_agent(tmp_path, "chef", runtime) as agent:
        agent.run("cook")
    # The first plan was made before the turn; the second one begins where its step fails.
    assert runtime.submitted == ["turn", "boil", "boil", "boil", "boil"]


def test_a_step_says_how_long_it_usually_takes(tmp_path: Path) -> None:
    pursued(tmp_path, {})
    runtime = FakeRuntime({"kitchen": KITCHEN})
    seen: list[str] = []
    with start_agent(tmp_path, "chef", runtime, on_event=lambda event: seen.append(event.text)) as agent:
        while "succeeded in" not in "".join(seen):
            runtime.state["dumpling_cooked"] = False
            agent.run("cook")
    (step,) = [text for text in seen if "succeeded in about 1 s" in text]
    assert step.startswith("step kitchen.")


def test_an_agent_learns_which_skill_serves_and_tries_less(tmp_path: Path) -> None:
    """Boiling succeeds in 3 of 10 tries, steaming in 9: a fair coin needs 1.7 tries a run, the better 1.1."""
    chances = {"boil": 0.3, "steam": 0.9}
    random = Random(0)  # noqa: S311  a test
    runtime = FakeRuntime(
        {"kitchen": KITCHEN}, chance=lambda name, _: "cooked" if random.random() < chances[name] else "cold"
    )
    submitted = []
    for _ in range(100):
        runtime.state["dumpling_cooked"] = False
        with start_agent(tmp_path, "chef", runtime) as agent:
            assert agent.run("cook").reached
        submitted.append(list(runtime.submitted))
        runtime.submitted.clear()
    late = [name for run in submitted[50:] for name in run]
    assert late.count("steam") / len(late) > 0.85
    assert len(late) / 50 < 1.3
    assert 0 < [name for run in submitted for name in run].count("boil") < 30


# What a plan that names a capability must be, and what time does to it.

HOLDS_ARM = replace(skill("fry", COOKED), resources=frozenset(("arm",)))
WASH = replace(skill("wash", outcome("washed", {"wrapper_aligned": True})), resources=frozenset(("arm",)))
BUSY = replace(
    module("kitchen", (BOIL, STEAM, HOLDS_ARM, WASH), COOK),
    capabilities={
        "cooking": ("boil", "steam"),
        "frying": ("boil", "fry"),
        "mixed": ("boil", "a_composition"),
    },
)


def problems(*parts: Part) -> list[str]:
    return verify_plan(TaskGraph(parts), {"kitchen": BUSY}, replace(site(), resources={"arm": 1}))


def test_a_plan_may_name_a_capability_of_skills() -> None:
    assert problems(PlanStep("kitchen", "cooking", retry=3)) == []


@pytest.mark.parametrize(
    ("part", "problem"),
    [
        (PlanStep("kitchen", "mixed"), "`kitchen` has no skill `mixed`"),
        (PlanStep("kitchen", "cooking", {"salt": 1.0}), "`salt` is not an input of it"),
        (
            PlanStep("kitchen", "cooking", retry=1, on_failure=PlanStep("kitchen", "fryng")),
            "its `on_failure`, `kitchen.fryng`: `kitchen` has no skill `fryng`; did you mean",
        ),
        (
            PlanStep("kitchen", "frying", retry=1, between_tries=PlanStep("kitchen", "fry")),
            "leads back to itself: `kitchen.fry`",
        ),
        (
            Par((PlanStep("kitchen", "wash"), PlanStep("kitchen", "frying")), SPAN),
            "need 2 of `arm` at the same time",
        ),
    ],
)
def test_a_plan_is_rejected_for_what_any_provider_would_do(part: Part, problem: str) -> None:
    assert any(problem in found for found in problems(part)), problems(part)


def test_steps_that_share_nothing_with_any_provider_may_run_in_parallel() -> None:
    """Steaming reads what washing writes; boiling alone would do."""
    boil_only = replace(BUSY, capabilities={"cooking": ("boil",)})
    branches = Par((PlanStep("kitchen", "wash"), PlanStep("kitchen", "cooking")), SPAN)
    at = replace(site(), resources={"arm": 1})
    assert verify_plan(TaskGraph((branches,)), {"kitchen": boil_only}, at) == []
    (problem,) = verify_plan(TaskGraph((branches,)), {"kitchen": BUSY}, at)
    assert "`wrapper_aligned` is written by one branch while the other uses it" in problem


def test_a_precondition_measured_too_long_ago_starts_nothing(memory: Memory) -> None:
    runtime = FakeRuntime({"kitchen": KITCHEN})
    attempts = StepRunner(runtime, memory, Journal(runtime, memory, None), TASK)
    runtime.clock += 5.5  # the site allows 5 s
    late = attempts.start(StepRole.STEP, "kitchen", "steam", {})
    assert isinstance(late, AttemptResult)
    assert late.record is None
    assert "`wrapper_aligned` was measured 5.5 s ago; 5 s is allowed" in late.reason
    attempts.observe()
    assert isinstance(attempts.start(StepRole.STEP, "kitchen", "steam", {}), RunningAttempt)
