"""Steps that take much longer than their skill did in most of its successes, told once while they run.

Memory shortens no time-out: the proof of a task assumes the declared one, and a step that is cut short may
leave a state that no outcome declares. So a person or a program that watches is told, and decides.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from aeros.agent.execution.attempt import PendingAttempt
from aeros.agent.execution.journal import Journal


@dataclass(frozen=True, slots=True)
class _Watched:
    """A running step, and when it is overdue.

    Attributes:
        pending: the attempt.
        due: plant time from which it is overdue, s.
    """

    pending: PendingAttempt
    due: float


class OverdueSteps:
    """Running steps whose usual duration is known; several may run at once.

    Args:
        journal: takes an entry `step-overdue` for each that becomes overdue.
    """

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self._watched: dict[int, _Watched] = {}

    @property
    def next_due(self) -> float:
        """Plant time at which the next of them is overdue, s; infinite if none will be."""
        return min((one.due for one in self._watched.values()), default=inf)

    def begin(self, pending: PendingAttempt) -> None:
        """Watch a step that has started; without enough successes before, it is never overdue.

        Args:
            pending: the attempt.
        """
        usual = pending.dispatch.typical_duration
        longest = None if usual is None else usual.longest_usual
        if longest is not None:
            due = pending.episode_start.started + longest
            self._watched[pending.episode_id] = _Watched(pending, due)

    def end(self, pending: PendingAttempt) -> None:
        """Watch a step no more.

        Args:
            pending: the attempt, watched or not.
        """
        self._watched.pop(pending.episode_id, None)

    def record(self, now: float) -> None:
        """Record the steps that are overdue, each once.

        Args:
            now: plant time, s.
        """
        for one in [one for one in self._watched.values() if one.due <= now]:
            self.end(one.pending)
            request, usual = one.pending.dispatch.request, one.pending.dispatch.typical_duration
            name = f"{request.module}.{request.skill}"
            seconds = now - one.pending.episode_start.started
            timeout = float(one.pending.dispatch.skill.timeout)
            self._journal.record(
                "step-overdue",
                f"{one.pending.role.value} {name} still runs after {seconds:.3g} s; its successes took "
                f"{usual}; time-out after {timeout:g} s",
                skill=name,
                role=one.pending.role.value,
                seconds=seconds,
                usual_seconds=None if usual is None else usual.median,
                timeout_seconds=timeout,
            )
