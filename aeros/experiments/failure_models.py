"""Failures of a trial's skill: each attempt independently at a rate, or in bursts.

In bursts, a Gilbert–Elliott channel decides whether a try fails; its state is never measured.  For an exact
prediction the channel's state becomes a predicate, and the skill that fails becomes a capability with one
provider for each state; each outcome of a provider leads to both states.  The loop on that module is the
product of policy and channel, and the code that predicts any other module predicts it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any, Final

from aeros.experiments.architecture import TrialModel
from aeros.sim.gilbert_elliott import GilbertElliottModel, GilbertElliottProcess, GilbertElliottSampler
from aeros.sim.symbolic.outcomes import BurstOutcomes, DrawEquivalence, uniform_burst_draw, uniform_draw
from aeros.spec.closed_loop.giving_up import declared_beliefs
from aeros.spec.closed_loop.loop_variables import StateSpaceError, recoveries_of
from aeros.spec.closed_loop.outcome_probabilities import outcome_probabilities, with_skill_probabilities
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL
from aeros.spec.model.ecm import ActionCondition, Ecm, Outcome, Skill
from aeros.spec.model.variables import Declared

_CHANNEL_IS_BAD: Final = t.Variable("channel is bad", BOOL, t.VariableRole.STATE)
"""The name is not valid in a vocabulary, so no module reads it."""

_BURST_FIELDS: Final = {
    "mean_length": "mean_burst_length",
    "within": "rate_in_bad",
    "between": "rate_in_good",
}
"""Fields of a `GilbertElliottModel` by their names in the settings of a condition."""


def gilbert_elliott_of(settings: Mapping[str, Any]) -> GilbertElliottModel:
    """Build the channel of a condition with bursts.

    Args:
        settings: of the condition: `rate`, and in `bursts` `mean_length` (attempts) and perhaps the rates
            `within` and `between` bursts, as texts of fractions.

    Returns:
        The channel, exact.

    Raises:
        MisuseError: there is no such channel.
    """
    declared = {_BURST_FIELDS[name]: Fraction(value) for name, value in settings["bursts"].items()}
    return GilbertElliottModel(Fraction(settings["rate"]), **declared)


def fault_process(settings: Mapping[str, Any]) -> GilbertElliottProcess:
    """Build the process by which the faults of a condition on physics happen.

    Args:
        settings: of the condition: `rate`, and perhaps `bursts`.

    Returns:
        The process, in floating point.
    """
    if "bursts" in settings:
        return gilbert_elliott_of(settings).process()
    return independent_process(float(Fraction(settings["rate"])))


def independent_process(rate: float) -> GilbertElliottProcess:
    """Build a process in which each attempt fails independently of all others.

    Args:
        rate: probability of a failure.

    Returns:
        The process.
    """
    return GilbertElliottProcess(
        bad_state_probability=0.0, good_to_bad=0.0, bad_to_good=1.0, rate_in_bad=rate, rate_in_good=rate
    )


def module_with_failure_rate(ecm: Ecm, settings: Mapping[str, Any], rate: Fraction | None = None) -> Ecm:
    """Set the rate of one declared failure, and the probability of all others to 0.

    Args:
        ecm: a module.
        settings: of the condition: `skill` and `outcome` that fails, and `rate`.
        rate: probability of the failure; None for the condition's.

    Returns:
        The module with these probabilities.
    """
    chances: dict[str, dict[str, Fraction]] = {}
    for skill in ecm.skills.values():
        failures = {one.id: Fraction(0) for one in skill.outcomes.values() if one.failure}
        if skill.id == settings["skill"]:
            failures[settings["outcome"]] = Fraction(settings["rate"]) if rate is None else rate
        chances[skill.id] = failures
    return with_skill_probabilities(ecm, chances)


def burst_outcomes(ecm: Ecm, settings: Mapping[str, Any]) -> dict[str, BurstOutcomes]:
    """Compute the outcomes that a symbolic plant draws in bursts.

    Args:
        ecm: the module of the task, as declared.
        settings: of the condition.

    Returns:
        Outcomes of the skill that fails, by `MODULE.SKILL`; empty where the condition has no bursts.
    """
    if "bursts" not in settings:
        return {}
    channel, name = gilbert_elliott_of(settings), settings["skill"]
    good, bad = (
        outcome_probabilities(module_with_failure_rate(ecm, settings, rate).skills[name].outcomes.values())
        for rate in (channel.rate_in_good, channel.rate_in_bad)
    )
    return {f"{ecm.id}.{name}": BurstOutcomes(channel.process(), good, bad)}


def draw_equivalence(ecm: Ecm, settings: Mapping[str, Any]) -> DrawEquivalence:
    """Describe which rates, or mean lengths of bursts, draw the same outcomes for a seed.

    The skill must succeed in one way and fail in one, in this order, or no other rate is equivalent: a try
    fails if and only if the rate is at least 1 minus the number drawn.

    Args:
        ecm: the module of the task, as declared.
        settings: of the condition.

    Returns:
        The skill that fails, and a function from seed and number of runs to the equivalent interval.
    """
    name = f"{ecm.id}.{settings['skill']}"
    rate = float(Fraction(settings["rate"]))
    declared = (
        module_with_failure_rate(ecm, settings, Fraction(1, 2)).skills[settings["skill"]].outcomes.values()
    )
    if "bursts" in settings:
        return DrawEquivalence(
            name, partial(_equivalent_lengths, gilbert_elliott_of(settings).process(), name)
        )
    if [one.failure for one, share in outcome_probabilities(declared) if share] != [False, True]:
        return DrawEquivalence(name, lambda *_: (rate, rate))
    return DrawEquivalence(name, partial(_equivalent_rates, rate, name))


def _equivalent_lengths(
    process: GilbertElliottProcess, skill: str, seed: int, runs: int
) -> tuple[float, float]:
    chain = GilbertElliottSampler(process)
    for run in range(runs):
        chain.is_bad(uniform_burst_draw(seed, skill, run))
    return chain.alike


def _equivalent_rates(rate: float, skill: str, seed: int, runs: int) -> tuple[float, float]:
    left = [1.0 - float(uniform_draw(seed, skill, run)) for run in range(runs)]
    return (
        max((one for one in left if one <= rate), default=0.0),
        min((one for one in left if one > rate), default=1.0),
    )


def add_channel_state(
    model: TrialModel, settings: Mapping[str, Any]
) -> Iterator[tuple[Fraction, TrialModel]]:
    """Add the state of the channel to a model, once for each state in which it may begin.

    Args:
        model: as declared, whatever the probabilities of the skill that fails.
        settings: of the condition, with `bursts`.

    Yields:
        The probability that the channel begins in a state, and the model that begins there.

    Raises:
        StateSpaceError: the skill that fails also helps where others fail.
    """
    channel, name = gilbert_elliott_of(settings), settings["skill"]
    if any(name in recoveries_of(rule) for rule in model.task.rules):
        raise StateSpaceError(f"`{name}` also helps where others fail, and is there no capability")
    skills, names = dict(model.ecm.skills), []
    shown = skills.pop(name)
    for is_bad in (False, True):
        rate = channel.rate_in_bad if is_bad else channel.rate_in_good
        declared = module_with_failure_rate(model.ecm, settings, rate).skills[name]
        one = _skill_in_state(declared, channel, is_bad=is_bad)
        skills[one.id] = one
        names.append(one.id)
    ecm = replace(model.ecm, skills=skills, capabilities={**model.ecm.capabilities, name: tuple(names)})
    known = model.beliefs or declared_beliefs(module_with_failure_rate(model.ecm, settings))
    beliefs = replace(
        known,
        names=dict.fromkeys(names, name),
        hidden=frozenset({_CHANNEL_IS_BAD.name}),
    )
    site = replace(
        model.site, state={**model.site.state, _CHANNEL_IS_BAD.name: Declared(_CHANNEL_IS_BAD, shown.span)}
    )
    for is_bad, share in ((False, 1 - channel.bad_state_probability), (True, channel.bad_state_probability)):
        task = replace(model.task, initial={**model.task.initial, _CHANNEL_IS_BAD.name: is_bad})
        yield share, TrialModel(ecm, task, site, beliefs)


def _skill_in_state(skill: Skill, channel: GilbertElliottModel, *, is_bad: bool) -> Skill:
    """Build the provider of `skill` for one state of the channel."""
    leaves = channel.bad_to_good if is_bad else channel.good_to_bad
    outcomes: dict[str, Outcome] = {}
    for outcome, share in outcome_probabilities(skill.outcomes.values()):
        for then, chance in ((is_bad, 1 - leaves), (not is_bad, leaves)):
            id_ = f"{outcome.id}, then {'bad' if then else 'good'}"
            effects = {**outcome.effects, _CHANNEL_IS_BAD.name: then}
            outcomes[id_] = replace(outcome, id=id_, effects=effects, probability=share * chance)
    state: t.Term = _CHANNEL_IS_BAD if is_bad else t.Not(_CHANNEL_IS_BAD)
    before = skill.precondition
    if before is None:
        precondition = ActionCondition(state, _CHANNEL_IS_BAD.name, skill.span)
    else:
        precondition = replace(before, term=t.And((before.term, state)))
    id_ = f"{skill.id}, {'bad' if is_bad else 'good'}"
    return replace(skill, id=id_, outcomes=outcomes, precondition=precondition)
