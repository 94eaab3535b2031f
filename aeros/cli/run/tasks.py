"""`aeros tasks`: list the tasks that can be asked for, or show how an instruction is understood."""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from aeros.agent.instructions.refusals import InstructionError
from aeros.agent.world.values import to_json_value
from aeros.cli.arguments import add_command, add_module_folders, existing_path, warn_of_withheld_modules
from aeros.cli.module_settings import add_module_settings, module_configurations
from aeros.cli.terminal.rendering import print_table
from aeros.cli.terminal.streams import print_data, print_line
from aeros.exit_codes import Exit
from aeros.runtime.gate.configuration import Configuration
from aeros.session.setup import open_governor, understand_instruction
from aeros.spec.expr.types import IntegerType
from aeros.spec.expr.units import format_number, to_unit
from aeros.spec.model.task_parameters import TaskParameter

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

SCHEMA: Final = "aeros/tasks/1"

_EXAMPLES: Final = """\
Without an instruction: every task of the modules, its goal, and the words that ask for it.  With one: the
formal goals that `aeros run` would pursue, in order, and what is prohibited.  Nothing moves.  The exit code
is 1 if the instruction is not understood; a word that no task declares is named.

examples:
  aeros tasks
  aeros tasks "make dumplings, then clean the table"
  aeros tasks "bring me a beer from the fridge"             refused, with the words that are not known
  aeros tasks --ecms ecms/clean_table --format json
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "tasks", __doc__, _EXAMPLES)
    parser.add_argument("instruction", nargs="?", help="an instruction to be understood, and not run")
    add_module_folders(parser, "the modules (default: as for `aeros run`)")
    add_module_settings(parser)
    parser.add_argument("--site", type=existing_path, help="the site file (default: as for `aeros run`)")
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the agent's own folder (default: .aeros)"
    )
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    parser.add_argument("-v", "--verbose", action="store_true", help="list all words of each task")
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    governor, configuration, _ = open_governor(
        arguments.state,
        arguments.ecms,
        arguments.site,
        configurations=module_configurations(arguments),
    )
    with governor:
        warn_of_withheld_modules(governor)
        if arguments.instruction is None:
            _list_tasks(configuration, arguments.format, is_verbose=arguments.verbose)
            return Exit.SUCCESS
        try:
            meaning = understand_instruction(arguments.instruction, configuration, governor)
        except InstructionError as refusal:
            if arguments.format == "json":
                found = {"schema": SCHEMA, "instruction": arguments.instruction, "reason": refusal.reason}
                print_data(json.dumps({**found, "understood": None, "account": []}, indent=1))
            else:
                print(f"aeros: {refusal}", file=sys.stderr)
            return Exit.REJECTED
    if arguments.format == "json":
        found = {"schema": SCHEMA, "instruction": arguments.instruction, "reason": None}
        read = {"understood": list(meaning.formal_lines), "account": list(meaning.account)}
        print_data(json.dumps({**found, **read}, indent=1))
    else:
        for line in (*meaning.formal_lines, *meaning.account):
            print_line(line)
    return Exit.SUCCESS


def _range_text(parameter: TaskParameter) -> str | None:
    """Return the range of a parameter that is a number, as in `1 to 3`."""
    declared = parameter.declared
    if declared.range is None:
        return None
    low, high = (format_number(to_unit(bound, declared.unit)) for bound in declared.range)
    unit = "" if declared.unit.text == "1" else f" {declared.unit.text}"
    return f"{low} to {high}{unit}"


def _default(parameter: TaskParameter) -> Any:
    """Return the default as JSON (SI); a whole number has no decimals."""
    is_whole = isinstance(parameter.declared.variable.type, IntegerType)
    return int(parameter.default) if is_whole else to_json_value(parameter.default)


_LABEL_COLUMNS: Final = 7
"""Width of the labels, so that those of most tasks are the same."""

_LONG_CHOICE: Final = re.compile(r"\(([^()|]*(?:\|[^()|]*){3})\|[^()]*\)")
"""Choice of five words or more, as `(wash|clean|wipe|do|scrub)`; group 1 has the first four."""

_MOST_WORDS: Final = 4
"""Phrases of one kind that are listed unless all are asked for."""


def _phrases(phrases: Sequence[str], *, is_verbose: bool, between: str = ", ") -> str:
    """List phrases; or only the first, and count the others."""
    if is_verbose:
        return between.join(phrases)
    shown = [_LONG_CHOICE.sub(r"(\1|…)", one) for one in phrases]
    if len(shown) <= _MOST_WORDS + 1:
        return between.join(shown)
    return f"{between.join(shown[:_MOST_WORDS])} and {len(shown) - _MOST_WORDS} more"


def _list_tasks(configuration: Configuration, form: str, *, is_verbose: bool) -> None:
    listed: list[dict[str, Any]] = [
        {
            "task": f"{module.id}.{task.id}",
            "goal": task.goal_text,
            "words": list(task.trigger_phrases),
            "objects": list(task.object_phrases),
            "extras": list(task.extra_phrases),
            "conditions": {phrase: one.text for phrase, one in task.condition_phrases.items()},
            "parameters": {
                name: {
                    "values": list(one.values),
                    "range": None if one.values else _range_text(one),
                    "default": None if one.default is None else _default(one),
                    "words": {value: list(stated) for value, stated in one.phrases.items()},
                }
                for name, one in task.parameters.items()
            },
            "scene": task.scene,
        }
        for module in configuration.modules.values()
        for task in module.tasks.values()
    ]
    if form == "json":
        print_data(json.dumps({"schema": SCHEMA, "tasks": listed}, indent=1))
        return
    for one in listed:
        print_line(one["task"])
        print_table(_described(one, is_verbose=is_verbose), indent=2, least=(_LABEL_COLUMNS,))
    if not is_verbose:
        print("\n`aeros tasks -v` lists all words")


def _described(one: Mapping[str, Any], *, is_verbose: bool) -> Iterator[tuple[str, str]]:
    """Describe a task in rows of a label and a text."""
    yield "goal", one["goal"]
    for label, key in (("say", "words"), ("with", "objects"), ("also", "extras")):
        if one[key]:
            yield label, _phrases(one[key], is_verbose=is_verbose)
    for name, parameter in one["parameters"].items():
        stated = {
            value: _phrases(words, is_verbose=is_verbose) for value, words in parameter["words"].items()
        }
        values = [f"{value} ({words})" if words else value for value, words in stated.items()]
        default = "" if parameter["default"] is None else f", else {parameter['default']}"
        shown = _phrases(values, is_verbose=is_verbose, between="; ")
        yield name, f"{shown or parameter['range'] or 'true or false'}{default}"
    conditions = [f"{phrase}: {text}" for phrase, text in one["conditions"].items()]
    if conditions and not is_verbose:
        yield "if", _phrases(list(one["conditions"]), is_verbose=False)
    else:
        yield from (("if", shown) for shown in conditions)
