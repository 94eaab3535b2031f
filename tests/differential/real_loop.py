"""The agent's own loop, on drawn outcomes, or on every sequence of outcomes there is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from aeros.agent.execution.journal import Journal
from aeros.agent.execution.report import RunReport
from aeros.agent.execution.step_attempt import StepRunner
from aeros.agent.memory.evidence import Hindrance, SkillId
from aeros.agent.memory.experience import ExperiencedEnd
from aeros.agent.memory.posterior import RecentRecord, SuccessRecord
from aeros.agent.memory.sightings import RememberedValue, Sighting
from aeros.agent.memory.store import EpisodeEnd, EpisodeStart, Memory
from aeros.agent.planning.base import Planner, RulePlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.task_loop import TaskLoop
from aeros.runtime.ports import Runtime, StepRequest, StepResult
from aeros.spec.closed_loop.outcome_probabilities import outcome_probabilities
from aeros.spec.model.ecm import Ecm, Task
from aeros.spec.model.site import Site
from tests.unit.agent.fake_runtime import FakeRuntime


class Forgetful(Memory):
    """A memory that costs nothing: the loop only writes to it."""

    def __init__(self) -> None:
        pass

    def start_episode(self, step: EpisodeStart) -> int:
        return 0

    def end_episode(self, episode: int, how: EpisodeEnd) -> None:
        pass

    def add_event(self, time: float, kind: str, details: Mapping[str, Any]) -> None:
        pass

    def success_record(
        self, module: str, skill: str, context: str | None = None, until: int | None = None
    ) -> SuccessRecord:
        return SuccessRecord(0, 0)

    def recent_records(self, contexts: Mapping[SkillId, str]) -> Mapping[SkillId, RecentRecord]:
        return dict.fromkeys(contexts, RecentRecord())

    def recent_duration(self, module: str, skill: str, code: str, context: str) -> float | None:
        return None

    def typical_duration(self, module: str, skill: str, code: str = "") -> None:
        return None

    def experience(
        self, module: str, skill: str, code: str, until: int | None = None
    ) -> Sequence[ExperiencedEnd]:
        return ()

    def note_sightings(self, sightings: Iterable[Sighting]) -> None:
        pass

    def remembered_values(self) -> Mapping[str, RememberedValue]:
        return {}

    def hindrances(self) -> Mapping[str, Sequence[Hindrance]]:
        return {}

    def latest_episode(self) -> int:
        return 0


class Recording(FakeRuntime):
    """Keeps the state after every submission."""

    def __init__(
        self, ecm: Ecm, site: Site, start: Mapping[str, Any], chance: Callable[[str, list[str]], str]
    ) -> None:
        super().__init__({ecm.id: ecm}, chance=chance, at=site)
        self.state = dict(start)
        self.states: list[dict[str, Any]] = []

    def submit(self, request: StepRequest) -> StepResult:
        result = super().submit(request)
        self.states.append(dict(self.state))
        return result


@dataclass(frozen=True)
class Run:
    """A finished run, and the state after each of its steps."""

    report: RunReport
    states: list[dict[str, Any]]


def pursue(ecm: Ecm, task: Task, runtime: Runtime, planner: Planner | None = None) -> RunReport:
    """One run of the agent's loop, by the task's rules unless by another planner."""
    routed = RoutedTask(ecm.id, task)
    memory = Forgetful()
    journal = Journal(runtime, memory, None)
    attempts = StepRunner(runtime, memory, journal, str(routed))
    return TaskLoop(runtime, planner or RulePlanner(), attempts, journal, routed).run("compared")


def run_with(
    ecm: Ecm, task: Task, site: Site, start: Mapping[str, Any], chance: Callable[[str, list[str]], str]
) -> Run:
    """One run in which `chance` says what comes of each submission."""
    runtime = Recording(ecm, site, start, chance)
    return Run(pursue(ecm, task, runtime), runtime.states)


def every_run(
    ecm: Ecm, task: Task, site: Site, start: Mapping[str, Any], world: Ecm | None = None
) -> Iterator[tuple[Fraction, Run]]:
    """Every run there can be, with its probability by the module `world`, if not by that of the agent."""
    shares = {
        name: [
            (outcome.id, share) for outcome, share in outcome_probabilities(skill.outcomes.values()) if share
        ]
        for name, skill in (world or ecm).skills.items()
    }
    script: list[int] = []
    while True:
        choices: list[tuple[int, int, Fraction]] = []

        def chance(skill: str, _: list[str], script: list[int] = script, choices: list[Any] = choices) -> str:
            choice = script[len(choices)] if len(choices) < len(script) else 0
            outcome, share = shares[skill][choice]
            choices.append((choice, len(shares[skill]), share))
            return outcome

        run = run_with(ecm, task, site, start, chance)
        probability = Fraction(1)
        for _, _, share in choices:
            probability *= share
        yield probability, run
        while choices and choices[-1][0] + 1 == choices[-1][1]:
            choices.pop()
        if not choices:
            return
        script = [choice for choice, _, _ in choices[:-1]] + [choices[-1][0] + 1]
