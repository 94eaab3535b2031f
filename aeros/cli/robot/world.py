"""`aeros world`: show what the agent last saw of the world, with its age, and where things usually are."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from aeros.agent.agent import MEMORY_FILE
from aeros.agent.errors import AgentError
from aeros.agent.memory.queries import open_memory_reader
from aeros.agent.memory.sightings import RememberedValue
from aeros.cli.arguments import add_command
from aeros.exit_codes import Exit
from aeros.session.plant_factory import PLANTS
from aeros.spec.diagnostics.render import escape_invisible

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

SCHEMA: Final = "aeros/world/1"

_EXAMPLES: Final = """\
The agent writes what it measures after each step, with the sensor or module that measured it, and the
declared bound of the uncertainty.  Values are in SI units.  They are memories: a value that is not
measured now is unknown to every condition, however new it is here.

examples:
  aeros world                              everything that the latest session's plant showed
  aeros world object --plant physics       variables with `object` in their names
  aeros memory forget --variable fetch_object.object_seen --yes
"""

_AGES: Final = ((86400.0, "d"), (3600.0, "h"), (60.0, "min"), (1.0, "s"))


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "world", __doc__, _EXAMPLES)
    parser.add_argument("text", nargs="?", default="", help="only variables whose names contain this")
    parser.add_argument("--plant", choices=PLANTS, help="seen on this plant (default: the latest session's)")
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the agent's own folder (default: .aeros)"
    )
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    try:
        with open_memory_reader(arguments.state / MEMORY_FILE) as memory:
            every = memory.remembered_values(arguments.plant)
    except AgentError as refusal:
        print(f"aeros: {refusal}", file=sys.stderr)
        return Exit.REJECTED
    found = [one for one in every if arguments.text in one.variable]
    now = datetime.now(UTC)
    if arguments.format == "json":
        data = {"schema": SCHEMA, "variables": [{**asdict(one), "age_s": one.age(now)} for one in found]}
        print(json.dumps(data, indent=1))
    else:
        print("\n".join(map(escape_invisible, _lines(found, now))) or "nothing was seen")
    return Exit.SUCCESS


def _lines(found: Sequence[RememberedValue], now: datetime) -> Iterator[str]:
    width = max((len(one.variable) for one in found), default=0)
    for one in found:
        parts = [f"{_value_text(one.value)}, {_age_text(one.age(now))} ago in session {one.session}"]
        if one.source is not None:
            parts.append(f"by {one.source}")
        if one.uncertainty is not None:
            parts.append(f"± {one.uncertainty:g} at most")
        if one.sessions > 1:
            usual = f"at first {_value_text(one.usual)}" if one.usual != one.value else "at first the same"
            parts.append(f"{usual} in {one.usual_sessions} of {one.sessions} sessions")
        yield f"{one.variable:<{width}}  {', '.join(parts)}"


def _value_text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.4g}"
    return f"({', '.join(map(_value_text, value))})" if isinstance(value, list) else str(value)


def _age_text(seconds: float) -> str:
    for size, unit in _AGES:
        if seconds >= size:
            return f"{seconds / size:.0f} {unit}"
    return "0 s"
