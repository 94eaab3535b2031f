"""Comparison of perception: cameras and shared variables of sites, variables and perceivers of modules."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction

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
        doubts = [one.uncertainty or Fraction(0) for one in (before, after)]
        shown = [format_quantity(doubt, after.unit) for doubt in doubts]
        headline = f"`{name}` may be uncertain by {shown[1]}, before by {shown[0]}"
        doubt = bounds_relation(doubts[1] > doubts[0], doubts[1] < doubts[0])
        yield finite_change(f"{subject}/uncertainty", doubt, headline, before.span, after.span)
        if before.sensor != after.sensor:
            headline = f"`{name}` was measured by `{before.sensor}` and is by `{after.sensor}`"
            yield finite_change(
                f"{subject}/sensor", Relation.CHANGED_OTHERWISE, headline, before.span, after.span
            )


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
    yield from _limit_changes("policy/perception", "of a perceiver", one, other)


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
        then, now = _sources(before), _sources(after)
        headline = describe_set_change(f"sources of `{name}`", then, now)
        yield finite_change(f"{subject}/sources", sets_relation(then, now), headline, before.span, after.span)
        yield from _limit_changes(subject, f"of `{name}`", before, after)


def _sources(perceiver: Perceiver) -> frozenset[str]:
    """Describe everything that a perceiver gets."""
    pictures = (
        f"{one.camera} {one.width} x {one.height}{' with depth' if one.depth else ''}"
        for one in perceiver.pictures
    )
    rate = "" if perceiver.rate is None else f" at {format_number(perceiver.rate)} Hz"
    return frozenset((*pictures, *(f"{name}{rate}" for name in perceiver.readings)))


def _limit_changes(
    subject: str, whose: str, old: Perceiver | PerceptionPolicy, new: Perceiver | PerceptionPolicy
) -> Iterator[PolicyChange]:
    """Compare limits on the process of a perceiver; larger ones allow more."""
    for what, then, now, unit in (
        ("timeout", old.timeout, new.timeout, "s"),
        ("memory", Fraction(old.memory, 2**20), Fraction(new.memory, 2**20), "MiB"),
        ("processor", old.processor * 100, new.processor * 100, "%"),
    ):
        named = "processor share" if what == "processor" else what
        headline = f"the {named} {whose} was {format_number(then)} {unit} and is {format_number(now)} {unit}"
        yield finite_change(f"{subject}/{what}", bounds_relation(now > then, now < then), headline)
