"""Comparison of the tools of two sites: the service, its answers, and the confinement of a program."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction

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
from aeros.spec.model.tools import Confinement, HttpService, Tool

_NO_CONFINEMENT = Confinement()


def tool_changes(subject: str, old: ActionKind, new: ActionKind) -> Iterator[PolicyChange]:
    """Compare the tools of an action kind.

    Args:
        subject: subject of the kind's changes, as in `actions/ask`.
        old: the kind before.
        new: the kind now.

    Yields:
        The change of each subject; wider confinement and a longer timeout allow more.
    """
    before, after, spans = old.tool, new.tool, (old.span, new.span)
    if before is None or after is None:
        relation = Relation.EQUAL if before is after else Relation.CHANGED_OTHERWISE
        headline = f"`{new.name}` {'was' if after is None else 'is'} carried out by a tool"
        yield finite_change(f"{subject}/tool", relation, headline, *spans)
        return
    is_same = _service(before) == _service(after) and before.answers == after.answers
    relation = Relation.EQUAL if is_same else Relation.CHANGED_OTHERWISE
    headline = f"the service of `{new.name}`, or the variables that it answers, changed"
    yield finite_change(f"{subject}/tool", relation, headline, *spans)
    one, other = _confinement(before), _confinement(after)
    for what, then, now in (("reads", one.reads, other.reads), ("writes", one.writes, other.writes)):
        words = f"paths that the program of `{new.name}` {what}"
        headline = describe_set_change(words, frozenset(then), frozenset(now))
        relation = sets_relation(frozenset(then), frozenset(now))
        yield finite_change(f"{subject}/confinement/{what}", relation, headline, *spans)
    network = bounds_relation(other.network and not one.network, one.network and not other.network)
    headline = f"the program of `{new.name}` {'may' if other.network else 'may not'} use the network"
    yield finite_change(f"{subject}/confinement/network", network, headline, *spans)
    then_memory, now_memory = (Fraction(given.memory, 2**20) for given in (one, other))
    for place, words, was, is_now, unit in (
        ("timeout", "timeout of a call of", before.timeout, after.timeout, " s"),
        ("confinement/memory", "memory of", then_memory, now_memory, " MiB"),
        ("confinement/processor", "processor share of", one.processor * 100, other.processor * 100, " %"),
        ("confinement/processes", "processes of", Fraction(one.processes), Fraction(other.processes), ""),
    ):
        headline = (
            f"the {words} `{new.name}` was {format_number(was)}{unit} and is {format_number(is_now)}{unit}"
        )
        relation = bounds_relation(is_now > was, is_now < was)
        yield finite_change(f"{subject}/{place}", relation, headline, *spans)


def _confinement(tool: Tool) -> Confinement:
    return _NO_CONFINEMENT if isinstance(tool.service, HttpService) else tool.service.confinement


def _service(tool: Tool) -> object:
    """Return the service without its confinement, which is compared by itself."""
    if isinstance(tool.service, HttpService):
        return tool.service
    return replace(tool.service, confinement=_NO_CONFINEMENT)
