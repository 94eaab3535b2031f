"""Hold-conditions: what must be measured as long as a skill runs, and what may be measured once it was not.

What breaks one comes from outside, at any moment.  So a run may end by it as it began, or with any of the
declared effects, and each predicate that it reads may then have any value that some skill brings about.
What no skill brings about is the world's to bring back, and is taken to be as before.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from fractions import Fraction
from itertools import product
from math import prod
from typing import Any, Final

from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BoolType, EnumType
from aeros.spec.model.model import ActionCondition, Conjunct, Outcome, Skill

HOLD_LOST: Final = "unheld"
"""What a run that its hold-condition ended is said to come to, where outcomes are named."""

MAX_COMBINATIONS: Final = 64
"""Combinations of values that the predicates of a hold-condition may have; all are gone through."""


def start_condition(
    precondition: ActionCondition | None, hold: ActionCondition | None
) -> ActionCondition | None:
    """The precondition with what the hold-condition says of predicates: a skill does not start to be halted.

    What it says of quantities is measured at the start as well, by the supervisor; nothing proves that.
    """
    parts = () if hold is None else tuple(one for one in hold.conjuncts if _reads_only_predicates(one))
    if not parts:
        return precondition
    term = t.conjunction(*(one.term for one in parts))
    text = " and ".join(_parenthesize(one.span.text) for one in parts)
    if precondition is None:
        first, last = parts[0], parts[-1]
        return ActionCondition(term, text, first.span.merge(last.span), parts)
    return ActionCondition(
        t.conjunction(precondition.term, term),
        f"{_parenthesize(precondition.text)} and {text}",
        precondition.span,
        (*precondition.conjuncts, *parts),
    )


def hold_loss_outcomes(skill: Skill, settable: Collection[str]) -> tuple[Outcome, ...]:
    """Every way in which a run of `skill` may end by its hold-condition, as failures of probability 0.

    No plan counts on one, and each is to be provided for.
    settable: what some skill brings about, by vocabulary name.
    """
    if skill.hold_condition is None:
        return ()
    values = {name: each for name, each in _values(skill.hold_condition).items() if name in settable}
    happened: list[Mapping[str, Any]] = [{}]
    happened += [one.effects for one in skill.outcomes.values() if one.probability != 0]
    found: list[Mapping[str, Any]] = []
    for effects in happened:
        for chosen in product(*values.values()):
            after = {**effects, **dict(zip(values, chosen, strict=True))}
            if after not in found:
                found.append(after)
    return tuple(Outcome(HOLD_LOST, effects, True, Fraction(0), None) for effects in found)


def count_combinations(hold: ActionCondition) -> int:
    """How many combinations of values its predicates have."""
    return prod(len(values) for values in _values(hold).values())


def _values(hold: ActionCondition) -> dict[str, tuple[Any, ...]]:
    """The values of each predicate that it reads."""
    found: dict[str, tuple[Any, ...]] = {}
    for name, one in sorted(t.variables_of(hold.term).items()):
        if one.role is t.VariableRole.STATE:
            match one.type:
                case BoolType():
                    found[name] = (False, True)
                case EnumType(members=members):
                    found[name] = members
    return found


def _reads_only_predicates(part: Conjunct) -> bool:
    """Whether it reads no quantity that is measured."""
    read = t.variables_of(part.term).values()
    return all(
        one.role is not t.VariableRole.STATE or isinstance(one.type, BoolType | EnumType) for one in read
    )


def _parenthesize(text: str) -> str:
    return f"({text})" if " " in text else text
