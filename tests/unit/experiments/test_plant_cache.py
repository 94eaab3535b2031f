"""Trials that ask a plant the same, and have the same luck, share what it did, and no others do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import count
from math import inf
from pathlib import Path
from typing import Any, cast

import pytest

from aeros.experiments.condition import TrialCondition
from aeros.experiments.plant_cache import LivePlant, PlantTrace, PlantTraceCache, ReplayingRuntime
from aeros.experiments.random_stream import SeedRandomStream
from aeros.experiments.trial_kinds import EQUIVALENT_INTERVAL, condition_digest
from aeros.experiments.trial_plants import OpenPlant
from aeros.experiments.trial_runner import run_trials
from aeros.experiments.trial_store import TrialStore
from aeros.experiments.trials import task
from aeros.experiments.trials.task import KIND, TaskTrials
from aeros.runtime.execution.executor import Executor
from aeros.runtime.ports import (
    EMPTY_LOG_HEAD,
    EndedStep,
    Plant,
    Runtime,
    StepHandle,
    StepRequest,
    StepResult,
    StepStatus,
)
from aeros.session.assembly import build_executor
from aeros.spec.diagnostics.errors import InternalError
from tests.unit.experiments.support.common import (
    ROOT,
    WHERE,
    Here,
    comparable_findings,
    condition,
    premises,
    settings,
)

DRAWS = (0.5, 0.2, 0.7)
"""With which each wait is compared: it fails where the rate is above it."""


class Scripted:
    """A plant and its runtime in one: a wait takes a second, and fails by the draws."""

    opened = 0

    def __init__(self, rate: float, slips: float = 0.0) -> None:
        type(self).opened += 1
        self.rate, self.slips = rate, slips
        self.started, self.waited = 0, 0

    def now(self) -> float:
        return self.waited * (1.0 + self.slips)

    def observe(self) -> Mapping[str, Any]:
        return {}

    def start(self, request: StepRequest) -> StepHandle:
        self.started += 1
        return StepHandle(self.started)

    def wait(self, until: float = inf) -> EndedStep:
        failed = DRAWS[self.waited] < self.rate
        self.waited += 1
        status = StepStatus.STOPPED if failed else StepStatus.FINISHED
        return EndedStep(StepHandle(self.started), StepResult(status, "", allowed=self.waited))

    def cancel(self, step: StepHandle, reason: str) -> None:
        self.started += 100

    def alike(self) -> tuple[float, float]:
        had = DRAWS[: self.waited]
        low = max((one for one in had if one < self.rate), default=0.0)
        return low, min((one for one in had if one >= self.rate), default=1.0)


@pytest.fixture(autouse=True)
def _count() -> None:
    Scripted.opened = 0


def trial(cached: list[PlantTrace], rate: float, asked: str, slips: float = 0.0) -> tuple[Any, ...]:
    """Run the skills of `asked`, a letter for each, and return the results; a stop cancels."""

    with following(cached, rate, slips) as runtime:
        answers = list(answers_of(runtime, asked))
        return answers, runtime.now(), SeedRandomStream(0, rate).equivalent_interval(runtime.state.draws)


def following(cached: list[PlantTrace], rate: float, slips: float = 0.0) -> ReplayingRuntime:
    @contextmanager
    def opened() -> Iterator[LivePlant]:
        plant = Scripted(rate, slips)
        yield LivePlant(cast(Runtime, plant), OpenPlant(cast(Any, plant), {"waits": 0}, plant.alike))

    return ReplayingRuntime(premises().configuration, cached, SeedRandomStream(0, rate), opened)


def answers_of(runtime: ReplayingRuntime, asked: str) -> Iterator[bool]:
    for skill in asked:
        step = runtime.start(StepRequest("module", skill, {}))
        assert not isinstance(step, StepResult)
        if skill == "-":
            runtime.cancel(step, "no more")
        ended = runtime.wait()
        assert ended is not None
        yield ended.result.status is StepStatus.FINISHED


def test_an_equal_request_follows_and_a_different_one_continues_alone() -> None:
    cached: list[PlantTrace] = []
    assert trial(cached, 0.3, "ab") == ([True, False], 2.0, (0.2, 0.5))
    assert Scripted.opened == 1
    assert trial(cached, 0.3, "a") == ([True], 1.0, (0.0, 0.5))
    assert trial(cached, 0.3, "ab") == ([True, False], 2.0, (0.2, 0.5))
    assert trial(cached, 0.3, "") == ([], 0.0, (0.0, 1.0))
    assert Scripted.opened == 1
    assert trial(cached, 0.3, "ac") == ([True, False], 2.0, (0.2, 0.5))
    assert Scripted.opened == 2
    assert trial(cached, 0.3, "aca") == ([True, False, True], 3.0, (0.2, 0.5))
    assert Scripted.opened == 3
    assert trial(cached, 0.3, "a-") == ([True, False], 2.0, (0.2, 0.5))
    assert Scripted.opened == 4


def test_another_rate_follows_as_long_as_it_would_have_drawn_the_same() -> None:
    cached: list[PlantTrace] = []
    trial(cached, 0.3, "ab")
    assert trial(cached, 0.1, "a") == ([True], 1.0, (0.0, 0.5))
    assert trial(cached, 0.45, "ab") == ([True, False], 2.0, (0.2, 0.5))
    assert Scripted.opened == 1
    assert trial(cached, 0.1, "ab") == ([True, True], 2.0, (0.0, 0.2))
    assert Scripted.opened == 2
    assert trial(cached, 0.9, "a") == ([False], 1.0, (0.5, 1.0))
    assert Scripted.opened == 3
    # On the very number between two draws, only the condition that has it follows itself.
    assert trial(cached, 0.5, "a") == ([True], 1.0, (0.0, 0.5))
    assert Scripted.opened == 4
    assert trial(cached, 0.5, "a")[0] == [True]
    assert Scripted.opened == 4


def test_a_plant_that_does_not_repeat_itself_is_noticed() -> None:
    cached: list[PlantTrace] = []
    trial(cached, 0.3, "ab")
    with pytest.raises(InternalError, match="plant is not deterministic"):
        trial(cached, 0.3, "abc", slips=0.125)
    assert len(cached) == 1


def test_a_trial_has_no_record() -> None:
    cached: list[PlantTrace] = []
    trial(cached, 0.3, "a")
    stream = SeedRandomStream(0, 0.3)
    with ReplayingRuntime(premises().configuration, cached, stream, lambda: pytest.fail("opened")) as runtime:
        runtime.note("anything", {})
        assert (runtime.log_head(), runtime.events_since(EMPTY_LOG_HEAD)) == (EMPTY_LOG_HEAD, ())
        assert not runtime.is_stopped
        assert not runtime.is_live
        assert runtime.site is premises().configuration.site
        assert runtime.certificate("unknown") is None
        assert runtime.active_modules() is premises().configuration.modules


def test_the_time_of_a_trial_alone_is_the_sum_of_the_times_of_its_parts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = count()
    monkeypatch.setattr("aeros.experiments.plant_cache.process_time", lambda: next(clock))
    cached: list[PlantTrace] = []
    times = []
    for asked in ("ab", "ab", "abc"):
        with following(cached, 0.3) as runtime:
            list(answers_of(runtime, asked))
        times.append((runtime.is_live, runtime.cpu_time_s, runtime.unshared_cpu_time_s))
    # A second passes from each look at the clock to the next: to prepare, which is not the trial's, to open,
    # for each of two questions a skill, to close; and for a plant of its own that is asked everything again,
    # as long as that goes on.
    assert times == [
        (True, 3 + 4 + 1, 1 + 4 + 1),
        (False, 0, 1 + 4 + 1),
        (True, 11 + 2 + 1, 1 + 6 + 1),
    ]


def test_traces_are_kept_until_another_group_is_asked_for() -> None:
    cached = PlantTraceCache()
    first = cached.traces("plants")
    assert cached.traces("plants") is first
    assert cached.traces("others") is not first
    assert cached.traces("plants") is not first


@pytest.mark.parametrize(
    "architectures",
    [
        ("flat", "behaviour_tree"),
        pytest.param(("flat", "behaviour_tree", "progprompt", "aeros"), marks=pytest.mark.deep),
    ],
)
def test_on_the_symbolic_plant_trials_that_share_find_what_each_finds_alone(
    architectures: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(KIND, "_traces", PlantTraceCache())  # those of other tests aside
    seeds = range(5)
    rates, bursts = ("1/10", "1/2", "9/10"), [{"bursts": {"mean_length": one}} for one in ("2", "8")]
    conditions = [
        condition(task="clean_table", architecture=name, **changed)
        for name in architectures
        for changed in [{"rate": one} for one in rates] + bursts
    ]
    with TrialStore(tmp_path) as store:
        run_trials(conditions, seeds, WHERE, Here(), 1, store, lambda _: None)
        trials = dict(store.trials)
    assert len(trials) == len(seeds) * len(conditions)
    lived = dict.fromkeys(seeds, 0)
    for (_, seed), one in trials.items():
        lived[seed] += one["live"]
    # The first seed has nothing to follow but itself; whatever is drawn later has mostly been drawn before.
    assert sum(lived.values()) < len(trials) / 3
    assert lived[seeds[-1]] < lived[0]
    # The first, which all others follow, and the last, which follows most; `make deep` tries all.
    compared = seeds if len(architectures) > 2 else (seeds[0], seeds[-1])
    for tried in conditions:
        for seed in compared:
            # A kind that has run nothing, so that there is nothing to be followed.
            with TaskTrials().open(tried, premises()) as alone:
                assert comparable_findings(alone(seed), EQUIVALENT_INTERVAL) == comparable_findings(
                    trials[condition_digest(tried, premises().digest), seed], EQUIVALENT_INTERVAL
                )


def test_nothing_is_compiled_in_what_trials_at_symbolic_plants_follow(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    opened: list[Plant] = []

    def counted(configuration: Any, plant: Plant, *more: Any, **named: Any) -> Executor:
        opened.append(plant)
        return build_executor(configuration, plant, *more, **named)

    monkeypatch.setattr(task, "build_executor", counted)
    needed = []
    with TaskTrials().open(condition(task="clean_table", rate="1/2"), premises()) as trial:
        for seed in range(8):
            before = len(opened)
            found = trial(seed)
            needed.append(found["live"])
            # Who needs a plant is rehearsed at another, of which nothing is kept.
            assert len(opened) - before == (2 if found["live"] else 0)
        assert not trial(0)["live"]
    assert needed[0]
    assert any(needed[1:])
    assert not all(needed)


def test_a_plant_that_draws_something_else_when_asked_again_is_noticed() -> None:
    class Fickle(SeedRandomStream):
        def reproduces(self, draws: Any) -> bool:
            return super().reproduces(draws) and Scripted.opened < 2

    cached: list[PlantTrace] = []
    trial(cached, 0.3, "ab")
    stream = Fickle(0, 0.3)

    @contextmanager
    def opened() -> Iterator[LivePlant]:
        plant = Scripted(0.3)
        yield LivePlant(cast(Runtime, plant), OpenPlant(cast(Any, plant), {"waits": 0}, plant.alike))

    with (
        ReplayingRuntime(premises().configuration, cached, stream, opened) as runtime,
        pytest.raises(InternalError, match="plant is not deterministic"),
    ):
        list(answers_of(runtime, "abc"))


@pytest.mark.deep
@pytest.mark.physics
def test_on_physics_trials_that_share_find_what_each_finds_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(KIND, "_traces", PlantTraceCache())  # those of other tests aside
    faults = (ROOT / "experiments/faults/fetch_object.yaml").read_text()
    given = settings("fetch_object", faults=faults)
    named = (("flat", "1/10"), ("flat", "9/10"), ("behaviour_tree", "1/10"), ("behaviour_tree", "9/10"))
    conditions = [
        TrialCondition.create("task", "physics", {**given, "architecture": name, "rate": rate})
        for name, rate in named
    ]
    with TrialStore(tmp_path) as store:
        run_trials(conditions, [0], WHERE, Here(), 1, store, lambda _: None)
        found = [store.trials[condition_digest(one, premises().digest), 0] for one in conditions]
    # With seed 0 the object is missed at the higher rate alone, so of four trials two had to be simulated.
    assert [one["failed_tries"] for one in found] == [0, 1, 0, 2]
    assert [one["live"] for one in found] == [False, False, True, True]
    # Of the two that followed, the one with a miss, by a kind that has run nothing to be followed.
    with TaskTrials().open(conditions[1], premises()) as alone:
        assert comparable_findings(alone(0), EQUIVALENT_INTERVAL) == comparable_findings(
            found[1], EQUIVALENT_INTERVAL
        )
