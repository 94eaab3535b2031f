"""A plan's graph at work: branches, conditions, handlers, and what an end leaves alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf
from typing import Any

import pytest

from aeros.agent.execution.journal import Journal
from aeros.agent.execution.part_stops import PlanFailure
from aeros.agent.execution.plan_executor import PlanExecutor
from aeros.agent.execution.report import StepRole
from aeros.agent.execution.step_attempt import StepRunner
from aeros.agent.planning.task_graph import Part, PlanStep, TaskGraph, verify_plan
from aeros.runtime.ports import StepResult, StepStatus
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import Definition
from aeros.spec.model.step_graph import FailingPart, Fallback, If, Par, RetriedPart, Seq
from tests.differential.real_loop import Forgetful
from tests.unit.agent.dumplings import (
    FORCE,
    SPAN,
    module,
    outcome,
    site,
    skill,
    term,
)
from tests.unit.agent.fake_runtime import FakeRuntime

DOUGH = skill("dough", outcome("there", {"dough_on_workspace": True}), outcome("torn", {}, failure=True))
FILLING = skill("filling", outcome("there", {"filling_on_workspace": True}), outcome("out", {}, failure=True))
WATER = skill("water", outcome("hot", {}), outcome("cold", {}, failure=True))
ALIGN = skill("align", outcome("aligned", {"wrapper_aligned": True}), outcome("askew", {}, failure=True))
WRAP = skill("wrap", outcome("wrapped", {"dumpling_wrapped": True}), precondition="wrapper_aligned")
WEIGH = skill("weigh", outcome("weighed", {}))
KNEAD = skill("knead", outcome("kneaded", {}), inputs={"force": replace(FORCE, default_value=None)})
SKILLS = (DOUGH, FILLING, WATER, ALIGN, WRAP)
MODULES = {"kitchen": module("kitchen", SKILLS)}


def step(name: str, retry: int = 0, **more: Any) -> PlanStep:
    return PlanStep("kitchen", name, retry=retry, **more)


def par(*branches: Part) -> Par[PlanStep]:
    return Par(branches, SPAN)


def if_aligned(then: Part, otherwise: Part | None = None) -> If[PlanStep]:
    return If(term("wrapper_aligned"), "wrapper_aligned", then, otherwise, SPAN)


def either(*parts: Part) -> Fallback[PlanStep]:
    return Fallback(parts, SPAN)


class Kitchen:
    """An engine over a runtime in memory."""

    def __init__(
        self,
        endings: dict[str, list[Any]] | None = None,
        last: tuple[str, ...] = (),
        modules: dict[str, Ecm] | None = None,
    ) -> None:
        self.modules = modules or MODULES
        self.runtime = FakeRuntime(self.modules, endings)
        self.runtime.last = list(last)
        memory = Forgetful()
        self.journal = Journal(self.runtime, memory, None)
        self.attempts = StepRunner(self.runtime, memory, self.journal, "task")
        self.engine: PlanExecutor | None = None

    def run(
        self, *parts: Part, is_over: Callable[[], bool] = lambda: False, until: float = inf
    ) -> PlanFailure | None:
        assert verify_plan(TaskGraph(parts), self.modules, site()) == []
        self.engine = PlanExecutor(self.attempts, self.journal, is_over, until)
        return self.engine.run(Seq(parts))

    @property
    def ended(self) -> list[tuple[str, StepStatus]]:
        return [(record.skill, record.status) for record in self.attempts.records]

    @property
    def started(self) -> list[str]:
        return [
            note[1]["skill"].removeprefix("kitchen.")
            for note in self.runtime.notes
            if note[0] == "step-started"
        ]


DONE, CANCELLED = StepStatus.FINISHED, StepStatus.CANCELLED


def test_branches_run_at_the_same_time_and_what_follows_waits_for_all() -> None:
    kitchen = Kitchen(last=("dough",))
    assert kitchen.run(par(step("dough"), Seq((step("filling"), step("water")))), step("align")) is None
    assert kitchen.started == ["dough", "filling", "water", "align"]
    assert [name for name, _ in kitchen.ended] == ["filling", "water", "dough", "align"]


def test_a_branch_that_fails_for_good_cancels_the_others_and_nothing_follows() -> None:
    kitchen = Kitchen({"filling": ["out", "out"]}, last=("dough",))
    end = kitchen.run(par(Seq((step("dough"), step("water"))), step("filling", retry=1)), step("align"))
    assert end == PlanFailure("`kitchen.filling` failed: outcome `out`")
    assert kitchen.ended == [("filling", DONE), ("filling", DONE), ("dough", CANCELLED)]
    assert kitchen.started == ["dough", "filling", "filling"]


def test_a_branch_that_cannot_start_lets_no_other_start() -> None:
    kitchen = Kitchen()
    end = kitchen.run(par(step("wrap"), step("dough")))
    assert end is not None
    assert "its precondition `wrapper_aligned` is not met" in end.reason
    assert kitchen.started == []


def test_a_cancellation_reaches_branches_inside_branches() -> None:
    kitchen = Kitchen({"filling": ["out"]}, last=("dough", "water"))
    inner = par(step("dough"), Seq((step("water"), step("align"))))
    assert kitchen.run(par(inner, step("filling"))) == PlanFailure("`kitchen.filling` failed: outcome `out`")
    assert kitchen.ended == [("filling", DONE), ("dough", CANCELLED), ("water", CANCELLED)]


def test_a_par_that_has_ended_is_not_cancelled_with_what_comes_later() -> None:
    kitchen = Kitchen({"align": ["askew"]})
    early = Seq((par(step("dough"), step("filling")), step("align")))
    assert kitchen.run(par(early, step("water"))) == PlanFailure("`kitchen.align` failed: outcome `askew`")
    assert [name for name, status in kitchen.ended if status is CANCELLED] == []


@pytest.mark.parametrize(
    ("measured", "taken", "end"),
    [
        (True, ["dough"], None),
        (False, ["filling"], None),
        (None, [], "the plan does not say how to continue if `wrapper_aligned` is not met"),
    ],
)
def test_a_condition_is_what_is_measured_then(
    measured: bool | None, taken: list[str], end: str | None
) -> None:
    kitchen = Kitchen()
    kitchen.runtime.state["wrapper_aligned"] = measured
    if measured is None:
        del kitchen.runtime.state["wrapper_aligned"]
    choice = if_aligned(step("dough"), step("filling"))
    found = kitchen.run(step("water"), choice)
    assert kitchen.started == ["water", *taken]
    assert (found is None) == (end is None)
    assert found is None or found.reason.startswith(end or "")


def test_a_predicate_by_definition_that_decides_no_branch_is_explained_by_what_is_behind_it() -> None:
    kitchen = Kitchen()
    aligned = Definition(term("fill_level <= 0.5"), "fill_level <= 0.5", SPAN)
    defined = replace(MODULES["kitchen"], definitions={"wrapper_aligned": aligned})
    kitchen.runtime.modules["kitchen"] = defined
    del kitchen.runtime.state["wrapper_aligned"]
    kitchen.runtime.state.pop("fill_level", None)
    found = kitchen.run(if_aligned(step("dough")))
    assert found is not None
    assert found.reason.endswith("by definition of wrapper_aligned: `fill_level` is not measured")
    assert [cause.rule for cause in found.causes] == ["wrapper_aligned"]


def test_a_condition_that_was_taken_to_hold_and_does_not_ends_it() -> None:
    kitchen = Kitchen()
    found = kitchen.run(step("water"), if_aligned(step("dough")))
    assert found is not None
    assert "is not met: `wrapper_aligned` = False" in found.reason


def test_nothing_to_do_is_done() -> None:
    choice = if_aligned(step("dough"), Seq(()))
    assert Kitchen().run(step("water"), choice) is None


def test_a_handler_runs_between_two_tries_and_is_tried_itself() -> None:
    kitchen = Kitchen({"dough": ["torn"], "align": ["askew"]})
    assert (
        kitchen.run(step("dough", retry=1, between_tries=step("align", retry=1), needs_recovery=True)) is None
    )
    roles = [(record.skill, record.role) for record in kitchen.attempts.records]
    assert roles == [
        ("dough", StepRole.STEP),
        ("align", StepRole.RECOVERY),
        ("align", StepRole.RETRY),
        ("dough", StepRole.RETRY),
    ]


def test_a_handler_that_fails_for_good_ends_its_step() -> None:
    kitchen = Kitchen({"dough": ["torn"], "align": ["askew"]})
    end = kitchen.run(step("dough", retry=1, between_tries=step("align"), needs_recovery=True), step("water"))
    assert end == PlanFailure("`kitchen.align` failed: outcome `askew`")
    assert kitchen.started == ["dough", "align"]


def test_when_the_time_is_over_everything_is_cancelled_once() -> None:
    kitchen = Kitchen(last=("dough", "filling"))
    end = kitchen.run(par(step("dough"), step("filling")), step("water"), until=100.5)
    assert end == PlanFailure("`kitchen.dough` failed: cancelled: the time limit of the task has passed")
    assert kitchen.ended == [("dough", CANCELLED), ("filling", CANCELLED)]
    assert kitchen.engine is not None
    assert kitchen.engine.timed_out
    assert kitchen.runtime.clock == 100.5


def test_a_step_that_a_client_cancels_says_so() -> None:
    kitchen = Kitchen(last=("dough",))
    kitchen.attempts.waiting.is_cancelled = lambda: True
    end = kitchen.run(step("dough"), step("water"))
    assert end == PlanFailure("`kitchen.dough` failed: cancelled: the client cancelled the task")
    assert kitchen.ended == [("dough", CANCELLED)]
    assert kitchen.engine is not None
    assert not kitchen.engine.timed_out


def test_once_the_goal_is_measured_nothing_starts_and_what_runs_ends_by_itself() -> None:
    kitchen = Kitchen(last=("dough",))
    measured = lambda: kitchen.runtime.state["filling_on_workspace"]  # noqa: E731
    branches = par(Seq((step("dough"), step("align"))), Seq((step("filling"), step("water"))))
    assert kitchen.run(branches, step("wrap"), is_over=measured) is None
    assert kitchen.ended == [("filling", DONE), ("dough", DONE)]


def test_a_step_that_was_refused_at_once_has_failed() -> None:
    kitchen = Kitchen()
    kitchen.runtime.start = lambda request: StepResult(StepStatus.REFUSED, "no")  # type: ignore[method-assign]
    end = kitchen.run(par(step("dough"), step("filling")))
    assert end == PlanFailure("`kitchen.dough` failed: refused: no")
    assert kitchen.ended == [("dough", StepStatus.REFUSED)]


# What a plan may put side by side.

HOLDING = (
    replace(DOUGH, resources=frozenset({"bench"}), actuators=frozenset({"left"})),
    replace(FILLING, resources=frozenset({"bench"}), actuators=frozenset({"right"})),
    replace(WATER, actuators=frozenset({"left"})),
    replace(ALIGN, resources=frozenset({"bench"})),
    WRAP,
)


@pytest.mark.parametrize(
    ("branches", "problem"),
    [
        ((step("dough"), step("filling")), None),
        ((step("dough"), step("filling"), step("align")), "need 3 of `bench` at the same time"),
        ((step("dough"), step("water")), "may move `left` at the same time"),
        (
            (step("filling", retry=1, between_tries=step("dough")), step("water")),
            "may move `left` at the same time",
        ),
        (
            (step("filling", on_failure=step("dough")), step("water")),
            "may move `left` at the same time",
        ),
        ((step("align"), step("wrap")), "`wrapper_aligned` is written by one branch"),
        (
            (step("align"), if_aligned(step("water"), Seq(()))),
            "`wrapper_aligned` is written by one branch",
        ),
    ],
)
def test_branches_that_interfere_are_no_plan(branches: tuple[Part, ...], problem: str | None) -> None:
    modules = {"kitchen": module("kitchen", HOLDING)}
    found = verify_plan(TaskGraph((par(*branches),)), modules, replace(site(), resources={"bench": 2}))
    assert [problem in text for text in found if problem] == ([] if problem is None else [True])
    assert (found == []) == (problem is None)


def _nested(depth: int) -> Part:
    return step("dough") if depth == 0 else Seq((_nested(depth - 1),))


@pytest.mark.parametrize(
    ("part", "problem"),
    [
        (par(step("dough")), "a `par` has not two branches"),
        (Par([step("dough"), step("filling")], SPAN), "a `par` has not two branches"),  # type: ignore[arg-type]
        (Seq([step("dough")]), "a Seq is malformed"),  # type: ignore[arg-type]
        (If("true", "true", step("dough"), None, SPAN), "a If is malformed"),  # type: ignore[arg-type]
        (Par((step("dough"), step("filling")), None), "a Par is malformed"),  # type: ignore[arg-type]
        (if_aligned(3), "a int is not a step"),  # type: ignore[arg-type]
        (_nested(21), "nested more than 20 deep"),
        (Fallback((), SPAN), "a Fallback is malformed"),
        (RetriedPart(step("dough"), True, SPAN), "a RetriedPart is malformed"),
        (RetriedPart(step("dough"), 99, SPAN), "99 retries of a part; this site allows 0 to"),
        (FailingPart("near", None), "a FailingPart is malformed"),  # type: ignore[arg-type]
        (either(step("dough"), step("flour")), "`kitchen` has no skill `flour`"),
        (par(step("dough"), Seq(())), "a branch of a `par` has no step"),
        (step("dough", on_failure=3), "`on_failure` is of type int"),
        (step("dough", flows={"force": "weigh"}), "`flows` does not name an output of a step"),
        (step("dough", flows={"force": ("weigh", "force")}), "`force` is not an input of it"),
        (
            step("dough", between_tries=step("flour")),
            "step 1, its `between_tries`, `kitchen.flour`: `kitchen` has no skill",
        ),
    ],
)
def test_a_graph_that_is_none_is_no_plan(part: Part, problem: str) -> None:
    (found,) = verify_plan(TaskGraph((part,)), MODULES, site())
    assert problem in found


# Inputs that take outputs of earlier steps.


@pytest.mark.parametrize(
    ("given", "asked", "end"),
    [
        ({"force": 0.25}, {"force": 0.25}, None),
        ({}, None, "its input `force` takes `weighing.force`, which is missing"),
        ({"force": 2.0}, None, "the input `force` is outside 0 … 1"),
    ],
)
def test_an_input_takes_what_an_earlier_step_gave(given: Any, asked: Any, end: str | None) -> None:
    kitchen = Kitchen(modules={"kitchen": module("kitchen", (*SKILLS, WEIGH, KNEAD))})
    submit = kitchen.runtime.submit
    kitchen.runtime.submit = lambda request: replace(submit(request), outputs=given)  # type: ignore[method-assign]
    parts = (step("weigh", id="weighing"), step("knead", flows={"force": ("weighing", "force")}))
    found = kitchen.run(*parts)
    assert (found is None) == (end is None)
    assert found is None or (end or "") in found.reason
    assert [request.inputs for request in kitchen.runtime.requests[1:]] == ([] if asked is None else [asked])
    assert kitchen.run(parts[1]) is not None  # of another plan's steps nothing is known


# What follows the last try.


def roles(kitchen: Kitchen) -> list[tuple[str, str]]:
    return [(record.skill, record.role.value) for record in kitchen.attempts.records]


def test_on_failure_runs_after_the_last_try_and_the_step_has_failed_all_the_same() -> None:
    kitchen = Kitchen({"dough": ["torn", "torn"]})
    tried = step("dough", retry=1, between_tries=step("water"), on_failure=step("align"))
    assert kitchen.run(tried, step("filling")) == PlanFailure("`kitchen.dough` failed: outcome `torn`")
    assert roles(kitchen) == [
        ("dough", "step"),
        ("water", "recovery"),
        ("dough", "retry"),
        ("align", "recovery"),
    ]


def test_on_failure_runs_where_the_next_try_cannot_start() -> None:
    lost = skill(
        "wrap", outcome("lost", {"wrapper_aligned": False}, failure=True), precondition="wrapper_aligned"
    )
    kitchen = Kitchen({"wrap": ["lost"]}, modules={"kitchen": module("kitchen", (*SKILLS[:4], lost))})
    kitchen.runtime.state["wrapper_aligned"] = True
    kitchen.attempts.observe()
    end = kitchen.run(step("wrap", retry=2, on_failure=step("align")))
    assert end is not None
    assert "its precondition `wrapper_aligned` is not met" in end.reason
    assert roles(kitchen) == [("wrap", "step"), ("align", "recovery")]


@pytest.mark.parametrize("first", ["ready", "denied"])
def test_on_failure_does_not_run_where_nothing_failed_as_declared(first: str) -> None:
    kitchen = Kitchen({"dough": [StepStatus.DENIED]} if first == "denied" else {})
    tried = step("dough" if first == "denied" else "wrap", on_failure=step("align"))
    assert kitchen.run(tried) is not None
    assert [name for name, _ in roles(kitchen)] == (["dough"] if first == "denied" else [])


def test_once_the_goal_is_reached_on_failure_does_not_run() -> None:
    kitchen = Kitchen({"dough": ["torn"]})
    over = lambda: bool(kitchen.attempts.records)  # noqa: E731
    assert kitchen.run(step("dough", on_failure=step("align")), is_over=over) is None
    assert roles(kitchen) == [("dough", "step")]


def test_a_handler_that_a_step_needs_is_followed_by_on_failure() -> None:
    kitchen = Kitchen({"dough": ["torn"], "align": ["askew"]})
    tried = step("dough", retry=1, between_tries=step("align"), needs_recovery=True, on_failure=step("water"))
    assert kitchen.run(tried) == PlanFailure("`kitchen.align` failed: outcome `askew`")
    assert [name for name, _ in roles(kitchen)] == ["dough", "align", "water"]


def test_a_handler_with_an_undeclared_ending_ends_the_step() -> None:
    kitchen = Kitchen({"dough": ["torn"], "align": [StepStatus.DENIED]})
    end = kitchen.run(step("dough", on_failure=step("align")))
    assert end is not None
    assert end.reason.startswith("`kitchen.align` was denied")


def test_an_alternative_runs_only_after_the_one_before_has_failed() -> None:
    kitchen = Kitchen({"dough": ["torn", "torn"]})
    assert kitchen.run(either(step("dough", retry=1), step("filling"), step("water")), step("align")) is None
    assert kitchen.started == ["dough", "dough", "filling", "align"]
    kitchen = Kitchen({"dough": ["torn"], "filling": ["out"]})
    assert kitchen.run(either(step("dough"), step("filling")), step("align")) == PlanFailure(
        "`kitchen.filling` failed: outcome `out`"
    )
    assert kitchen.started == ["dough", "filling"]


def test_a_failure_is_tolerated_and_a_check_fails() -> None:
    kitchen = Kitchen({"dough": ["torn"]})
    check = if_aligned(Seq(()), FailingPart("wrapper_aligned", SPAN))
    assert kitchen.run(either(step("dough"), Seq(())), check) == PlanFailure("`wrapper_aligned` is not met")
    kitchen = Kitchen()
    assert kitchen.run(either(check, step("align")), check, step("water")) is None
    assert kitchen.started == ["align", "water"]


def test_another_try_of_a_part_begins_anew() -> None:
    kitchen = Kitchen({"filling": ["out", "there"]})
    assert kitchen.run(RetriedPart(Seq((step("dough"), step("filling"))), 1, SPAN)) is None
    assert kitchen.started == ["dough", "filling"] * 2
    assert [one.role for one in kitchen.attempts.records] == [StepRole.STEP] * 2 + [StepRole.RETRY] * 2


def test_no_alternative_follows_a_denial_or_an_undeclared_outcome_or_a_cancellation() -> None:
    for ending in (StepResult(StepStatus.DENIED, "no"), StepResult(StepStatus.REFUSED, "no")):
        kitchen = Kitchen({"dough": [ending]})
        assert kitchen.run(either(step("dough"), step("filling"))) is not None
        assert kitchen.started == ["dough"]
    kitchen = Kitchen({"filling": ["out"]}, last=("dough",))
    assert kitchen.run(par(either(step("dough"), step("water")), step("filling"))) is not None
    assert kitchen.started == ["dough", "filling"]


def test_an_alternative_after_a_par_starts_when_all_its_branches_have_ended() -> None:
    kitchen = Kitchen({"filling": ["out"]}, last=("dough",))
    assert kitchen.run(either(par(step("dough"), step("filling")), step("water"))) is None
    assert kitchen.ended == [("filling", DONE), ("dough", CANCELLED), ("water", DONE)]
