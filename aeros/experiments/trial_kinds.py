"""Kinds of trials: a module for each, imported only when it is used."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import cache
from pathlib import Path
from typing import Any, Final, Protocol, runtime_checkable

from aeros.experiments.condition import TrialCondition
from aeros.experiments.inputs import TrialInputs, digest_of_files
from aeros.files import temporary_folder
from aeros.runtime.audit.log import AuditLog
from aeros.spec.model.policy import Durability

Findings = Mapping[str, Any]
"""Findings of one trial: JSON values by name.

`reached` (whether it succeeded) and `processor_s` are among them; `NONDETERMINISTIC_FIELDS` may differ
between runs.
"""

Trial = Callable[[int], Findings]
"""Runs the trial of a seed."""

SCRATCH_ROOT: Final = next((one for one in (Path("/dev/shm"),) if one.is_dir()), None)  # noqa: S108  temporary files
"""Folder for temporary files of trials, in memory; None for the default folder."""

TIMING_FIELDS: Final = ("processor_s", "alone_s", "swap_s", "reaction_s")
"""Findings that are times, which differ between runs."""

NONDETERMINISTIC_FIELDS: Final = ("live", *TIMING_FIELDS)
"""Findings that may differ between runs: times, and whether a plant of its own was needed."""

EQUIVALENT_INTERVAL: Final = "alike"
"""Finding with the interval in which the trial would have found the same."""

PREDICTED_FIELDS: Final = ("success", "invocations", "retries", "recoveries", "replans")
"""Names of the values that are computed for a condition."""

ATTEMPT_FIELD: Final = "attempt"
"""Name of the expected share of attempts that fail: the rate."""

INDEPENDENT_PREFIX: Final = "independent_"
"""Prefix of values that would be exact if attempts were independent, where they are not."""


class TrialKind(Protocol):
    """Protocol of a kind of trials, which its module has as `KIND`."""

    def open(self, condition: TrialCondition, premises: TrialInputs) -> AbstractContextManager[Trial]:
        """Set up what trials of many seeds share, and take it down after them.

        Args:
            condition: kind, plant and settings of the trials.
            premises: proved modules, site and compiled gate.

        Yields:
            The function that runs the trial of a seed.
        """

    def expected_values(self, condition: TrialCondition, premises: TrialInputs) -> Mapping[str, float] | str:
        """Compute the values that are exactly expected of a condition.

        Args:
            condition: kind, plant and settings of the trials.
            premises: proved modules, site and compiled gate.

        Returns:
            The expected values by name, or the reason in words why there are none.
        """


@runtime_checkable
class SharesTrials(Protocol):
    """Protocol of kinds whose conditions can share trials."""

    def comparison_group(self, condition: TrialCondition) -> tuple[str, float]:
        """Name the family of a condition, and the number in which it differs from others of that family.

        The findings of a trial may have `alike`, two numbers between which the trial would have found the
        same: then it is not run again for others of its family.

        Args:
            condition: kind, plant and settings of the trials.

        Returns:
            The family's name, and the number.
        """

    def scheduling_group(self, condition: TrialCondition) -> str:
        """Name the group of families that are best run one after the other, seed by seed.

        Args:
            condition: kind, plant and settings of the trials.

        Returns:
            The group's name, the same for all conditions of a family.
        """


@runtime_checkable
class PredictsSeries(Protocol):
    """Protocol of kinds whose trials have a `series`: lists of numbers by name, as one a session."""

    def expected_series(self, condition: TrialCondition) -> Mapping[str, Sequence[float]]:
        """Compute the series that are exactly expected of a condition.

        Args:
            condition: kind, plant and settings of the trials.

        Returns:
            The expected series by name; only those that can be computed.
        """


KINDS: Final[Mapping[str, tuple[str, ...]]] = {
    "adversaries": ("adversaries", "inline_module", "referee"),
    "hot_swap": ("hot_swap", "task"),
    "kills": ("kills", "kill_logs"),
    "reaction": ("reaction", "truth"),
    "requests": ("requests",),
    "scale": ("scale", "synthetic"),
    "sessions": ("sessions", "inline_module", "thompson"),
    "sensors": ("sensors", "truth"),
    "task": ("task",),
}
"""By kind, the module of `trials/` that has a `KIND`, and others that it needs."""

KINDS_RUNNING_CLI: Final = frozenset(("kills",))
"""Kinds whose trials run commands of `aeros`, whose code then decides findings too."""


def kind_of(name: str) -> TrialKind:
    """Import a kind of trials.

    Args:
        name: a key of `KINDS`.

    Returns:
        The kind, `KIND` of its module.
    """
    kind: TrialKind = importlib.import_module(f"aeros.experiments.trials.{KINDS[name][0]}").KIND
    return kind


@cache
def comparison_group_of(condition: TrialCondition) -> tuple[str, float]:
    """Name the family of a condition, as `SharesTrials.comparison_group` does.

    Args:
        condition: kind, plant and settings of the trials.

    Returns:
        The family's name and the number; a condition of any other kind is a family of its own.
    """
    kind = kind_of(condition.kind)
    return (
        kind.comparison_group(condition)
        if isinstance(kind, SharesTrials)
        else (condition.canonical_json, 0.0)
    )


def scheduling_group_of(condition: TrialCondition) -> str:
    """Name the group of a condition, as `SharesTrials.scheduling_group` does.

    Args:
        condition: kind, plant and settings of the trials.

    Returns:
        The group's name; a condition of any other kind is a group of its own.
    """
    kind = kind_of(condition.kind)
    return kind.scheduling_group(condition) if isinstance(kind, SharesTrials) else condition.canonical_json


@contextmanager
def scratch_folder() -> Iterator[tuple[Path, AuditLog]]:
    """Make a temporary folder with an audit log in it; both are deleted afterwards.

    Yields:
        The folder, and the open log.
    """
    with (
        temporary_folder(SCRATCH_ROOT) as folder,
        AuditLog(folder / "audit.jsonl", durability=Durability.BATCHED) as audit,
    ):
        yield folder, audit


def condition_digest(condition: TrialCondition, premises: str) -> str:
    """Name everything that decides the trials of a condition, except their seed.

    Args:
        condition: kind, plant and settings of the trials.
        premises: digest of what the trials stand on (`TrialInputs.digest`).

    Returns:
        A digest in hexadecimal digits.
    """
    return condition.digest(f"{premises} {_source_digest(condition.kind)}")


@cache
def _source_digest(name: str) -> str:
    """Digest the code of a kind; the code that all kinds share is among the premises."""
    folder = Path(__file__).parent / "trials"
    files = {one: folder / f"{one}.py" for one in KINDS[name]}
    if name in KINDS_RUNNING_CLI:
        root = folder.parent.parent
        files |= {
            str(one.relative_to(root)): one
            for part in ("cli", "apps", "session")
            for one in (root / part).rglob("*.py")
        }
    return digest_of_files(files)
