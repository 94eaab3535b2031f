"""Failures that repeat: a step ends the same way again, in the same measured state and at the same place.

A declared failure is chance, and retries are for it. A stop for a person or for a silent sensor is not the
skill's doing either. But a skill that meets an obstacle, or does not arrive in time, will do so again as long
as the cause is there. After the second time the agent lets time pass, as an arm may be weak for a while, and
looks again; the third time is the last. An end that the skill does not declare is no chance either.

A plan that is carried out to its end and leaves the same state as before, without the goal, may do so by
chance: the probabilities of its outcomes decide (`aeros.spec.closed_loop.giving_up`).
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any, Final

from aeros.agent.execution.waiting import is_about_person
from aeros.runtime.ports import StepStatus
from aeros.spec.closed_loop.giving_up import FinishedStreak
from aeros.spec.model.cause import Cause
from aeros.spec.model.site import Site

MOST_OF_A_KIND: Final = 3
"""Times that a step may fail in the same way before it is not tried again."""

LOOK_AGAIN_PAUSE_S: Final = 10.0
"""Time that passes before the last try, in plant seconds."""

SECOND_LOOK_PAUSE_S: Final = 2.0
"""Time that passes between a verdict and the try that confirms it, in plant seconds."""

SAME_PLACE: Final = 0.25
"""Greatest difference of a joint between two stops at the same place, rad: 10 to 20 cm at the hand.

A skill that goes to another place beside the first one meets the same obstacle there.
"""

_NOT_STARTED: Final = "not started"


class RepeatedFailures:
    """The failures of one run that chance does not explain, each with the state in which it happened."""

    def __init__(self) -> None:
        self._noted: list[tuple[str, Sequence[float]]] = []

    @property
    def to_checkpoint(self) -> tuple[str, ...]:
        """The failures as JSON texts, in order."""
        return tuple(json.dumps(one) for one in self._noted)

    def restore(self, failures: Iterable[str]) -> None:
        """Restore the failures of an earlier session of the same run.

        Args:
            failures: as `to_checkpoint` returned them.
        """
        self._noted += [(key, place) for key, place in map(json.loads, failures)]

    def count(
        self,
        step: tuple[str, str, Mapping[str, Any]],
        status: StepStatus | None,
        causes: Iterable[Cause],
        state: Mapping[str, Any],
        joints: Sequence[float] = (),
    ) -> int:
        """Note a failure.

        Args:
            step: module, skill and inputs (JSON values).
            status: how the step ended; None if it did not start.
            causes: why.  Only kinds and names count, as measured numbers are never quite the same; of a stop
                at a known place not even these, as an obstacle is felt now as force and now as torque.
            state: predicates as measured before it.
            joints: where it was stopped, rad or m; empty if that is unknown or means nothing.

        Returns:
            Number of times that it happened, this time included.
        """
        ended = _NOT_STARTED if status is None else status.value
        named = [] if joints else sorted({(cause.kind, cause.rule) for cause in causes})
        key = json.dumps([*step, ended, named, dict(state)], sort_keys=True)
        self._noted.append((key, joints))
        return sum(other == key and _is_same_place(place, joints) for other, place in self._noted)


class FinishedPlans:
    """Plans of one run that were carried out to their end without reaching the goal."""

    def __init__(self) -> None:
        self._streaks: dict[str, tuple[str, FinishedStreak]] = {}
        self._least_likely = Fraction(1)

    def begin(self) -> None:
        """Note that a plan is made."""
        self._least_likely = Fraction(1)

    def note_success(self, probability: Fraction) -> None:
        """Note that a step of the present plan has succeeded.

        Args:
            probability: probability that its success has the effects that were measured, in [0, 1].
        """
        self._least_likely = min(self._least_likely, probability)

    def is_useless(self, plan: object, state: Mapping[str, Any]) -> bool:
        """Note that the present plan was carried out.

        Args:
            plan: its body.
            state: predicates as measured after it.

        Returns:
            True if it left the same state more often in a row than chance explains.
        """
        name, here = repr(plan), json.dumps(dict(state), sort_keys=True)
        last, streak = self._streaks.get(name, ("", FinishedStreak()))
        streak = (streak if last == here else FinishedStreak()).with_finish(self._least_likely)
        self._streaks[name] = (here, streak)
        return streak.is_useless

    def forget(self) -> None:
        """Begin anew, as somebody has changed something."""
        self._streaks.clear()


def _is_same_place(one: Sequence[float], other: Sequence[float]) -> bool:
    return len(one) == len(other) and all(abs(a - b) <= SAME_PLACE for a, b in zip(one, other, strict=True))


def is_explained_by_chance(status: StepStatus, causes: Iterable[Cause], site: Site) -> bool:
    """Check if the same step may well end otherwise the next time.

    Args:
        status: how a failed step ended.
        causes: why.
        site: the site.

    Returns:
        False if it was late, if the runtime refused to start it, as code that does not match its certificate,
        or if it was stopped by something else than a person or a silent sensor.
    """
    if status is StepStatus.STOPPED:
        return any(cause.kind == "reading" or is_about_person(cause, site) for cause in causes)
    return status not in (StepStatus.TIMED_OUT, StepStatus.REFUSED)
