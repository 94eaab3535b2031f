"""Comparison of the tools of two sites: the service, its answers, and the confinement of a program."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import Final

from aeros.spec.diagnostics.source import SourceSpan
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
from aeros.spec.model.tools import Confinement, HttpService, McpService, Program, Tool

_NO_CONFINEMENT: Final = Confinement()


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
    services = [_called(one) for one in (before, after)]
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
    used = sets_relation(new.channels, old.channels)  # fewer to be permitted allows more
    headline = describe_set_change(f"channels that a call of `{new.name}` uses", old.channels, new.channels)
    yield finite_change(f"{subject}/channel", used, headline, *places)
    yield from _confinement_changes(f"{subject}/confinement", new.name, before, after, places)


def _confinement_changes(
    subject: str, name: str, before: Tool, after: Tool, places: tuple[SourceSpan, SourceSpan]
) -> Iterator[PolicyChange]:
    """Compare what the programs of two tools may use; more of it allows more."""
    one, other = _confinement(before), _confinement(after)
    for what, then, now in (("reads", one.reads, other.reads), ("writes", one.writes, other.writes)):
        paths = [frozenset(then), frozenset(now)]
        headline = describe_set_change(f"paths that the program of `{name}` {what}", *paths)
        yield finite_change(f"{subject}/{what}", sets_relation(*paths), headline, *places)
    network = bounds_relation(other.network and not one.network, one.network and not other.network)
    headline = f"the program of `{name}` {'may' if other.network else 'may not'} use the network"
    yield finite_change(f"{subject}/network", network, headline, *places)
    memory, now_memory = (Fraction(given.memory, 2**20) for given in (one, other))
    for what, words, was, is_now, unit in (
        ("memory", "memory", memory, now_memory, " MiB"),
        ("processor", "processor share", one.processor * 100, other.processor * 100, " %"),
        ("processes", "processes", Fraction(one.processes), Fraction(other.processes), ""),
    ):
        shown = [f"{format_number(value)}{unit}" for value in (was, is_now)]
        headline = f"the {words} of `{name}` was {shown[0]} and is {shown[1]}"
        relation = bounds_relation(is_now > was, is_now < was)
        yield finite_change(f"{subject}/{what}", relation, headline, *places)


def _confinement(tool: Tool) -> Confinement:
    return _NO_CONFINEMENT if isinstance(tool.service, HttpService) else tool.service.confinement


def _called(tool: Tool) -> object:
    """Return the service without the token, which says who calls, and its confinement, compared by itself."""
    match tool.service:
        case HttpService() as service:
            return replace(service, token=None)
        case Program() as service:
            return replace(service, confinement=_NO_CONFINEMENT)
        case McpService() as service:
            return replace(service, token=None, confinement=_NO_CONFINEMENT)


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
