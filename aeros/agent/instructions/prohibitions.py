"""Meaning of a prohibition: every task that it may mean."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

from aeros.agent.instructions import english
from aeros.agent.instructions.arguments import is_object
from aeros.agent.instructions.coverage import Coverage
from aeros.agent.instructions.covering import cover
from aeros.agent.instructions.lexicon import TaskPhrases
from aeros.agent.instructions.meaning import Errand
from aeros.agent.instructions.phrases import Words
from aeros.agent.instructions.refusals import InstructionError, not_covered
from aeros.agent.instructions.segments import Link, Segment
from aeros.agent.planning.routing import RoutedTask
from aeros.spec.diagnostics.codes import quoted

_OF_THINGS: Final = frozenset({"without", "skip", "omit"})
"""First words of prohibitions that may name only a part of what was named before, as `leave the right` is."""

_ALSO_NOT: Final = frozenset({"nor"})
"""Words that go on with a prohibition, as in `do not … nor …`."""


def prohibited_tasks(
    segment: Segment, tasks: Sequence[TaskPhrases], before: Sequence[Errand]
) -> list[RoutedTask]:
    """Find all tasks that a prohibition may mean: if it is not certain, all are prohibited.

    Args:
        segment: words of the prohibition.
        tasks: all tasks.
        before: requests that a pronoun may mean the object of.

    Returns:
        The tasks, with the arguments that the words say.

    Raises:
        InstructionError: it means none, or holds another negation.
    """
    for word in segment.words:
        if word in english.NEGATIVES and word not in _ALSO_NOT:
            raise InstructionError(f"{quoted(segment.text)} negates twice, which is not understood")
    if segment.marker == _NO and not english.FINITE.isdisjoint(segment.words):
        raise InstructionError(f"{quoted(segment.text)} may state something, or prohibit it")
    parts = list(_split(segment.words, english.CHOICES | _ALSO_NOT))
    if not all(parts):
        raise InstructionError(f"it is not clear what {quoted(segment.text)} prohibits")
    last = before[-1].routed if before else None
    found: list[RoutedTask] = []
    for part in parts:
        coverages = [
            cover(entry, part, knows_pronoun=last is not None and entry.routed.covers(last), is_perfect=True)
            for entry in tasks
        ]
        possible = [
            one.prohibited
            for one in coverages
            if not (one.unknown or one.repetitions) and (one.triggers or one.objects)
        ] or [
            one.prohibited
            for one in coverages
            if one.triggers and all(word in english.UNIVERSAL for word in one.unknown)
        ]
        if last is not None and not possible and segment.marker[0] in _OF_THINGS:
            # `clean the left side, and leave the right`
            possible = [
                one.prohibited
                for one in coverages
                if one.entry.routed.covers(last) and one.values.names_place and not one.unknown
            ]
        if (
            segment.marker == _NO
            and segment.link is not Link.START
            and any(map(_starts_with_verb, coverages))
        ):
            raise InstructionError(f"{quoted(segment.text)} may prohibit, or correct what is said before it")
        if not possible:
            raise not_covered(replace(segment, words=part), coverages)
        found += possible
    return found


def _starts_with_verb(coverage: Coverage) -> bool:
    """Return True for `clean the table`, and not for `cleaning` or `tables`."""
    is_act = bool(coverage.triggers) and not coverage.starts_with_object and bool(coverage.objects)
    return is_act and not english.is_gerund(coverage.triggers[0][0])


_NO: Final = ("no",)


def _split(words: Words, at: frozenset[str]) -> Iterator[Words]:
    part: list[str] = []
    for word in words:
        if word in at:
            yield tuple(part)
            part = []
        else:
            part.append(word)
    yield tuple(part)


def is_universal(segment: Segment) -> bool:
    """Check if a prohibition is of everything: `do not do anything`, `stop`.

    Args:
        segment: words of the prohibition.

    Returns:
        True if it is.
    """
    words = [word for word in segment.words if word not in english.FILLERS]
    if not words:
        return segment.marker in (("stop",), ("quit",), ("cease",))
    return all(word in english.UNIVERSAL for word in words)


def without_prohibited_parts(errands: Sequence[Errand], prohibited: Sequence[RoutedTask]) -> list[Errand]:
    """Leave out the part that a prohibition names: `clean the table, but leave the right half alone`.

    Args:
        errands: the requests.
        prohibited: the prohibited tasks, with the arguments that the words say.

    Returns:
        The requests; of one for the whole, the only part that is left.

    Raises:
        InstructionError: several parts are left.
    """
    found: list[Errand] = []
    for errand in errands:
        routed = errand.routed
        for name, parameter in routed.task.parameters.items():
            if is_object(parameter):
                continue
            spared = {
                one.arguments[name]
                for one in prohibited
                if one.task is routed.task
                and name in one.arguments
                and {**one.arguments, name: None}.items() <= {**routed.arguments, name: None}.items()
            }
            rest = [one for one in parameter.values if one != parameter.default and one not in spared]
            if not spared or not parameter.values or routed.arguments[name] != parameter.default:
                continue
            if len(rest) != 1:
                raise InstructionError(
                    f"{quoted(str(routed))} leaves open `{name}` if a value is prohibited; say it"
                )
            routed = replace(routed, arguments={**routed.arguments, name: rest[0]})
        found.append(replace(errand, routed=routed))
    return found
