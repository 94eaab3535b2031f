"""Saved options of a run that may outlive its process: `--resume` needs only the state folder."""

from __future__ import annotations

import argparse
import json
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from aeros.agent.errors import AgentError
from aeros.agent.identity import lock_folder
from aeros.files import make_folder, replace_durably
from aeros.sim.hosting.remote import RemotePlant
from aeros.spec.migrations.format import FormatVersionError
from aeros.spec.migrations.formats import RUN

_RUN_FILE: Final = "run.json"
_PLANT_EXIT_TIMEOUT_S: Final = 60.0  # s
_NOT_SAVED_OPTIONS: Final = (
    *("command", "from_settings", "resume", "watchdog", "serve_plant", "supervised"),
    *("max_crashes", "crash_window", "heartbeat_timeout"),
)
_REQUIRED_OPTIONS: Final = ("instruction", "state", "out")
"""Options without which no run can go on; others have defaults, also in a file of an older version."""


def save_run_options(arguments: argparse.Namespace) -> None:
    """Save the options of a run in the state folder.

    Args:
        arguments: The parsed options of `aeros run`.

    Raises:
        AgentError: The folder cannot be written.
    """
    asked = {
        name: _encode_option(one) for name, one in vars(arguments).items() if name not in _NOT_SAVED_OPTIONS
    }
    try:
        make_folder(arguments.state, 0o700)
        replace_durably(
            arguments.state / _RUN_FILE, json.dumps({"schema": RUN.schema, **asked}, indent=1).encode()
        )
    except OSError as error:
        raise AgentError(f"`{arguments.state}` cannot be written to: {error.strerror}") from error


def load_run_options(arguments: argparse.Namespace) -> argparse.Namespace:
    """Load the saved options of a run.

    Args:
        arguments: The parsed options of this command; its own ones, such as `--watchdog`, are kept.

    Returns:
        The saved options and this command's own ones.

    Raises:
        AgentError: No run was saved, or the file cannot be read.
    """
    path = arguments.state / _RUN_FILE
    try:
        asked = json.loads(path.read_text("utf-8"))
        RUN.require_current(asked, path)
        restored = {name: _decode_option(one) for name, one in asked.items() if name != "schema"}
    except FileNotFoundError:
        raise AgentError(f"there is nothing to resume in `{arguments.state}`") from None
    except FormatVersionError as error:
        raise AgentError(str(error)) from error
    except (OSError, ValueError, AttributeError, KeyError, TypeError) as error:
        raise AgentError(f"cannot read run options from `{path}`: {error}") from error
    if lacking := [name for name in _REQUIRED_OPTIONS if name not in restored]:
        raise AgentError(
            f"cannot read run options from `{path}`: it has no `{lacking[0]}`; start the task again"
        )
    # A release before signing was the default saved one anchor or none, and no `unsigned`.
    if not isinstance(anchors := restored.get("anchor"), list):
        restored["anchor"] = [] if anchors is None else [anchors]
    restored.setdefault("unsigned", False)
    # A release before `--ecms` could be repeated saved one folder or none.
    if isinstance(modules := restored.get("ecms"), Path):
        restored["ecms"] = [modules]
    own = {name: one for name, one in vars(arguments).items() if name in _NOT_SAVED_OPTIONS}
    return argparse.Namespace(**{**vars(arguments), **restored, **own})


def delete_run_options(state: Path) -> None:
    """Delete the saved options, so that there is no run to resume.

    Args:
        state: The agent's state folder.
    """
    (state / _RUN_FILE).unlink(missing_ok=True)


def end_task(state: Path, plant_at: Path) -> None:
    """Delete the saved options and end the plant's process if it still runs.

    Args:
        state: The agent's state folder.
        plant_at: Socket of the plant's process.
    """
    delete_run_options(state)
    with suppress(OSError):
        end_plant(RemotePlant(plant_at), state)


def end_plant(plant: RemotePlant, state: Path) -> None:
    """Shut down the plant's process and wait for its end, which completes a recording.

    Args:
        plant: Client of the plant.
        state: The agent's state folder.
    """
    plant.shut_down_host()
    with suppress(AgentError), lock_folder(state / "plant", timeout_s=_PLANT_EXIT_TIMEOUT_S):
        pass


def _encode_option(value: Any) -> Any:
    if isinstance(value, list):
        return [_encode_option(one) for one in value]
    return {"path": str(value.absolute())} if isinstance(value, Path) else value


def _decode_option(encoded: Any) -> Any:
    if isinstance(encoded, list):
        return [_decode_option(one) for one in encoded]
    return Path(encoded["path"]) if isinstance(encoded, dict) else encoded
