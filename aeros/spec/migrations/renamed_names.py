"""Old names of events, with their current names; files with old names of events or options are rewritten.

Signed audit logs are never rewritten, so readers of logs pass the name of each event through `current_event`.
No old name has a new meaning: a log that an older program began and this one continued is read correctly.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Final

from aeros.spec.migrations.format import UnmigratableError
from aeros.spec.migrations.renamed_options import RENAMED_OPTIONS

RENAMED_EVENTS: Final[Mapping[str, str]] = {
    "checkpoint-refused": "checkpoint-rejected",
    "connected": "agent-connected",
    "ended": "host-ended",
    "fault": "fault-started",
    "fault-over": "fault-ended",
    "fault-passed": "fault-not-triggered",
    "goal-refused": "goal-rejected",
    "let-go": "agent-disconnected",
    "mcp-executing": "mcp-plan-started",
    "mcp-pause": "mcp-paused",
    "mcp-proposed": "mcp-plan-proposed",
    "mcp-refused": "mcp-call-rejected",
    "mcp-resume": "mcp-resumed",
    "mcp-stop": "mcp-stopped",
    "not-routed": "task-not-found",
    "plan": "plan-accepted",
    "plan-late": "planning-timeout",
    "re-plan": "replan",
    "resumed": "run-resumed",
    "routed": "task-selected",
    "run-had-ended": "run-already-ended",
    "skill-chosen": "provider-selected",
    "step-accounted": "interrupted-step-resolved",
    "step-left-out": "step-skipped",
    "tries-forgone": "retries-skipped",
    "waiting": "wait-started",
}
"""Old name to current name: notes in the audit log, events of the trace, of the memory and of `plant.jsonl`.

The audit log's own records, such as `step-began` and the operator's `resumed`, have kept their names.
"""


def current_event(name: str) -> str:
    """Return the current name of an event.

    Args:
        name: event of a note in an audit log, of a trace, a memory or a `plant.jsonl`, from any version.

    Returns:
        The current name; `name` itself if it was never renamed.
    """
    return RENAMED_EVENTS.get(name, name)


def trace_to_2(text: str) -> str:
    """Give the events of a trace their names of version 2.

    Args:
        text: trace of version 1; lines of version 2 may follow, as a resumed run appends to its trace.

    Returns:
        The trace in version 2.

    Raises:
        UnmigratableError: a line is not an object with the `kind` of an event.
        ValueError: a line is not JSON.
    """
    return _renamed_lines(text, "trace", "kind")


def plant_log_to_2(text: str) -> str:
    """Give the events of a plant's log their names of version 2.

    Args:
        text: log of version 1; lines of version 2 may follow, as a resumed run appends to its log.

    Returns:
        The log in version 2.

    Raises:
        UnmigratableError: a line is not an object with the `event`.
        ValueError: a line is not JSON.
    """
    return _renamed_lines(text, "plant-log", "event")


def _renamed_lines(text: str, format_name: str, key: str) -> str:
    lines = [json.loads(line) for line in text.splitlines()]
    if not all(isinstance(line, dict) and isinstance(line.get(key), str) for line in lines):
        raise UnmigratableError(f"it is damaged: each line is an object with `{key}`")
    schema = f"aeros/{format_name}/2"
    return "".join(
        json.dumps({**line, "schema": schema, key: current_event(line[key])}) + "\n" for line in lines
    )


def run_options_to_2(text: str) -> str:
    """Give the options of a watched run the names that `aeros run` has had since version 2.

    Args:
        text: `run.json` of version 1.

    Returns:
        The file in version 2.

    Raises:
        UnmigratableError: it is not an object.
        ValueError: it is not JSON.
    """
    return _run_options(text, 2)


def run_options_to_3(text: str) -> str:
    """Give the options of a watched run the names that `aeros run` has had since version 3.

    Args:
        text: `run.json` of version 2.

    Returns:
        The file in version 3.

    Raises:
        UnmigratableError: it is not an object.
        ValueError: it is not JSON.
    """
    return _run_options(text, 3)


def _run_options(text: str, version: int) -> str:
    options = json.loads(text)
    if not isinstance(options, dict):
        raise UnmigratableError("it is damaged: the options of a run are an object")
    names = {_attribute(old): _attribute(new) for old, new in RENAMED_OPTIONS["run"].items()}
    renamed = {names.get(name, name): value for name, value in options.items()}
    return json.dumps({**renamed, "schema": f"aeros/run/{version}"}, indent=1)


def _attribute(option: str) -> str:
    return option.removeprefix("--").replace("-", "_")
