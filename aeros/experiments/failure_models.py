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

from aeros.experiments.architecture import Model
from aeros.sim.gilbert_elliott import Chain, Channel, Process
from aeros.sim.symbolic.outcomes import Bursts, Drawing, burst_point_of, point_of
from aeros.spec.closed_loop.outcome_probabilities import shares_of, with_skill_probabilities
from aeros.spec.closed_loop.transition_system import NotExploredError
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL
from aeros.spec.model.model import Clause, Declared, Ecm, Outcome, Skill

_STATE: Final = t.Variable("channel is bad", BOOL, t.Role.STATE)
"""No name of a vocabulary, so that no module reads it."""


def channel_of(settings: Mapping[str, Any]) -> Channel:
    """The channel of a condition with `bursts`; raises `MisuseError`."""
    declared = {name: Fraction(value) for name, value in settings["bursts"].items()}
    return Channel(Fraction(settings["rate"]), **declared)


def process_of(settings: Mapping[str, Any]) -> Process:
    """What the faults of a condition on physics happen by."""
    if "bursts" in settings:
        return channel_of(settings).process()
    return independent(float(Fraction(settings["rate"])))


def independent(rate: float) -> Process:
    """Each attempt by itself."""
    return Process(share_bad=0.0, worsens=0.0, mends=1.0, within=rate, between=rate)


def failing(ecm: Ecm, settings: Mapping[str, Any], rate: Fraction | None = None) -> Ecm:
    """The module where one skill fails at `rate`, the condition's, and no other declared failure happens."""
    chances: dict[str, dict[str, Fraction]] = {}
    for skill in ecm.skills.values():
        failures = {one.id: Fraction(0) for one in skill.outcomes.values() if one.failure}
        if skill.id == settings["skill"]:
            failures[settings["outcome"]] = Fraction(settings["rate"]) if rate is None else rate
        chances[skill.id] = failures
    return with_skill_probabilities(ecm, chances)


def bursts_of(ecm: Ecm, settings: Mapping[str, Any]) -> dict[str, Bursts]:
    """For a symbolic plant, where the condition has bursts."""
    if "bursts" not in settings:
        return {}
    channel, name = channel_of(settings), settings["skill"]
    good, bad = (
        shares_of(failing(ecm, settings, rate).skills[name].outcomes.values())
        for rate in (channel.between, channel.within)
    )
    return {f"{ecm.id}.{name}": Bursts(channel.process(), good, bad)}


def drawing_of(ecm: Ecm, settings: Mapping[str, Any]) -> Drawing:
    """What a symbolic plant draws of the condition, and rates, or mean lengths of bursts, that draw the same.

    The skill succeeds in one way and fails in one, in this order, or nothing is said of rates: a try
    fails iff the rate is at least what is left of 1 beyond where the draw falls.
    """
    name = f"{ecm.id}.{settings['skill']}"
    rate = float(Fraction(settings["rate"]))
    declared = failing(ecm, settings, Fraction(1, 2)).skills[settings["skill"]].outcomes.values()
    if "bursts" in settings:
        return Drawing(name, partial(_lengths_alike, channel_of(settings).process(), name))
    if [one.failure for one, share in shares_of(declared) if share] != [False, True]:
        return Drawing(name, lambda *_: (rate, rate))
    return Drawing(name, partial(_rates_alike, rate, name))


def _lengths_alike(process: Process, skill: str, seed: int, runs: int) -> tuple[float, float]:
    chain = Chain(process)
    for run in range(runs):
        chain.is_bad(burst_point_of(seed, skill, run))
    return chain.alike


def _rates_alike(rate: float, skill: str, seed: int, runs: int) -> tuple[float, float]:
    left = [1.0 - float(point_of(seed, skill, run)) for run in range(runs)]
    return (
        max((one for one in left if one <= rate), default=0.0),
        min((one for one in left if one > rate), default=1.0),
    )


def with_channel(model: Model, settings: Mapping[str, Any]) -> Iterator[tuple[Fraction, Model]]:
    """The model with the channel in it, as it begins in each of its states, and how likely that is.

    model: as declared, whatever the probabilities of the skill that fails.  Raises `NotExploredError`.
    """
    channel, name = channel_of(settings), settings["skill"]
    if any(rule.on_failure == name for rule in model.task.rules):
        raise NotExploredError(f"`{name}` also helps where others fail, and is there no capability")
    skills, names = dict(model.ecm.skills), []
    shown = skills.pop(name)
    for is_bad in (False, True):
        rate = channel.within if is_bad else channel.between
        declared = failing(model.ecm, settings, rate).skills[name]
        one = _in_state(declared, channel, is_bad=is_bad)
        skills[one.id] = one
        names.append(one.id)
    ecm = replace(model.ecm, skills=skills, capabilities={**model.ecm.capabilities, name: tuple(names)})
    site = replace(model.site, state={**model.site.state, _STATE.name: Declared(_STATE, shown.span)})
    for is_bad, share in ((False, 1 - channel.share_bad), (True, channel.share_bad)):
        task = replace(model.task, initial={**model.task.initial, _STATE.name: is_bad})
        yield share, Model(ecm, task, site)


def _in_state(skill: Skill, channel: Channel, *, is_bad: bool) -> Skill:
    """What `skill` is while the channel is in that state."""
    leaves = channel.mends if is_bad else channel.worsens
    outcomes: dict[str, Outcome] = {}
    for outcome, share in shares_of(skill.outcomes.values()):
        for then, chance in ((is_bad, 1 - leaves), (not is_bad, leaves)):
            id_ = f"{outcome.id}, then {'bad' if then else 'good'}"
            effects = {**outcome.effects, _STATE.name: then}
            outcomes[id_] = replace(outcome, id=id_, effects=effects, probability=share * chance)
    state: t.Term = _STATE if is_bad else t.Not(_STATE)
    before = skill.precondition
    if before is None:
        precondition = Clause(state, _STATE.name, skill.span)
    else:
        precondition = replace(before, term=t.And((before.term, state)))
    id_ = f"{skill.id}, {'bad' if is_bad else 'good'}"
    return replace(skill, id=id_, outcomes=outcomes, precondition=precondition)
