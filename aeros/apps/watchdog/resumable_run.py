"""What was asked of a run that may outlive its process: `--resume` needs the state folder alone."""

from __future__ import annotations

import argparse
import json
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from aeros.agent.errors import RefusedError
from aeros.agent.identity import exclusive
from aeros.files import replace_file
from aeros.sim.hosting.remote import RemotePlant
from aeros.spec.migrations.format import FormatVersionError
from aeros.spec.migrations.formats import RUN

_FILE: Final = "run.json"
_PATIENCE: Final = 60.0  # s
_OF_THIS_COMMAND: Final = (
    *("command", "resume", "watchdog", "serve_plant", "supervised"),
    *("crashes", "within", "silence"),
)


def keep(arguments: argparse.Namespace) -> None:
    """Keep what was asked for in the state folder; raises `RefusedError`."""
    asked = {name: _told(one) for name, one in vars(arguments).items() if name not in _OF_THIS_COMMAND}
    try:
        arguments.state.mkdir(mode=0o700, parents=True, exist_ok=True)
        replace_file(arguments.state / _FILE, json.dumps({"schema": RUN.schema, **asked}, indent=1).encode())
    except OSError as error:
        raise RefusedError(f"`{arguments.state}` cannot be written to: {error.strerror}") from error


def restore(arguments: argparse.Namespace) -> argparse.Namespace:
    """What was asked for, with this command's own options; raises `RefusedError` where nothing was."""
    path = arguments.state / _FILE
    try:
        asked = json.loads(path.read_text("utf-8"))
        RUN.require_current(asked, path)
        restored = {name: _understood(one) for name, one in asked.items() if name != "schema"}
    except FileNotFoundError:
        raise RefusedError(f"there is nothing to resume in `{arguments.state}`") from None
    except FormatVersionError as error:
        raise RefusedError(str(error)) from error
    except (OSError, ValueError, AttributeError, KeyError, TypeError) as error:
        raise RefusedError(f"what was asked for cannot be read from `{path}`: {error}") from error
    own = {name: one for name, one in vars(arguments).items() if name in _OF_THIS_COMMAND}
    return argparse.Namespace(**restored, **own)


def forget(state: Path) -> None:
    """Nothing is left to resume."""
    (state / _FILE).unlink(missing_ok=True)


def end_task(state: Path, plant_at: Path) -> None:
    """Nothing is left to resume, and its plant, if it is there still, ends, too."""
    forget(state)
    with suppress(OSError):
        end_plant(RemotePlant(plant_at), state)


def end_plant(plant: RemotePlant, state: Path) -> None:
    """Let it end, and wait for that: a film is there only then."""
    plant.end()
    with suppress(RefusedError), exclusive(state / "plant", patience=_PATIENCE):
        pass


def _told(value: Any) -> Any:
    return {"path": str(value.absolute())} if isinstance(value, Path) else value


def _understood(told: Any) -> Any:
    return Path(told["path"]) if isinstance(told, dict) else told
