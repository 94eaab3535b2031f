"""Store of finished trials: one line of JSON each, appended whole, and read again after any interruption.

Lines reach the operating system in one write as soon as their trials are finished, so no end of this process
loses them; a power cut may take the last second.  A torn last line is left out, and cut off before anything
is appended.

A worker that sees the folder keeps finished trials in a spill file until the store has taken all of them, or
until they are handed over.  The next process that opens the folder takes in what a kill has left there.
"""

from __future__ import annotations

import fcntl
import json
import os
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Final, NamedTuple, Self

from aeros.experiments.trial_kinds import Findings
from aeros.files import make_folder
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import MisuseError, UserError
from aeros.spec.migrations.format import FormatVersionError
from aeros.spec.migrations.formats import TRIALS

TRIALS_FILE: Final = "trials.jsonl"

_SPILL_PREFIX: Final = "finished-"

_APPEND: Final = os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC

_SYNC_EVERY: Final = 1.0  # s


class StoredTrial(NamedTuple):
    """A finished trial.

    Attributes:
        condition: digest of its condition.
        seed: seed of its random numbers.
        findings: measured values of the trial.
    """

    condition: str
    seed: int
    findings: Findings


class SpillFile:
    """File of trials that a worker has finished and that are not stored yet.

    Args:
        path: the file; where its folder does not exist, as on another machine, nothing is kept.
    """

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, _APPEND, 0o644) if path.parent.is_dir() else None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None:
            os.close(self._file)

    def append(self, one: StoredTrial) -> None:
        """Append a trial.

        Args:
            one: a finished trial.

        Raises:
            OSError: the file cannot be written.
        """
        if self._file is not None:
            _write(self._file, _line(one))


class TrialStore:
    """Trials of one folder, which one process at a time writes.

    Args:
        folder: made where it does not exist.

    Attributes:
        trials: findings by digest of the condition and seed.

    Raises:
        MisuseError: another process writes the folder, or it cannot be written.
        UserError: a line is not a finished trial.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / TRIALS_FILE
        try:
            make_folder(folder)
            self._file = os.open(self._path, _APPEND, 0o644)
        except OSError as error:
            raise MisuseError(f"cannot write to `{folder}`: {error.strerror}") from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(self._file)
            raise MisuseError(f"`{self._path}` is being written by another run") from error
        self._synced = time.monotonic()
        try:
            self.trials: dict[tuple[str, int], Findings] = dict(self._read())
            for path in sorted(folder.glob(f"{_SPILL_PREFIX}*.jsonl")):
                self.merge_spill(path)
        except BaseException:
            os.close(self._file)
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        os.fsync(self._file)
        os.close(self._file)

    def spill_path(self, number: int) -> Path:
        """Name the spill file of a chunk.

        Args:
            number: of the chunk.

        Returns:
            An absolute path in the folder.
        """
        return self._path.parent.resolve() / f"{_SPILL_PREFIX}{number}.jsonl"

    def merge_spill(self, aside: Path) -> int:
        """Store the trials of a spill file, and delete it.

        Args:
            aside: the spill file.

        Returns:
            The number of trials in it.

        Raises:
            OSError: a file cannot be read or written.
            UserError: a line is not a finished trial.
        """
        found = list(_read_trials(aside, _complete_lines(aside.read_bytes())))
        self.append([one for one in found if (one.condition, one.seed) not in self.trials], aside)
        return len(found)

    def append(self, trials: Iterable[StoredTrial], aside: Path | None = None) -> None:
        """Store trials.

        Args:
            trials: finished trials.
            aside: a spill file to delete afterwards, if there is one.

        Raises:
            OSError: the file cannot be written.
        """
        made = list(trials)
        _write(self._file, "".join(map(_line, made)))
        self.trials.update({(one.condition, one.seed): one.findings for one in made})
        if aside is not None:
            aside.unlink(missing_ok=True)
        if time.monotonic() - self._synced > _SYNC_EVERY:
            os.fsync(self._file)
            self._synced = time.monotonic()

    def _read(self) -> Iterable[tuple[tuple[str, int], Mapping[str, Any]]]:
        content = self._path.read_bytes()
        whole = _complete_lines(content)
        if len(whole) < len(content):
            os.ftruncate(self._file, len(whole))
        for one in _read_trials(self._path, whole):
            yield (one.condition, one.seed), one.findings


def _line(one: StoredTrial) -> str:
    return (
        json.dumps(
            {"schema": TRIALS.schema, "condition": one.condition, "seed": one.seed, "found": one.findings},
            sort_keys=True,
            separators=(",", ":"),
        )
        + "\n"
    )


def _write(file: int, text: str) -> None:
    content = text.encode()
    while content:
        content = content[os.write(file, content) :]


def _complete_lines(content: bytes) -> bytes:
    """Return the content without a torn last line."""
    return content[: content.rfind(b"\n") + 1]


def _trial_from_json(condition: str, seed: int, found: Findings) -> StoredTrial:
    """Take a trial by the names that trial files have."""
    return StoredTrial(condition, seed, found)


def _read_trials(path: Path, whole: bytes) -> Iterator[StoredTrial]:
    for number, line in enumerate(whole.splitlines(), 1):
        try:
            kept = json.loads(line)
            TRIALS.require_current(kept, path)
            yield _trial_from_json(**{key: value for key, value in kept.items() if key != "schema"})
        except FormatVersionError as error:
            raise UserError([Diagnostic("AE114", f"line {number}: {error}")]) from error
        except (AttributeError, ValueError, TypeError) as error:
            headline = f"`{path}`, line {number}, is not a finished trial: {error}"
            help_ = ("give another folder with --out",)
            raise UserError([Diagnostic("AE002", headline, help=help_)]) from error
