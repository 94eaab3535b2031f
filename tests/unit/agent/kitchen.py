"""A runner of dumpling skills over a runtime in memory, and its memory."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import Any, Final

from aeros.agent.execution.attempt import AttemptResult, RunningAttempt
from aeros.agent.execution.journal import Journal
from aeros.agent.execution.report import StepRole
from aeros.agent.execution.step_attempt import StepRunner
from aeros.agent.memory.evidence import DurationStats
from aeros.agent.memory.posterior import SuccessRecord
from aeros.agent.memory.store import EpisodeEnd, EpisodeStart
from tests.differential.real_loop import Forgetful
from tests.unit.agent.fake_runtime import Ending, FakeRuntime

NO_RECORD: Final = SuccessRecord(0, 0)


class Listed(Forgetful):
    """A memory that lists the episodes, and holds one record of every skill."""

    def __init__(self, record: SuccessRecord = NO_RECORD) -> None:
        self.record = record
        self.usual: DurationStats | None = None
        self.starts: list[EpisodeStart] = []
        self.ends: list[tuple[int, EpisodeEnd]] = []
        self.events: list[str] = []

    def start_episode(self, step: EpisodeStart) -> int:
        self.starts.append(step)
        return 40 + len(self.starts)

    def end_episode(self, episode: int, how: EpisodeEnd) -> None:
        self.ends.append((episode, how))

    def add_event(self, time: float, kind: str, details: Mapping[str, Any]) -> None:
        self.events.append(kind)

    def success_record(
        self, module: str, skill: str, context: str | None = None, until: int | None = None
    ) -> SuccessRecord:
        return self.record

    def typical_duration(self, module: str, skill: str, code: str = "") -> DurationStats | None:  # type: ignore[override]
        return self.usual

    def recent_duration(self, module: str, skill: str, code: str, context: str) -> float | None:
        return None if self.usual is None else self.usual.median


class Kitchen:
    """A runner of dumpling skills over a runtime in memory."""

    def __init__(
        self,
        endings: Mapping[str, list[Ending]] | None = None,
        record: SuccessRecord = NO_RECORD,
        **true: bool,
    ) -> None:
        self.runtime = FakeRuntime(endings=endings)
        self.runtime.state |= true
        self.memory = Listed(record)
        journal = Journal(self.runtime, self.memory, None)
        self.runner = StepRunner(self.runtime, self.memory, journal, "dumpling.make_dumplings")

    def attempt(self, skill: str, role: StepRole = StepRole.STEP, **inputs: Any) -> AttemptResult:
        started = self.runner.start(role, "dumpling", skill, inputs)
        if isinstance(started, AttemptResult):
            return started
        assert isinstance(started, RunningAttempt)
        ended = self.runner.wait(inf)
        assert ended is not None
        assert ended.step == started.handle
        return self.runner.finish(started.pending, ended.result)

    def note(self, kind: str) -> dict[str, Any]:
        (details,) = [details for event, details in self.runtime.notes if event == kind]
        return details
