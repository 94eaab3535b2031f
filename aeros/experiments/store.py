"""Finished trials, kept: a line of JSON for each, appended whole, and read again after any interruption.

A line is with the operating system as soon as its trials are there, in one write, so no end of this process
loses it; what a power cut may take is the last second.  A last line that is torn is left out, and cut off
before anything is appended.
"""

from __future__ import annotations

import fcntl
import json
import os
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Final, NamedTuple, Self

from aeros.experiments.kinds import Found
from aeros.spec.diagnostics import Diagnostic
from aeros.spec.errors import MisuseError, UserError

FILE: Final = "trials.jsonl"

_SYNC_EVERY: Final = 1.0  # s


class Kept(NamedTuple):
    """A finished trial: its condition's digest, its seed, and what it found."""

    condition: str
    seed: int
    found: Found


class Store:
    """The trials of one folder; one process at a time writes them.

    Raises `MisuseError` where another does, or none can; `UserError` where a line is none of ours.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / FILE
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise MisuseError(f"cannot write to `{folder}`: {error.strerror}") from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(self._file)
            raise MisuseError(f"`{self._path}` is being written by another run") from error
        self._synced = time.monotonic()
        try:
            self.trials: dict[tuple[str, int], Found] = dict(self._read())
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

    def keep(self, trials: Iterable[Kept]) -> None:
        """Append these; raises `OSError`."""
        made = list(trials)
        lines = (json.dumps(one._asdict(), sort_keys=True, separators=(",", ":")) + "\n" for one in made)
        content = "".join(lines).encode()
        while content:
            content = content[os.write(self._file, content) :]
        self.trials.update({(one.condition, one.seed): one.found for one in made})
        if time.monotonic() - self._synced > _SYNC_EVERY:
            os.fsync(self._file)
            self._synced = time.monotonic()

    def _read(self) -> Iterable[tuple[tuple[str, int], Mapping[str, Any]]]:
        content = self._path.read_bytes()
        whole = content[: content.rfind(b"\n") + 1]
        if len(whole) < len(content):
            os.ftruncate(self._file, len(whole))
        for number, line in enumerate(whole.splitlines(), 1):
            try:
                one = Kept(**json.loads(line))
                yield (one.condition, one.seed), one.found
            except (ValueError, TypeError) as error:
                headline = f"`{self._path}`, line {number}, is no finished trial: {error}"
                help_ = ("give another folder with --out",)
                raise UserError([Diagnostic("AE002", headline, help=help_)]) from error
