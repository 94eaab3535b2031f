"""Which folder the latest run from an agent's folder writes to, for whoever looks on meanwhile."""

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
    """Say that a run of this process writes to `out`; no run fails for want of somebody who looks on."""
    said = {"schema": LATEST_RUN.schema, "out": str(out.resolve()), "pid": os.getpid()}
    with suppress(OSError):
        replace_durably(state / _FILE, json.dumps(said).encode())


def latest_run(state: Path) -> tuple[Path, bool] | None:
    """Its folder, and whether its process is still there; None where nothing was run, or nobody said so."""
    try:
        said = json.loads((state / _FILE).read_text("utf-8"))
        LATEST_RUN.require_current(said, state / _FILE)
        out, process = Path(said["out"]), int(said["pid"])
    except FormatVersionError as error:
        raise UsageError(str(error)) from error
    except (OSError, ValueError, KeyError, TypeError):
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
        return True  # somebody else's
    return True
