"""Bounds of the time that a part of a composition takes, by the declared durations of outcomes.

A duration is the usual one, so the bounds hold for runs in which every step takes its declared duration, or
at most the timeout of its skill.  The agent itself is taken to need no time.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from aeros.spec.model.composition import Part, Step
from aeros.spec.model.ecm import Skill
from aeros.spec.model.step_graph import (
    FailingPart,
    Fallback,
    HeldPart,
    If,
    Par,
    RetriedPart,
    Seq,
    TimedPart,
    children_of,
)


def longest_duration(part: Part, handlers: Mapping[str, Step], skills: Mapping[str, Skill]) -> Fraction:
    """Bound the time that a part takes from above.

    Args:
        part: the part.
        handlers: handlers of its composition by name; they form no cycle.
        skills: skills that the module may run, by name.

    Returns:
        Seconds; an outcome that declares no duration counts with the timeout of its skill.
    """
    match part:
        case TimedPart(part=inner, timeout=timeout):
            return min(timeout, longest_duration(inner, handlers, skills))
        case Step():
            between, last = (
                Fraction(0) if name is None else longest_duration(handlers[name], handlers, skills)
                for name in (part.between_tries, part.last_handler)
            )
            own = max(_longest_run(skills[name]) for name in part.runs)
            return (part.retry + 1) * own + part.retry * between + last
        case _:
            inner_parts: tuple[Part, ...] = children_of(part)
            times = [longest_duration(inner, handlers, skills) for inner in inner_parts]
            if isinstance(part, Par | If):
                return max(times, default=Fraction(0))
            tries = part.retry + 1 if isinstance(part, RetriedPart) else 1
            return tries * sum(times, Fraction(0))


def shortest_success(part: Part, skills: Mapping[str, Skill]) -> Fraction | None:
    """Bound the time until a part succeeds from below.

    Args:
        part: the part.
        skills: skills that the module may run, by name.

    Returns:
        Seconds, at least 0; None if it never succeeds.
    """
    match part:
        case Step():
            outcomes = [one for name in part.runs for one in skills[name].outcomes.values()]
            succeeding = [one for one in outcomes if not one.failure and one.probability != 0]
            return min((one.duration or Fraction(0) for one in succeeding), default=None)
        case FailingPart():
            return None
        case Seq(parts=together) | Par(branches=together):
            found = [shortest_success(inner, skills) for inner in together]
            known = [time for time in found if time is not None]
            if len(known) < len(found):
                return None
            return sum(known, Fraction(0)) if isinstance(part, Seq) else max(known)
        case Fallback(parts=ways):
            found = [shortest_success(inner, skills) for inner in ways]
            return min((time for time in found if time is not None), default=None)
        case If(then=then, otherwise=otherwise):
            ways = (then,) if otherwise is None else (then, otherwise)
            found = [shortest_success(inner, skills) for inner in ways]
            return min((time for time in found if time is not None), default=None)
        case RetriedPart(part=inner) | HeldPart(part=inner) | TimedPart(part=inner):
            return shortest_success(inner, skills)
        case _:
            return Fraction(0)


def may_be_late(part: TimedPart[Step], handlers: Mapping[str, Step], skills: Mapping[str, Skill]) -> bool:
    """Tell whether a part may come to its time-out.

    Args:
        part: the part.
        handlers: handlers of its composition by name; they form no cycle.
        skills: skills that the module may run, by name.

    Returns:
        False if the declared durations exclude it.
    """
    return longest_duration(part.part, handlers, skills) > part.timeout


def _longest_run(skill: Skill) -> Fraction:
    outcomes = [one for one in skill.outcomes.values() if one.probability != 0]
    return max(skill.timeout if one.duration is None else one.duration for one in outcomes)
