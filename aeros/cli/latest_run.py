"""Record of the latest run from an agent's folder: its output folder and process, for `aeros top`."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from pathlib import Path
from typing import Final

from aeros.exit_codes import UsageError
from aeros.files import replace_durably
from aeros.spec.migrations.format import FormatVersionError
from aeros.spec.migrations.formats import LATEST_RUN

_FILE: Final = "latest-run.json"


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
        record = json.loads((state / _FILE).read_text("utf-8"))
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
