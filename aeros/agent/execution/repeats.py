"""Failures that repeat: a step that ends the same way again, in the same measured state.

A declared failure is chance, and retries are for it. A stop for a person or for a silent sensor is not the
skill's doing either. But a skill that meets an obstacle, does not arrive in time, or is proposed where it
cannot start will do so again, as long as nothing else is done. So the second time is the last.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

from aeros.agent.execution.waiting import is_about_person
from aeros.runtime.ports import StepStatus
from aeros.spec.model.cause import Cause
from aeros.spec.model.site import Site

_NOT_STARTED = "not started"


class RepeatedFailures:
    """The failures of one run that chance does not explain, each with the state in which it happened."""

    def __init__(self) -> None:
        self._seen: dict[str, None] = {}

    @property
    def to_checkpoint(self) -> tuple[str, ...]:
        """The failures as JSON texts, in order."""
        return tuple(self._seen)

    def restore(self, failures: Iterable[str]) -> None:
        """Restore the failures of an earlier session of the same run.

        Args:
            failures: as `to_checkpoint` returned them.
        """
        self._seen.update(dict.fromkeys(failures))

    def has_repeated(
        self,
        step: tuple[str, str, Mapping[str, Any]],
        status: StepStatus | None,
        causes: Iterable[Cause],
        state: Mapping[str, Any],
    ) -> bool:
        """Note a failure.

        Args:
            step: module, skill and inputs (JSON values).
            status: how the step ended; None if it did not start.
            causes: why; only their kinds and names count, as measured values are never quite the same.
            state: predicates as measured before it.

        Returns:
            True if it was noted before.
        """
        ended = _NOT_STARTED if status is None else status.value
        named = sorted({(cause.kind, cause.rule) for cause in causes})
        key = json.dumps([*step, ended, named, dict(state)], sort_keys=True)
        again = key in self._seen
        self._seen[key] = None
        return again


def is_explained_by_chance(status: StepStatus, causes: Iterable[Cause], site: Site) -> bool:
    """Check if the same step may well end otherwise the next time.

    Args:
        status: how a failed step ended.
        causes: why.
        site: the site.

    Returns:
        False if it was late, or if it was stopped by something else than a person or a silent sensor.
    """
    if status is StepStatus.STOPPED:
        return any(cause.kind == "reading" or is_about_person(cause, site) for cause in causes)
    return status is not StepStatus.TIMED_OUT
