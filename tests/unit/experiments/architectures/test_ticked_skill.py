"""A ticked skill is started once, polled until it has ended, and counted."""

from __future__ import annotations

from math import inf

from aeros.agent.planning.task_graph import PlanStep
from aeros.experiments.architecture import ArchitectureReport
from aeros.experiments.architectures.ticked_skill import TickedSkill, TreeCounters
from aeros.runtime.ports import EndedStep, StepHandle, StepRequest, StepResult
from tests.unit.agent.fake_runtime import FakeRuntime
from tests.unit.experiments.support.dumpling_trials import Trial


class OneSecond(FakeRuntime):
    """Each skill takes one second from its start, however often somebody waits for it."""

    began = 0.0

    def start(self, request: StepRequest) -> StepHandle | StepResult:
        self.began = self.clock
        return super().start(request)

    def wait(self, until: float = inf) -> EndedStep | None:
        if self.under_way.keys() & self.cancelled.keys():
            return super().wait()
        if until < self.began + 1.0:
            self.clock = until
            return None
        return super().wait()


def ticked(skill: TickedSkill) -> list[bool | None]:
    found = [skill.tick()]
    while found[-1] is None:
        found.append(skill.tick())
    return found


def test_a_skill_is_polled_until_it_has_ended_and_further_attempts_are_retries() -> None:
    trial, counters = Trial(runtime=OneSecond(endings={"boil": ["nothing_changed"] * 2})), TreeCounters()
    for name in ("prepare", "recover", "wrap"):
        trial.context.run(PlanStep("dumpling", name))
    boil = TickedSkill(trial.context, PlanStep("dumpling", "boil"), counters)
    assert ticked(boil) == [None, False]
    assert (counters.retries, counters.reason) == (0, "boil: outcome `nothing_changed`")
    assert ticked(boil) == [None, False]
    assert ticked(boil) == [None, True]
    assert counters.report(is_success=True) == ArchitectureReport(retries=2)
    assert counters.report(is_success=False).reason == "boil: outcome `nothing_changed`"


def test_a_recovery_never_fails_and_a_halted_skill_starts_anew() -> None:
    trial, counters = Trial(runtime=OneSecond()), TreeCounters()
    recovery = TickedSkill(trial.context, PlanStep("dumpling", "wrap"), counters, is_recovery=True)
    assert recovery.tick() is True  # it cannot start
    prepare = TickedSkill(trial.context, PlanStep("dumpling", "prepare"), counters)
    prepare.halt()  # nothing is under way
    assert prepare.tick() is None
    prepare.halt()
    assert list(trial.runtime.cancelled.values()) == ["the architecture halts it"]
    assert ticked(prepare)[-1] is True
    assert (counters.retries, counters.recoveries, counters.reason) == (1, 1, "")
