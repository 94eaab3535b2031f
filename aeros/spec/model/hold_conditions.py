"""Hold-conditions of skills, and the outcomes of a run that loses its hold-condition.

A hold-condition must be measured as long as the skill runs; once it is not, the skill is halted.

The cause of a loss comes from outside, at any time. So a run that loses its hold-condition may end in the
state in which it began, or with any of the declared effects. Each predicate that the hold-condition reads may
then have any value that some skill brings about. A predicate that no skill brings about is assumed to be as
before: only the world can restore it. A predicate with a definition that the skill may change is either.
A number that the hold-condition reads is free: declared effects may be in force without those on it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from fractions import Fraction
from itertools import product
from math import prod
from typing import Any, Final

from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BoolType, EnumType
from aeros.spec.model.ecm import ActionCondition, Outcome, Skill
from aeros.spec.model.rules import Conjunct

HOLD_LOST: Final = "unheld"
"""Name of the outcome of a run that lost its hold-condition."""

STOPPED: Final = "stopped"
"""Name of the outcome of a run that was stopped with the part of a composition around it."""

MAX_COMBINATIONS: Final = 64
"""Greatest number of combinations of values that a hold-condition's predicates may have; all are tried."""


def start_condition(
    precondition: ActionCondition | None, hold: ActionCondition | None
) -> ActionCondition | None:
    """Join the precondition of a skill with the predicates of its hold-condition.

    So no skill starts only to be halted. The supervisor also measures the quantities of the hold-condition at
    the start, but nothing is proved about these.

    Args:
        precondition: declared precondition; None for none.
        hold: declared hold-condition; None for none.

    Returns:
        The conjunction; None if there is nothing to require.
    """
    parts = () if hold is None else tuple(part for part in hold.conjuncts if _reads_only_predicates(part))
    if not parts:
        return precondition
    term = t.conjunction(*(part.term for part in parts))
    text = " and ".join(_parenthesize(part.span.text) for part in parts)
    if precondition is None:
        first, last = parts[0], parts[-1]
        return ActionCondition(term, text, first.span.merge(last.span), parts)
    return ActionCondition(
        t.conjunction(precondition.term, term),
        f"{_parenthesize(precondition.text)} and {text}",
        precondition.span,
        (*precondition.conjuncts, *parts),
    )


def predicates_of(hold: ActionCondition) -> t.Term:
    """Return what proofs of loops assume of a condition while it is held: its conjuncts on predicates.

    Quantities change without the agent; so a loss by one is covered as a loss at any time.

    Args:
        hold: the condition.

    Returns:
        The conjunction; true if every conjunct reads a quantity.
    """
    return t.conjunction(*(part.term for part in hold.conjuncts if _reads_only_predicates(part)))


def hold_loss_outcomes(skill: Skill, settable: Collection[str]) -> tuple[Outcome, ...]:
    """List the ways in which a run of a skill may end by losing its hold-condition.

    They are failures of probability 0: no plan counts on one, but plans must provide for each.

    Args:
        skill: the skill.
        settable: state variables that some skill brings about, by name.

    Returns:
        One outcome per combination of effects; empty if the skill has no hold-condition.
    """
    if skill.hold_condition is None:
        return ()
    values = {name: options for name, options in _values(skill.hold_condition).items() if name in settable}
    return _halts(skill, HOLD_LOST, values, numbers_read(skill.hold_condition))


def stop_outcomes(skill: Skill) -> tuple[Outcome, ...]:
    """List the ways in which a run of a skill may end that is stopped with the part around it.

    Args:
        skill: the skill.

    Returns:
        Failures of probability 0: one for no effects, and one for the effects of each outcome.
    """
    return _halts(skill, STOPPED, {})


def numbers_read(hold: ActionCondition) -> frozenset[str]:
    """Return the measured values that a hold-condition reads and that are no predicates.

    Args:
        hold: the hold-condition.

    Returns:
        Names of state variables.
    """
    return frozenset(
        name
        for name, one in t.variables_of(hold.term).items()
        if one.role is t.VariableRole.STATE and not isinstance(one.type, BoolType | EnumType)
    )


def _halts(
    skill: Skill, name: str, values: Mapping[str, tuple[Any, ...]], freed: Collection[str] = ()
) -> tuple[Outcome, ...]:
    """List the ways in which a halted run may end, for each combination of some values.

    Effects on variables in `freed` are in force or not, whichever others are.
    """
    effects_so_far: list[Mapping[str, Any]] = [{}]
    for outcome in skill.outcomes.values():
        if outcome.probability != 0:
            effects_so_far.append(outcome.effects)
            effects_so_far.append({key: one for key, one in outcome.effects.items() if key not in freed})
    combinations: list[Mapping[str, Any]] = []
    for effects in effects_so_far:
        for chosen in product(*values.values()):
            after = {**effects, **dict(zip(values, chosen, strict=True))}
            if after not in combinations:
                combinations.append(after)
    return tuple(
        Outcome(
            name,
            effects,
            True,
            Fraction(0),
            None,
            consequences=dict.fromkeys(one for one in skill.disturbed if one not in effects),
        )
        for effects in combinations
    )


def count_combinations(hold: ActionCondition) -> int:
    """Count the combinations of values that the predicates of a hold-condition have.

    Args:
        hold: the hold-condition.

    Returns:
        The number of combinations; 1 if it reads no predicate.
    """
    return prod(len(values) for values in _values(hold).values())


def _values(hold: ActionCondition) -> dict[str, tuple[Any, ...]]:
    """Return the possible values of each predicate that a hold-condition reads."""
    values: dict[str, tuple[Any, ...]] = {}
    for name, variable in sorted(t.variables_of(hold.term).items()):
        if variable.role is t.VariableRole.STATE:
            match variable.type:
                case BoolType():
                    values[name] = (False, True)
                case EnumType(members=members):
                    values[name] = members
    return values


def _reads_only_predicates(part: Conjunct) -> bool:
    """Say if a conjunct reads no measured quantity."""
    variables = t.variables_of(part.term).values()
    return all(
        variable.role is not t.VariableRole.STATE or isinstance(variable.type, BoolType | EnumType)
        for variable in variables
    )


def _parenthesize(text: str) -> str:
    return f"({text})" if " " in text else text
