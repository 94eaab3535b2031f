"""Comparison of perception: cameras and shared variables of sites, variables and perceivers of modules."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.difference.policy_change import (
    PolicyChange,
    Relation,
    bounds_relation,
    describe_set_change,
    finite_change,
    sets_relation,
)
from aeros.spec.expr.units import format_number, format_quantity
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.perception import Perceiver, PerceptionPolicy
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared


def vocabulary_changes(old: Mapping[str, Declared], new: Mapping[str, Declared]) -> Iterator[PolicyChange]:
    """Compare state variables by name; an older or less certain value may be used where none might.

    Args:
        old: state variables before.
        new: state variables now.

    Yields:
        The change of each variable.
    """
    for name in dict.fromkeys([*old, *new]):
        before, after, subject = old.get(name), new.get(name), f"state/{name}"
        if before is None or after is None:
            headline = f"`{name}` is {'measured now' if before is None else 'no longer measured'}"
            spans = (None if one is None else one.span for one in (before, after))
            yield finite_change(subject, Relation.CHANGED_OTHERWISE, headline, *spans)
            continue
        ages = [one.max_age or Fraction(0) for one in (before, after)]
        headline = f"`{name}` may be {format_number(ages[1])} s old, before {format_number(ages[0])} s"
        age = bounds_relation(ages[1] > ages[0], ages[1] < ages[0])
        yield finite_change(f"{subject}/max_age", age, headline, before.span, after.span)
        yield _uncertainty_change(f"{subject}/uncertainty", before, after)
        public = bounds_relation(
            after.is_public and not before.is_public, before.is_public and not after.is_public
        )
        headline = f"modules that require this one {'may' if after.is_public else 'may not'} read `{name}`"
        yield finite_change(f"{subject}/public", public, headline, before.span, after.span)
        if before.sensor != after.sensor:
            headline = f"`{name}` was measured by `{before.sensor}` and is by `{after.sensor}`"
            yield finite_change(
                f"{subject}/sensor", Relation.CHANGED_OTHERWISE, headline, before.span, after.span
            )


def _uncertainty_change(subject: str, before: Declared, after: Declared) -> PolicyChange:
    """Compare the greatest uncertainty of a value that is used; without one, none is asked of the value."""
    then, now = before.uncertainty, after.uncertainty
    more = then is not None and (now is None or now > then)
    less = now is not None and (then is None or now < then)
    shown = ["anything" if one is None else format_quantity(one, after.unit) for one in (then, now)]
    headline = f"`{after.name}` may be uncertain by {shown[1]}, before by {shown[0]}"
    return finite_change(subject, bounds_relation(more, less), headline, before.span, after.span)


def site_perception_changes(old: Site, new: Site) -> Iterator[PolicyChange]:
    """Compare what two sites let perceivers have, and which variables of modules they share.

    Args:
        old: site before.
        new: site now.

    Yields:
        The change of each subject.
    """
    for name in dict.fromkeys([*old.cameras, *new.cameras]):
        before, after, subject = old.cameras.get(name), new.cameras.get(name), f"cameras/{name}"
        if before is None or after is None:
            relation = bounds_relation(before is None, after is None)
            headline = f"perceivers {'may' if before is None else 'no longer may'} get pictures of `{name}`"
            yield finite_change(subject, relation, headline, old.span, new.span)
            continue
        sizes = [(one.width, one.height) for one in (before, after)]
        relation = bounds_relation(
            any(now > then for then, now in zip(*sizes, strict=True)),
            any(now < then for then, now in zip(*sizes, strict=True)),
        )
        shown = [f"{width} x {height}" for width, height in sizes]
        headline = f"pictures of `{name}` had at most {shown[0]} pixels and have {shown[1]}"
        yield finite_change(f"{subject}/size", relation, headline, old.span, new.span)
        if before.sensor != after.sensor:
            headline = f"pictures of `{name}` came from `{before.sensor}` and come from `{after.sensor}`"
            yield finite_change(f"{subject}/sensor", Relation.CHANGED_OTHERWISE, headline, old.span, new.span)
    one, other = old.perception, new.perception
    for what, then, now in (
        ("shared", frozenset(one.shared), frozenset(other.shared)),
        ("in_invariants", one.in_invariants, other.in_invariants),
    ):
        words = "variables of modules that others may read" if what == "shared" else "those that Φ may read"
        headline = describe_set_change(words, then, now)
        subject = f"policy/perception/{what}"
        yield finite_change(subject, sets_relation(then, now), headline, old.span, new.span)
    public = bounds_relation(other.public and not one.public, one.public and not other.public)
    headline = f"modules {'may' if other.public else 'may not'} read what others declare as public"
    yield finite_change("policy/perception/public", public, headline, old.span, new.span)
    yield from _limit_changes("policy/perception", "of a perceiver", one, other, (old.span, new.span))
    shown = [format_number(policy.rate) for policy in (one, other)]
    headline = f"the rate of a perceiver was at most {shown[0]} Hz and is at most {shown[1]} Hz"
    relation = bounds_relation(other.rate > one.rate, other.rate < one.rate)
    yield finite_change("policy/perception/rate", relation, headline, old.span, new.span)


def perceiver_changes(old: Ecm, new: Ecm) -> Iterator[PolicyChange]:
    """Compare the own state variables of two versions of a module, and what measures them.

    Args:
        old: version before.
        new: version now.

    Yields:
        The change of each subject.
    """
    yield from vocabulary_changes(old.state, new.state)
    for name in old.definitions.keys() & new.definitions.keys():
        was, is_now = old.definitions[name], new.definitions[name]
        headline = f"`{name}` was defined as `{was.text}` and is as `{is_now.text}`"
        relation = Relation.EQUAL if was.term == is_now.term else Relation.CHANGED_OTHERWISE
        yield finite_change(f"state/{name}/definition", relation, headline, was.span, is_now.span)
    for name in dict.fromkeys([*old.perceivers, *new.perceivers]):
        before, after = old.perceivers.get(name), new.perceivers.get(name)
        subject = f"{new.id}/perceivers/{name}"
        if before is None or after is None:
            headline = f"the perceiver `{name}` {'is new' if before is None else 'was removed'}"
            spans = (None if one is None else one.span for one in (before, after))
            yield finite_change(subject, Relation.CHANGED_OTHERWISE, headline, *spans)
            continue
        yield from _picture_changes(subject, before, after)
        then, now = frozenset(before.readings), frozenset(after.readings)
        headline = describe_set_change(f"readings of `{name}`", then, now)
        places = (before.span, after.span)
        yield finite_change(f"{subject}/readings", sets_relation(then, now), headline, *places)
        rates = [one.rate or Fraction(0) for one in (before, after)]
        shown = [f"{format_number(rate)} Hz" if rate else "with pictures only" for rate in rates]
        headline = f"`{name}` gets readings {shown[1]}, before {shown[0]}"
        relation = bounds_relation(rates[1] > rates[0], rates[1] < rates[0])
        yield finite_change(f"{subject}/rate", relation, headline, *places)
        yield from _limit_changes(subject, f"of `{name}`", before, after, places)


def _picture_changes(subject: str, old: Perceiver, new: Perceiver) -> Iterator[PolicyChange]:
    """Compare the pictures that a perceiver gets; another camera, more pixels or depth is more."""
    before, after = ({one.name: one for one in perceiver.pictures} for perceiver in (old, new))
    for camera in dict.fromkeys([*before, *after]):
        then, now, below = before.get(camera), after.get(camera), f"{subject}/pictures/{camera}"
        if then is None or now is None:
            relation = bounds_relation(then is None, now is None)
            headline = f"`{new.id}` {'gets' if then is None else 'no longer gets'} pictures of `{camera}`"
            yield finite_change(below, relation, headline, old.span, new.span)
            continue
        parts = [(one.width, one.height, one.depth) for one in (then, now)]
        relation = bounds_relation(
            any(is_now > was for was, is_now in zip(*parts, strict=True)),
            any(is_now < was for was, is_now in zip(*parts, strict=True)),
        )
        shown = [
            f"{one.width} x {one.height} pixels{' with depth' if one.depth else ''}" for one in (then, now)
        ]
        headline = f"`{new.id}` gets {shown[1]} of `{camera}`, before {shown[0]}"
        yield finite_change(f"{below}/size", relation, headline, old.span, new.span)


def _limit_changes(
    subject: str,
    whose: str,
    old: Perceiver | PerceptionPolicy,
    new: Perceiver | PerceptionPolicy,
    places: tuple[SourceSpan, SourceSpan],
) -> Iterator[PolicyChange]:
    """Compare limits on the process of a perceiver; larger ones allow more."""
    for what, then, now, unit in (
        ("timeout", old.timeout, new.timeout, "s"),
        ("memory", Fraction(old.memory, 2**20), Fraction(new.memory, 2**20), "MiB"),
        ("processor", old.processor * 100, new.processor * 100, "%"),
    ):
        named = "processor share" if what == "processor" else what
        headline = f"the {named} {whose} was {format_number(then)} {unit} and is {format_number(now)} {unit}"
        yield finite_change(f"{subject}/{what}", bounds_relation(now > then, now < then), headline, *places)
