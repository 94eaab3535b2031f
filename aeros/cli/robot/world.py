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
from aeros.agent.memory.things import THING, RememberedThing, remembered_things
from aeros.cli.arguments import add_command
from aeros.cli.terminal.rendering import print_table
from aeros.cli.terminal.streams import print_data
from aeros.exit_codes import Exit
from aeros.spec.expr.shortfall import format_value
from aeros.spec.model.task_parameters import is_instruction

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

SCHEMA: Final = "aeros/world/1"

_EXAMPLES: Final = """\
The agent writes what it measures after each step, with the sensor or module that measured it, and the
declared bound of the uncertainty.  Values are in SI units.  They are memories: a value that is not
measured now is unknown to every condition, however new it is here.  Things come first: the kind, the place,
and what it is on or in, as the modules declare it.

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
    parser.add_argument("text", nargs="?", default="", help="only names that contain this")
    parser.add_argument("--plant", metavar="NAME", help="seen on this plant (default: the latest session's)")
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
    things = remembered_things(found)
    variables = [one for one in found if not one.variable.startswith(THING)]
    now = datetime.now(UTC)
    if arguments.format == "json":
        data = {
            "schema": SCHEMA,
            "things": [_thing_to_json(one, now) for one in things],
            "variables": [{**asdict(one), "age_s": one.age(now)} for one in variables],
        }
        print_data(json.dumps(data, indent=1))
        return Exit.SUCCESS
    print_table(_thing_rows(things, now))
    if things and variables:
        print()
    print_table(_rows(variables, now))
    if not found:
        print("nothing was seen")
    return Exit.SUCCESS


def _thing_to_json(thing: RememberedThing, now: datetime) -> dict[str, Any]:
    attributes = {name: {**asdict(one), "age_s": one.age(now)} for name, one in thing.attributes.items()}
    return {"name": thing.name, "kind": thing.kind, "attributes": attributes}


def _thing_rows(things: Sequence[RememberedThing], now: datetime) -> Iterator[tuple[str, str]]:
    """Say of each thing what was last seen, newest first; what was seen together has one age."""
    for thing in things:
        by_age: dict[str, list[str]] = {}
        for name, one in sorted(thing.attributes.items(), key=_newest_position_first):
            when = f"{_age_text(one.age(now))} ago in session {one.session}"
            by_age.setdefault(when, []).append(_attribute_text(name, one))
        seen = [f"{', '.join(texts)}, {when}" for when, texts in by_age.items()]
        yield thing.name, f"{thing.kind}: {'; '.join(seen)}"


def _newest_position_first(item: tuple[str, RememberedValue]) -> tuple[float, bool, str]:
    name, one = item
    return -datetime.fromisoformat(one.seen).timestamp(), name != "position", name


def _attribute_text(name: str, one: RememberedValue) -> str:
    if name == "count":
        return f"{one.value:g} of them"
    if name != "position":
        return name if one.value else f"not {name}"
    text = f"at {format_value(one.value, digits=4)} m"
    if one.uncertainty is not None:
        text += f" ± {one.uncertainty:g} m"
    return text + (f" (at first {_usual_text(one)})" if one.sessions > 1 else "")


def _usual_text(one: RememberedValue) -> str:
    usual = format_value(one.usual, digits=4) if one.usual != one.value else "the same"
    return f"{usual} in {one.usual_sessions} of {one.sessions} sessions"


def _rows(found: Sequence[RememberedValue], now: datetime) -> Iterator[tuple[str, str]]:
    for one in found:
        value = format_value(one.value, digits=4)
        parts = [f"{value}, {_age_text(one.age(now))} ago in session {one.session}"]
        if one.source is not None:
            parts.append("said by the instruction" if is_instruction(one.source) else f"by {one.source}")
        if one.uncertainty is not None:
            parts.append(f"± {one.uncertainty:g} at most")
        if one.sessions > 1:
            parts.append(f"at first {_usual_text(one)}")
        yield one.variable, ", ".join(parts)


def _age_text(seconds: float) -> str:
    for size, unit in _AGES:
        if seconds >= size:
            return f"{seconds / size:.0f} {unit}"
    return "0 s"
