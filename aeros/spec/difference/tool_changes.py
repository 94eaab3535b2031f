"""Comparison of the tools of two sites: the service of an action kind, its time limit and its answers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from aeros.spec.difference.policy_change import (
    PolicyChange,
    Relation,
    bounds_relation,
    describe_set_change,
    finite_change,
    sets_relation,
)
from aeros.spec.expr.units import format_number
from aeros.spec.model.rules import ActionKind
from aeros.spec.model.tools import HttpService, McpService, Program, Tool


def tool_changes(subject: str, old: ActionKind, new: ActionKind) -> Iterator[PolicyChange]:
    """Compare the tools of one action kind.

    Calls of another service are newly allowed, and those of the earlier one newly denied.

    Args:
        subject: name of the subject.
        old: the action kind before.
        new: the action kind now.

    Yields:
        The change of each part of the tool.
    """
    before, after, places = old.tool, new.tool, (old.span, new.span)
    if before is None and after is None:
        return
    if before is None or after is None:
        headline = f"`{new.name}` is carried out by {_performer(after)}, before by {_performer(before)}"
        yield finite_change(subject, Relation.INCOMPARABLE, headline, *places)
        return
    # The variable with the token says who calls, and not what is called.
    services = [
        one.service if isinstance(one.service, Program) else replace(one.service, token=None)
        for one in (before, after)
    ]
    relation = Relation.EQUAL if services[0] == services[1] else Relation.INCOMPARABLE
    headline = f"`{new.name}` calls {_performer(after)}, before {_performer(before)}"
    yield finite_change(f"{subject}/service", relation, headline, *places)
    shown = [format_number(one.timeout) for one in (before, after)]
    headline = f"a call of `{new.name}` may take {shown[1]} s, before {shown[0]} s"
    relation = bounds_relation(after.timeout > before.timeout, after.timeout < before.timeout)
    yield finite_change(f"{subject}/timeout", relation, headline, *places)
    answers = [frozenset(one.answers) for one in (before, after)]
    headline = describe_set_change(f"variables that an answer of `{new.name}` may set", *answers)
    yield finite_change(f"{subject}/answers", sets_relation(*answers), headline, *places)


def _performer(tool: Tool | None) -> str:
    """Describe who carries out an action."""
    if tool is None:
        return "the robot"
    match tool.service:
        case HttpService(url=url):
            return f"`{url}`"
        case Program(command=command):
            return f"the program `{' '.join(command)}`"
        case McpService(tool=name, command=command, url=url):
            return f"the tool `{name}` of the MCP server `{url or ' '.join(command)}`"
