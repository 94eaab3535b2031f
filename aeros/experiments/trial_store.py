"""Finished trials, kept: a line of JSON for each, appended whole, and read again after any interruption.

A line is with the operating system as soon as its trials are there, in one write, so no end of this process
loses it; what a power cut may take is the last second.  A last line that is torn is left out, and cut off
before anything is appended.

A worker that sees the folder keeps what it finishes in a file aside until all of it is taken from there, or
handed over; who opens the folder next takes in what a kill has left there.
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
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import MisuseError, UserError
from aeros.spec.migrations.format import FormatVersionError
from aeros.spec.migrations.formats import TRIALS

TRIALS_FILE: Final = "trials.jsonl"

_SPILL_PREFIX: Final = "finished-"

_APPEND: Final = os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC

_SYNC_EVERY: Final = 1.0  # s


class StoredTrial(NamedTuple):
    """A finished trial: its condition's digest, its seed, and what it found."""

    condition: str
    seed: int
    findings: Findings


class SpillFile:
    """Trials that a worker has finished and that are not kept yet, in a file whose path it was given.

    Where there is no such folder, as on another machine, nothing is kept.
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
        """Append it; raises `OSError`."""
        if self._file is not None:
            _write(self._file, _line(one))


class TrialStore:
    """The trials of one folder; one process at a time writes them.

    Raises `MisuseError` where another does, or none can; `UserError` where a line is none of ours.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / TRIALS_FILE
        try:
            folder.mkdir(parents=True, exist_ok=True)
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
        """The file for what a worker finishes of the chunk with that number."""
        return self._path.parent.resolve() / f"{_SPILL_PREFIX}{number}.jsonl"

    def merge_spill(self, aside: Path) -> int:
        """Append what a worker has kept there, of which nothing is needed there any more; how much it was.

        Raises `OSError`; `UserError` where a line is none of ours.
        """
        found = list(_read_trials(aside, _complete_lines(aside.read_bytes())))
        self.append([one for one in found if (one.condition, one.seed) not in self.trials], aside)
        return len(found)

    def append(self, trials: Iterable[StoredTrial], aside: Path | None = None) -> None:
        """Append these, of which none is needed `aside` any more; raises `OSError`."""
        made = list(trials)
        _write(self._file, "".join(map(_line, made)))
        self.trials.update({(one.condition, one.seed): one.findings for one in made})
        if aside is not None:
            aside.unlink(missing_ok=True)
        if time.monotonic() - self._synced > _SYNC_EVERY:
            os.fsync(self._file)
            self._synced = time.monotonic()

    # Inside.

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
    """The lines that are not torn."""
    return content[: content.rfind(b"\n") + 1]


def _read_trials(path: Path, whole: bytes) -> Iterator[StoredTrial]:
    for number, line in enumerate(whole.splitlines(), 1):
        try:
            kept = json.loads(line)
            TRIALS.require_current(kept, path)
            condition, seed, findings = (kept.pop(key, None) for key in ("condition", "seed", "found"))
            if condition is None or seed is None or findings is None or kept.keys() - {"schema"}:
                raise ValueError("it is no trial")
            yield StoredTrial(condition, seed, findings)
        except FormatVersionError as error:
            raise UserError([Diagnostic("AE114", f"line {number}: {error}")]) from error
        except (AttributeError, ValueError, TypeError) as error:
            headline = f"`{path}`, line {number}, is no finished trial: {error}"
            help_ = ("give another folder with --out",)
            raise UserError([Diagnostic("AE002", headline, help=help_)]) from error
