"""What fails in a trial and how often: each attempt independently at a rate, or in bursts.

Whether a try fails in bursts depends on a state that nobody measures, a Gilbert–Elliott channel.  To predict
that exactly the channel is made a predicate, and the skill that fails a capability with a provider for each
state, each of whose outcomes leads to both.  The loop on that module is the product of policy and channel,
and is predicted by the code that predicts any other.
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
from aeros.spec.closed_loop.outcome_probabilities import outcome_probabilities, with_skill_probabilities
from aeros.spec.closed_loop.transition_system import StateSpaceError
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL
from aeros.spec.model.model import ActionCondition, Declared, Ecm, Outcome, Skill

_CHANNEL_IS_BAD: Final = t.Variable("channel is bad", BOOL, t.VariableRole.STATE)
"""No name of a vocabulary, so that no module reads it."""


def gilbert_elliott_of(settings: Mapping[str, Any]) -> GilbertElliottModel:
    """The channel of a condition with `bursts`; raises `MisuseError`."""
    names = {"mean_length": "mean_burst_length", "within": "rate_in_bad", "between": "rate_in_good"}
    declared = {names.get(name, name): Fraction(value) for name, value in settings["bursts"].items()}
    return GilbertElliottModel(Fraction(settings["rate"]), **declared)


def fault_process(settings: Mapping[str, Any]) -> GilbertElliottProcess:
    """What the faults of a condition on physics happen by."""
    if "bursts" in settings:
        return gilbert_elliott_of(settings).process()
    return independent_process(float(Fraction(settings["rate"])))


def independent_process(rate: float) -> GilbertElliottProcess:
    """Each attempt by itself."""
    return GilbertElliottProcess(
        bad_state_probability=0.0, good_to_bad=0.0, bad_to_good=1.0, rate_in_bad=rate, rate_in_good=rate
    )


def module_with_failure_rate(ecm: Ecm, settings: Mapping[str, Any], rate: Fraction | None = None) -> Ecm:
    """The module where one skill fails at `rate`, the condition's, and no other declared failure happens."""
    chances: dict[str, dict[str, Fraction]] = {}
    for skill in ecm.skills.values():
        failures = {one.id: Fraction(0) for one in skill.outcomes.values() if one.failure}
        if skill.id == settings["skill"]:
            failures[settings["outcome"]] = Fraction(settings["rate"]) if rate is None else rate
        chances[skill.id] = failures
    return with_skill_probabilities(ecm, chances)


def burst_outcomes(ecm: Ecm, settings: Mapping[str, Any]) -> dict[str, BurstOutcomes]:
    """For a symbolic plant, where the condition has bursts."""
    if "bursts" not in settings:
        return {}
    channel, name = gilbert_elliott_of(settings), settings["skill"]
    good, bad = (
        outcome_probabilities(module_with_failure_rate(ecm, settings, rate).skills[name].outcomes.values())
        for rate in (channel.rate_in_good, channel.rate_in_bad)
    )
    return {f"{ecm.id}.{name}": BurstOutcomes(channel.process(), good, bad)}


def draw_equivalence(ecm: Ecm, settings: Mapping[str, Any]) -> DrawEquivalence:
    """What a symbolic plant draws of the condition, and rates, or mean lengths of bursts, that draw the same.

    The skill succeeds in one way and fails in one, in this order, or nothing is said of rates: a try
    fails iff the rate is at least what is left of 1 beyond where the draw falls.
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
    """The model with the channel in it, as it begins in each of its states, and how likely that is.

    model: as declared, whatever the probabilities of the skill that fails.  Raises `StateSpaceError`.
    """
    channel, name = gilbert_elliott_of(settings), settings["skill"]
    if any(rule.on_failure == name for rule in model.task.rules):
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
    site = replace(
        model.site, state={**model.site.state, _CHANNEL_IS_BAD.name: Declared(_CHANNEL_IS_BAD, shown.span)}
    )
    for is_bad, share in ((False, 1 - channel.bad_state_probability), (True, channel.bad_state_probability)):
        task = replace(model.task, initial={**model.task.initial, _CHANNEL_IS_BAD.name: is_bad})
        yield share, TrialModel(ecm, task, site)


def _skill_in_state(skill: Skill, channel: GilbertElliottModel, *, is_bad: bool) -> Skill:
    """What `skill` is while the channel is in that state."""
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
