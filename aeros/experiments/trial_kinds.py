"""Kinds of trials: a module for each, imported only where it is tried."""

from __future__ import annotations

import importlib
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import cache
from pathlib import Path
from typing import Any, Final, Protocol, runtime_checkable

from aeros.experiments.condition import TrialCondition
from aeros.experiments.inputs import TrialInputs, digest_of_files
from aeros.runtime.audit.log import AuditLog
from aeros.spec.model.model import Durability

Findings = Mapping[str, Any]
"""What one trial found: JSON values by name.

`reached` (whether it succeeded) and `processor_s` are among them; `NONDETERMINISTIC_FIELDS` may differ from
time to time.
"""

Trial = Callable[[int], Findings]
"""Runs the trial of a seed."""

SCRATCH_ROOT: Final = next((one for one in (Path("/dev/shm"),) if one.is_dir()), None)  # noqa: S108  kept by nobody
"""Where trials keep what nobody keeps; None for wherever temporary files are."""

TIMING_FIELDS: Final = ("processor_s", "alone_s", "swap_s", "reaction_s")
"""What takes another time whenever it is found."""

NONDETERMINISTIC_FIELDS: Final = ("live", *TIMING_FIELDS)
"""What may be found otherwise from one time to the next: times, and whether a plant of its own was needed."""

EQUIVALENT_INTERVAL: Final = "alike"
"""Where a trial says so."""

PREDICTED_FIELDS: Final = ("success", "invocations", "retries", "recoveries", "replans")
"""What is computed of a condition."""

ATTEMPT_FIELD: Final = "attempt"
"""What is computed of how many attempts fail: the rate."""

INDEPENDENT_PREFIX: Final = "independent_"
"""Before the name of what would be exact if attempts were independent of each other, where they are not."""


class TrialKind(Protocol):
    """What a module of trials has."""

    def open(self, condition: TrialCondition, premises: TrialInputs) -> AbstractContextManager[Trial]:
        """What is set up once for trials of many seeds, and taken down after them."""

    def expected_values(self, condition: TrialCondition, premises: TrialInputs) -> Mapping[str, float] | str:
        """What is exactly to be expected, by name; in words why that is not to be had."""


@runtime_checkable
class SharesTrials(Protocol):
    """A kind whose trials have things in common."""

    def comparison_group(self, condition: TrialCondition) -> tuple[str, float]:
        """Conditions of one family differ in that number alone.

        What a trial found may have `alike`, two numbers between which it would have found the same: then it
        is not tried again for others of its family.
        """

    def scheduling_group(self, condition: TrialCondition) -> str:
        """Whole families of the same company are best tried one after the other, seed by seed."""


@runtime_checkable
class PredictsSeries(Protocol):
    """A kind whose trials have a `series`: by name, a number for each session, say."""

    def expected_series(self, condition: TrialCondition) -> Mapping[str, Sequence[float]]:
        """What is exactly to be expected of series, by name, as far as that is to be had."""


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
"""By kind, the module of `trials/` that has a `KIND`, and others that it stands on."""

KINDS_RUNNING_CLI: Final = frozenset(("kills",))
"""Kinds whose trials run the commands of `aeros`, so that their code decides, too."""


def kind_of(name: str) -> TrialKind:
    """The kind of that name."""
    kind: TrialKind = importlib.import_module(f"aeros.experiments.trials.{KINDS[name][0]}").KIND
    return kind


@cache
def comparison_group_of(condition: TrialCondition) -> tuple[str, float]:
    """See `SharesTrials`; else each condition is one of its own."""
    kind = kind_of(condition.kind)
    return (
        kind.comparison_group(condition)
        if isinstance(kind, SharesTrials)
        else (condition.canonical_json, 0.0)
    )


def scheduling_group_of(condition: TrialCondition) -> str:
    """See `SharesTrials`; else each condition is one of its own."""
    kind = kind_of(condition.kind)
    return kind.scheduling_group(condition) if isinstance(kind, SharesTrials) else condition.canonical_json


@contextmanager
def scratch_folder() -> Iterator[tuple[Path, AuditLog]]:
    """A folder, and an audit log in it, for trials: of neither anything is kept."""
    with (
        tempfile.TemporaryDirectory(dir=SCRATCH_ROOT) as folder,
        AuditLog(Path(folder) / "audit.jsonl", durability=Durability.BATCHED) as audit,
    ):
        yield Path(folder), audit


def condition_digest(condition: TrialCondition, premises: str) -> str:
    """Names what decides the trials of `condition` but for their seed, on premises of that digest."""
    return condition.digest(f"{premises} {_source_digest(condition.kind)}")


@cache
def _source_digest(name: str) -> str:
    """Of the code of a kind; what all kinds share is among the premises."""
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
