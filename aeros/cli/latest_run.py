"""The run that a command is about: the named one, the newest, or the latest of an agent's folder."""

from __future__ import annotations

import argparse
import json
import os
import sys
from contextlib import suppress
from math import isfinite
from pathlib import Path
from typing import Final

from aeros.cli.arguments import existing_path
from aeros.exit_codes import UsageError
from aeros.files import open_regular, replace_durably
from aeros.spec.migrations.format import FormatVersionError
from aeros.spec.migrations.formats import LATEST_RUN

_FILE: Final = "latest-run.json"
_AUDIT: Final = "audit.jsonl"
_LONGEST_RECORD: Final = 1 << 16  # bytes; the first record of a log has some 200 for each module


def add_run_argument(parser: argparse.ArgumentParser, name: str) -> None:
    """Add the argument that names a run, by its folder or its audit log, and may be left out.

    Args:
        parser: the parser of a command.
        name: where the value is kept.
    """
    parser.add_argument(
        name,
        nargs="?",
        type=existing_path,
        metavar="FOLDER|LOG",
        help="a run's output folder or audit log (default: the newest in `runs`)",
    )


def find_audit_log(given: Path | None) -> Path:
    """Find the audit log of a run; standard error names the run if none is given.

    It also names the run that `.aeros` records as the latest, if that is another one: its output may be
    elsewhere, or its log gone.

    Args:
        given: output folder or audit log; None for the newest run in `runs`.

    Returns:
        Path of the log.

    Raises:
        UsageError: none is given, and there is no run in `runs`, or the folder has no audit log.
    """
    if given is not None:
        log = given / _AUDIT if given.is_dir() else given
        if not log.exists():
            raise UsageError(
                f"there is no {_AUDIT} in `{given}`: give the output folder that `aeros run` printed"
            )
        return log
    found = sorted(Path("runs").glob(f"*/{_AUDIT}"), key=_begin_of)
    if not found:
        raise UsageError("there is no run in `runs`: give the output folder that `aeros run` printed")
    print(f"newest run: {found[-1].parent}", file=sys.stderr)
    with suppress(UsageError):
        recorded = latest_run(Path(".aeros"))
        if recorded is not None and recorded[0] != found[-1].parent.resolve():
            print(f"not the latest run of `.aeros`, which is `{recorded[0]}`", file=sys.stderr)
    return found[-1]


def _begin_of(log: Path) -> float:
    """Return when a run began, as its first record says; the time of the file if that says nothing."""
    try:
        with open_regular(log) as file:
            written = json.loads(file.readline(_LONGEST_RECORD))["written"]
        if type(written) in (float, int) and isfinite(written):
            return float(written)
    except (OSError, ValueError, KeyError, TypeError, RecursionError, OverflowError):
        pass
    return log.stat().st_mtime


def find_run_folder(given: Path | None) -> Path:
    """Find the output folder of a run; it need not have an audit log.

    Args:
        given: output folder or audit log; None for the newest run in `runs`.

    Returns:
        The folder.

    Raises:
        UsageError: none is given, and there is no run in `runs`; or the file is no `audit.jsonl`.
    """
    if given is not None and given.is_dir():
        return given
    if given is not None and given.name != _AUDIT:
        raise UsageError(f"`{given}` is no {_AUDIT}: give the output folder that `aeros run` printed")
    return find_audit_log(given).parent


def save_latest_run(state: Path, out: Path) -> None:
    """Record that this process runs and writes to `out`.  Errors are ignored: a run does not need the record.

    Args:
        state: The agent's state folder.
        out: The run's output folder.
    """
    record = {"schema": LATEST_RUN.schema, "out": str(out.resolve()), "pid": os.getpid()}
    with suppress(OSError):
        replace_durably(state / _FILE, json.dumps(record).encode())


def latest_run(state: Path) -> tuple[Path, bool] | None:
    """Read the record of the latest run.

    Args:
        state: The agent's state folder.

    Returns:
        The run's output folder, and whether its process still exists; None if no run is recorded.

    Raises:
        UsageError: The record is of another version of AEROS.
    """
    try:
        with open_regular(state / _FILE) as file:
            record = json.loads(file.read())
        LATEST_RUN.require_current(record, state / _FILE)
        out, process = Path(record["out"]), int(record["pid"])
    except FormatVersionError as error:
        raise UsageError(str(error)) from error
    except (OSError, ValueError, KeyError, TypeError, OverflowError):
        return None
    return out, _is_running(process)


def _is_running(process: int) -> bool:
    if process <= 0:
        return False
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True  # a process of another user
    return True
