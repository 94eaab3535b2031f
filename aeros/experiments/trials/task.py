"""Trials of one task: an architecture pursues it, one of its skills fails at the condition's rate.

Settings of a condition: `task`; `architecture`, `options`; `skill`, `outcome` and `rate`, the failure;
`policy`, whether the gate decides; `faults`, on physics the faults file whose every fault has that rate;
`bursts`, where attempts are not independent: `mean_length`, and the rates `within` and `between` them.

On the symbolic plant the outcome's declared probability is the rate, and no other declared failure happens.
On physics nothing is declared: the faults happen at that rate, and outcomes are measured.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, replace
from fractions import Fraction
from functools import cache
from typing import Any, Final

from aeros.agent.planning.routing import Routed
from aeros.experiments.architecture import Model, Told, made
from aeros.experiments.condition import Condition
from aeros.experiments.exact_prediction import predicted
from aeros.experiments.failure_models import bursts_of, drawing_of, failing, process_of, with_channel
from aeros.experiments.inputs import Premises
from aeros.experiments.open_gate import OpenGate, without_policy
from aeros.experiments.plant_cache import FollowingRuntime, Live, Take, Takes
from aeros.experiments.random_stream import Luck, LuckOfASeed, LuckOfDraws
from aeros.experiments.trial_context import CountingRuntime, TrialMeans
from aeros.experiments.trial_kinds import ALIKE, INDEPENDENT, PREDICTED, Found, Trial, scratch
from aeros.experiments.trial_plants import Plants, physics_plants, symbolic_plants
from aeros.runtime.audit.log import AuditError, AuditLog
from aeros.session.assembly import build_executor
from aeros.sim.symbolic.outcomes import Draws, shares_by_skill
from aeros.spec.closed_loop.transition_system import NotExploredError
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.model.model import Ecm

_PURSUIT: Final = {"architecture", "options"}
"""Settings that decide what is asked of a plant, and not what comes of it."""


class Tasks:
    """See `kinds.Kind` and `kinds.Sharing`."""

    def __init__(self) -> None:
        self._takes = Takes()

    @contextmanager
    def opened(self, condition: Condition, premises: Premises) -> Iterator[Trial]:
        """One trial after the other, those at plants of their own all in one audit log that nobody keeps."""
        settings = condition.settings
        routed = premises.routed(settings["task"])
        configuration, gate = premises.configuration, premises.gate
        if not settings["policy"]:
            configuration = without_policy(configuration)
            gate = OpenGate(configuration)
        watched, judged = (routed.module, settings["skill"]), _is_judged(condition)
        plants_alike = f"{premises.digest} {condition.plant} {self.company(condition)}"
        luck_of = self._lucks(condition, premises)
        with ExitStack() as stack:

            @cache
            def bench() -> tuple[Plants, AuditLog]:
                return plants_of(condition, premises), stack.enter_context(scratch())[1]

            @contextmanager
            def live(seed: int, plants: Plants, audit: AuditLog) -> Iterator[Live]:
                with (
                    plants(seed) as opened,
                    build_executor(configuration, opened.plant, audit, premises.runs, gate=gate) as executor,
                ):
                    yield Live(executor, opened)

            def tried(seed: int, luck: Luck, takes: list[Take]) -> Found:
                began = time.process_time()
                with FollowingRuntime(configuration, takes, luck, lambda: live(seed, *bench())) as runtime:
                    counting = CountingRuntime(runtime, watched, judged=judged)
                    found = _pursued(counting, routed, settings, seed)
                state, took = runtime.state, time.process_time() - began
                return {
                    **found,
                    **state.counts,
                    "simulated_s": state.now,
                    ALIKE: list(luck.alike(state.chance)),
                    "live": runtime.is_live,
                    "processor_s": took,
                    "alone_s": took - runtime.spent_s + runtime.alone_s,
                }

            def trial(seed: int) -> Found:
                luck = luck_of(seed)
                takes = self._takes.of(f"{plants_alike} {luck.shared}")
                if condition.plant == "physics":
                    return tried(seed, luck, takes)
                # Rehearsed where it needs a plant: a take is followed by many, and whatever is compiled when
                # it is first used would be counted in each of them.
                rehearsed = tried(seed, luck, list(takes))
                if not rehearsed["live"]:
                    return rehearsed
                found = tried(seed, luck, takes)
                return {**found, "processor_s": rehearsed["processor_s"] + found["processor_s"]}

            yield trial

    def family(self, condition: Condition) -> tuple[str, float]:
        """Conditions that differ in the rate alone: seeds draw the same numbers to compare it with.

        Or in the mean length of bursts, at the same rate.
        """
        settings = condition.settings
        number = settings["bursts"].pop("mean_length") if "bursts" in settings else settings.pop("rate")
        return Condition.of(condition.kind, condition.plant, settings).text, float(Fraction(number))

    def company(self, condition: Condition) -> str:
        """All that are at plants of the same failures, whatever pursues the task at which rate."""
        settings = json.loads(self.family(condition)[0])
        return json.dumps({name: settings[name] for name in settings.keys() - _PURSUIT}, sort_keys=True)

    def _lucks(self, condition: Condition, premises: Premises) -> Callable[[int], Luck]:
        """The luck of each seed."""
        settings = condition.settings
        if condition.plant == "physics":
            number = self.family(condition)[1]
            return lambda seed: LuckOfASeed(seed, number)
        modules, declared = _failing_modules(settings, premises)
        shares, bursts = shares_by_skill(modules.values()), bursts_of(declared, settings)
        drawing = drawing_of(declared, settings)
        return lambda seed: LuckOfDraws(seed, Draws(shares, bursts, seed), drawing)

    def expected(self, condition: Condition, premises: Premises) -> Mapping[str, float] | str:
        """From the manifest as it ran, by the architecture's own code or by what it says of itself."""
        settings = condition.settings
        routed = premises.routed(settings["task"])
        ecm = premises.configuration.modules[routed.module]
        model = Model(
            failing(ecm, settings), replace(routed.task, invariants=()), premises.configuration.site
        )
        rate = float(Fraction(settings["rate"]))
        try:
            found = _predicted(settings, [(Fraction(1), model)])
            if "bursts" in settings:
                independent = {f"{INDEPENDENT}{name}": value for name, value in found.items()}
                return {**_predicted(settings, with_channel(model, settings)), **independent, "first": rate}
        except NotExploredError as why:
            return str(why)
        return {**found, "attempt": rate}


def _predicted(settings: Mapping[str, Any], models: Iterable[tuple[Fraction, Model]]) -> dict[str, float]:
    """What is exactly to be expected of the condition's architecture, where each model has so much weight."""
    total = dict.fromkeys(PREDICTED, Fraction(0))
    for weight, model in models:
        found = predicted(lambda: made(settings["architecture"], settings["options"]), model)
        total = {name: value + weight * getattr(found, name) for name, value in total.items()}
    return {name: float(value) for name, value in total.items()}


def _is_judged(condition: Condition) -> bool:
    """Whether it is measured which tries have failed: elsewhere the plant says so."""
    return condition.plant == "physics" or "bursts" in condition.settings


def plants_of(condition: Condition, premises: Premises) -> Plants:
    """What opens the plants of a condition's trials."""
    settings = condition.settings
    routed = premises.routed(settings["task"])
    if condition.plant == "physics":
        return physics_plants(premises.configuration, routed, settings["faults"], process_of(settings))
    modules, declared = _failing_modules(settings, premises)
    return symbolic_plants(premises.configuration.site, modules, routed.task, bursts_of(declared, settings))


def _failing_modules(settings: Mapping[str, Any], premises: Premises) -> tuple[dict[str, Ecm], Ecm]:
    """All modules, that of the task as it fails in the condition; and that one as it is declared."""
    modules = dict(premises.configuration.modules)
    declared = modules[premises.routed(settings["task"]).module]
    modules[declared.id] = failing(declared, settings)
    return modules, declared


def _pursued(
    counting: CountingRuntime, routed: Routed, settings: Mapping[str, Any], seed: int
) -> dict[str, Any]:
    """What came of it, counted here; an architecture that raises has failed."""
    means = TrialMeans(counting, routed, seed)
    architecture = made(settings["architecture"], settings["options"])
    raised = ""
    try:
        told = architecture.pursue(means)
    except (AuditError, InternalError, KeyboardInterrupt):
        raise
    except Exception as error:
        raised = f"{type(error).__name__}: {error}"
        told = Told(reason=raised)
    found = {
        "reached": means.measures_the_goal(),
        **asdict(told),
        "raised": raised,
        "steps": counting.steps,
        "actions": counting.actions,
        "denied": counting.denied,
    }
    if counting.judged:
        found |= {"tries": counting.tries, "failed_tries": counting.failed_tries}
        found |= {"first_tries": min(counting.tries, 1), "first_failed": counting.first_failed}
    return found


KIND: Final = Tasks()
