"""`aeros memory`: show, search, export or delete the agent's memory."""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from aeros.agent.agent import MEMORY_FILE
from aeros.agent.errors import AgentError
from aeros.agent.memory.deletion import (
    filter_before,
    filter_by_session,
    filter_by_skill,
    filter_by_variable,
    forget,
)
from aeros.agent.memory.posterior import SuccessRecord
from aeros.agent.memory.queries import ContextSummary, EpisodeFilter, SkillSummary, open_memory_reader
from aeros.cli.arguments import add_command
from aeros.cli.help_text import WrappedEpilog
from aeros.cli.terminal.rendering import number_text
from aeros.cli.terminal.streams import print_data, print_line
from aeros.exit_codes import EXIT_CODES, Exit, UsageError
from aeros.spec.diagnostics.grammar import counted
from aeros.spec.diagnostics.render import escape_invisible

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

SCHEMA: Final = "aeros/memory/1"

_EXAMPLES: Final = """\
The dispatcher uses memory to choose between skills that provide the same capability.  Memory has no
influence on safety: the gate decides each action and does not read it.

examples:
  aeros memory show                                      each skill's record, also by context
  aeros memory show --skill make_dumplings.wrap --format json
  aeros memory search sealed --failed                    failures that contain the word
  aeros memory search --skill make_dumplings.wrap --outcome wrapped --limit 5
  aeros memory export > memory.jsonl                     everything, as lines of JSON
  aeros memory forget --skill make_dumplings.wrap        asks for --yes and deletes nothing
  aeros memory forget --older-than 90 --yes              sessions that began more than 90 days ago
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "memory", __doc__, _EXAMPLES)
    actions = parser.add_subparsers(title="actions", required=True, metavar="ACTION")
    show = _action(actions, "show", "Summarize each skill's record, and list facts and sessions.", _show)
    show.add_argument("--skill", type=_skill, metavar="MODULE.SKILL", help="only this one")
    search = _action(actions, "search", "List steps, the newest first.", _search)
    search.add_argument("text", nargs="?", help="part of status, outcome, reason or inputs")
    search.add_argument("--skill", type=_skill, metavar="MODULE.SKILL", help="of this skill")
    search.add_argument("--task", metavar="MODULE.TASK", help="in this task")
    search.add_argument("--outcome", help="with this outcome")
    search.add_argument("--failed", action="store_true", default=None, help="that failed")
    search.add_argument("--session", type=_number, metavar="N", help="of this session, by its id")
    search.add_argument(
        "--limit", type=_number, default=20, metavar="N", help="maximum number of steps (default: 20)"
    )
    for action in (show, search):
        action.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    _action(actions, "export", "Print everything, as lines of JSON, with the table in `row`.", _export)
    forgetting = _action(actions, "forget", "Delete memory permanently.", _forget)
    which = forgetting.add_mutually_exclusive_group(required=True)
    which.add_argument(
        "--skill",
        type=_skill,
        metavar="MODULE.SKILL",
        help="steps of this skill, and events and facts that name it",
    )
    which.add_argument("--session", type=_number, metavar="N", help="everything of this session, by its id")
    which.add_argument(
        "--variable",
        metavar="NAME",
        help="what was seen of this variable or thing (`aeros world`), and events and facts that name it",
    )
    which.add_argument(
        "--older-than",
        type=_number,
        metavar="DAYS",
        help="everything of sessions that began more than DAYS days ago",
    )
    forgetting.add_argument(
        "--yes", action="store_true", help="confirm the deletion; without it nothing is deleted"
    )


def _action(
    actions: Subparsers, name: str, description: str, command: Callable[[argparse.Namespace], Exit]
) -> argparse.ArgumentParser:
    parser = actions.add_parser(
        name,
        help=description,
        description=description,
        epilog=f"{_EXAMPLES}\n{EXIT_CODES}",
        formatter_class=WrappedEpilog,
    )
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the agent's own folder (default: .aeros)"
    )
    parser.set_defaults(command=_reporting_errors(command))
    return parser


def _reporting_errors(command: Callable[[argparse.Namespace], Exit]) -> Callable[[argparse.Namespace], Exit]:
    def guarded(arguments: argparse.Namespace) -> Exit:
        try:
            return command(arguments)
        except AgentError as refusal:
            print(f"aeros: {refusal}", file=sys.stderr)
            return Exit.REJECTED

    return guarded


def _skill(text: str) -> str:
    if re.fullmatch(r"\w+\.\w+", text) is None:
        raise argparse.ArgumentTypeError("expected MODULE.SKILL, as in `make_dumplings.wrap`")
    return text


def _number(text: str) -> int:
    if re.fullmatch(r"\d{1,6}", text, re.ASCII) is None or not int(text):
        raise argparse.ArgumentTypeError("expected a whole number from 1 to 999999")
    return int(text)


def _show(arguments: argparse.Namespace) -> Exit:
    with open_memory_reader(arguments.state / MEMORY_FILE) as remembered:
        skills = list(remembered.skills(arguments.skill))
        whole = arguments.skill is None
        facts = remembered.facts() if whole else []
        sessions = remembered.sessions() if whole else []
    if not whole and not skills:
        print(f"aeros: there is no memory of `{escape_invisible(arguments.skill)}`", file=sys.stderr)
        return Exit.REJECTED
    if arguments.format == "json":
        listed = [_skill_data(one) for one in skills]
        data = {"schema": SCHEMA, "skills": listed, "facts": facts, "sessions": sessions}
        print_data(json.dumps(data, indent=1))
    else:
        print("\n".join(_format_summary(skills, facts, sessions)))
    return Exit.SUCCESS


def _skill_data(one: SkillSummary) -> dict[str, Any]:
    return {
        "skill": one.skill,
        **_record_data(one.record),
        "usual": None if one.typical_duration is None else asdict(one.typical_duration),
        "contexts": [
            {"context": each.context, "plant": each.plant, **_record_data(each.record)}
            for each in one.contexts
        ],
        "reasons": [{"reason": reason, "times": times} for reason, times in one.reasons],
        "inputs": [{"inputs": inputs, **_record_data(record)} for inputs, record in one.inputs],
        "obstacles": [{"kind": kind, "name": name, "times": times} for kind, name, times in one.obstacles],
    }


def _record_data(record: SuccessRecord) -> dict[str, Any]:
    return {"successes": record.successes, "failures": record.failures, "expected": round(record.mean, 6)}


def _fact_text(value: Any) -> str:
    """Write a fact for people: of a run's result neither what is absent nor what was counted as none."""
    if not isinstance(value, Mapping):
        return _value_text(value)
    entries = ((key, one) for key, one in value.items() if one is not None and (one is False or one != 0))
    return ", ".join(f"{key}: {_value_text(one)}" for key, one in entries)


def _value_text(value: Any) -> str:
    """Write a value; a measured 0 is a value like any other."""
    if not isinstance(value, Mapping):
        return value if isinstance(value, str) else _json_text(value)
    return ", ".join(f"{key} = {_value_text(one)}" for key, one in value.items())


def _json_text(value: Any) -> str:
    """Write a value as JSON has it, but a number rounded for people."""
    return number_text(value) if isinstance(value, float) else json.dumps(value)


def _format_summary(
    skills: list[SkillSummary], facts: list[dict[str, Any]], sessions: list[dict[str, Any]]
) -> Iterator[str]:
    for one in skills:
        yield escape_invisible(f"{one.skill}: {_success_text(one.record)}")
        if one.typical_duration is not None:
            yield f"  successes take {one.typical_duration}"
        for each in one.contexts:
            yield escape_invisible(f"  {_success_text(each.record)} {_context_text(each)}")
        for inputs, record in one.inputs:
            values = ", ".join(f"{name} = {_json_text(value)}" for name, value in inputs.items())
            yield escape_invisible(f"  {_success_text(record)} with {values}")
        for kind, name, times in one.obstacles:
            yield escape_invisible(f"  prevented {counted(times, 'time')} by {kind} `{name}`")
        for reason, times in one.reasons:
            yield escape_invisible(f"  failed {counted(times, 'time')}: {reason}")
    for fact in facts:
        yield escape_invisible(f"{fact['key']} ({fact['source']}): {_fact_text(fact['value'])}")
    for session in sessions:
        ended = "not ended" if session["ended"] is None else f"ended {session['ended']}"
        began = f"session {session['id']}: began {session['began']}"
        yield escape_invisible(f"{began}, {ended}, {counted(session['episodes'], 'step')}")


def _success_text(record: SuccessRecord) -> str:
    return f"{record} succeeded, next {record.mean:.0%}"


def _context_text(one: ContextSummary) -> str:
    plant = f" on {one.plant}" if one.plant else ""
    if (context := one.context) is None:
        return f"in unknown contexts{plant}"
    values = [f"{name} = {_json_text(value)}" for name, value in context["predicates"].items()]
    return f"in {context['task']}{plant}, by code {context['code'][:12]}" + (
        f", {', '.join(values)}" if values else ""
    )


def _search(arguments: argparse.Namespace) -> Exit:
    names = ("text", "skill", "task", "outcome", "failed", "session")
    wanted = EpisodeFilter(**{name: getattr(arguments, name) for name in names})
    with open_memory_reader(arguments.state / MEMORY_FILE) as remembered:
        found = remembered.search(wanted, arguments.limit)
    if arguments.format == "json":
        print_data(json.dumps({"schema": SCHEMA, "episodes": found}, indent=1))
    else:
        print("\n".join(map(_line, found)) or "no matching episodes")
    return Exit.SUCCESS


def _line(episode: Mapping[str, Any]) -> str:
    ended = episode["ended"]
    took = "" if ended is None else f", {ended - episode['started']:.1f} s"
    ending = episode["reason"] or (f"outcome `{episode['outcome']}`" if episode["outcome"] else "end unknown")
    where = f"{episode['id']} (session {episode['session']}, {episode['task']}{took})"
    return escape_invisible(f"{where} {episode['role']} {episode['module']}.{episode['skill']}: {ending}")


def _export(arguments: argparse.Namespace) -> Exit:
    with open_memory_reader(arguments.state / MEMORY_FILE) as remembered:
        for row in remembered.all_rows():
            print_data(json.dumps(row, sort_keys=True))
    return Exit.SUCCESS


def _forget(arguments: argparse.Namespace) -> Exit:
    if arguments.skill is not None:
        what, which = f"`{arguments.skill}`", filter_by_skill(arguments.skill)
    elif arguments.variable is not None:
        what, which = f"`{escape_invisible(arguments.variable)}`", filter_by_variable(arguments.variable)
    elif arguments.session is not None:
        what, which = f"session {arguments.session}", filter_by_session(arguments.session)
    else:
        since = datetime.now(UTC) - timedelta(days=arguments.older_than)
        what, which = f"sessions before {since:%Y-%m-%d %H:%M} UTC", filter_before(since)
    if not arguments.yes:
        raise UsageError(f"{what} would be deleted permanently; add --yes to confirm")
    deleted = forget(arguments.state, arguments.state / MEMORY_FILE, which)
    if arguments.older_than is None and not any(asdict(deleted).values()):
        print(f"aeros: nothing is remembered of {what}, so nothing was deleted", file=sys.stderr)
        return Exit.REJECTED
    counts = ", ".join(f"{count} {table}" for table, count in asdict(deleted).items())
    print_line(f"deleted {what}: {counts}")
    return Exit.SUCCESS
