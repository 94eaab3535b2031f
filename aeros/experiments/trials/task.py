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
from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import Any, Final

from aeros.agent.planning.routing import RoutedTask
from aeros.experiments.architecture import ArchitectureReport, TrialModel, build_architecture
from aeros.experiments.condition import TrialCondition
from aeros.experiments.exact_prediction import predict
from aeros.experiments.failure_models import (
    add_channel_state,
    burst_outcomes,
    draw_equivalence,
    fault_process,
    module_with_failure_rate,
)
from aeros.experiments.inputs import TrialInputs
from aeros.experiments.open_gate import OpenGate, without_policy
from aeros.experiments.plant_cache import LivePlant, PlantTrace, PlantTraceCache, ReplayingRuntime
from aeros.experiments.random_stream import OutcomeRandomStream, RandomStream, SeedRandomStream
from aeros.experiments.trial_context import CountingRuntime, TrialContextImpl
from aeros.experiments.trial_kinds import (
    EQUIVALENT_INTERVAL,
    INDEPENDENT_PREFIX,
    PREDICTED_FIELDS,
    Findings,
    Trial,
    scratch_folder,
)
from aeros.experiments.trial_plants import PlantFactory, physics_plants, symbolic_plants
from aeros.runtime.audit.log import AuditError, AuditLog
from aeros.session.assembly import build_executor
from aeros.sim.symbolic.outcomes import OutcomeSampler, outcome_probabilities_by_skill
from aeros.spec.closed_loop.transition_system import StateSpaceError
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.model.model import Ecm

_ARCHITECTURE_SETTINGS: Final = {"architecture", "options"}
"""Settings that decide what is asked of a plant, and not what comes of it."""


class TaskTrials:
    """See `kinds.Kind` and `kinds.SharesTrials`."""

    def __init__(self) -> None:
        self._takes = PlantTraceCache()

    @contextmanager
    def open(self, condition: TrialCondition, premises: TrialInputs) -> Iterator[Trial]:
        """One trial after the other, those at plants of their own all in one audit log that nobody keeps."""
        settings = condition.settings
        routed = premises.routed(settings["task"])
        configuration, gate = premises.configuration, premises.gate
        if not settings["policy"]:
            configuration = without_policy(configuration)
            gate = OpenGate(configuration)
        watched, judged = (routed.module, settings["skill"]), _is_judged_by_measurement(condition)
        plants_alike = f"{premises.digest} {condition.plant} {self.scheduling_group(condition)}"
        luck_of = self._random_streams(condition, premises)
        with ExitStack() as stack:

            @cache
            def bench() -> tuple[PlantFactory, AuditLog]:
                return plant_factory(condition, premises), stack.enter_context(scratch_folder())[1]

            @contextmanager
            def live(seed: int, plants: PlantFactory, audit: AuditLog) -> Iterator[LivePlant]:
                with (
                    plants(seed) as opened,
                    build_executor(
                        configuration, opened.plant, audit, premises.skill_runs, gate=gate
                    ) as executor,
                ):
                    yield LivePlant(executor, opened)

            def tried(seed: int, luck: RandomStream, takes: list[PlantTrace]) -> Findings:
                began = time.process_time()
                with ReplayingRuntime(configuration, takes, luck, lambda: live(seed, *bench())) as runtime:
                    counting = CountingRuntime(runtime, watched, judge_by_measurement=judged)
                    found = _run_architecture(counting, routed, settings, seed)
                state, took = runtime.state, time.process_time() - began
                return {
                    **found,
                    **state.counts,
                    "simulated_s": state.now,
                    EQUIVALENT_INTERVAL: list(luck.equivalent_interval(state.draws)),
                    "live": runtime.is_live,
                    "processor_s": took,
                    "alone_s": took - runtime.cpu_time_s + runtime.unshared_cpu_time_s,
                }

            def trial(seed: int) -> Findings:
                luck = luck_of(seed)
                takes = self._takes.traces(f"{plants_alike} {luck.plant_group}")
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

    def comparison_group(self, condition: TrialCondition) -> tuple[str, float]:
        """Conditions that differ in the rate alone: seeds draw the same numbers to compare it with.

        Or in the mean length of bursts, at the same rate.
        """
        settings = condition.settings
        number = settings["bursts"].pop("mean_length") if "bursts" in settings else settings.pop("rate")
        return TrialCondition.create(condition.kind, condition.plant, settings).canonical_json, float(
            Fraction(number)
        )

    def scheduling_group(self, condition: TrialCondition) -> str:
        """All that are at plants of the same failures, whatever pursues the task at which rate."""
        settings = json.loads(self.comparison_group(condition)[0])
        return json.dumps(
            {name: settings[name] for name in settings.keys() - _ARCHITECTURE_SETTINGS}, sort_keys=True
        )

    def _random_streams(
        self, condition: TrialCondition, premises: TrialInputs
    ) -> Callable[[int], RandomStream]:
        """The luck of each seed."""
        settings = condition.settings
        if condition.plant == "physics":
            number = self.comparison_group(condition)[1]
            return lambda seed: SeedRandomStream(seed, number)
        modules, declared = _failing_modules(settings, premises)
        shares, bursts = outcome_probabilities_by_skill(modules.values()), burst_outcomes(declared, settings)
        drawing = draw_equivalence(declared, settings)
        return lambda seed: OutcomeRandomStream(seed, OutcomeSampler(shares, bursts, seed), drawing)

    def expected_values(self, condition: TrialCondition, premises: TrialInputs) -> Mapping[str, float] | str:
        """From the manifest as it ran, by the architecture's own code or by what it says of itself."""
        settings = condition.settings
        routed = premises.routed(settings["task"])
        ecm = premises.configuration.modules[routed.module]
        model = TrialModel(
            module_with_failure_rate(ecm, settings),
            replace(routed.task, invariants=()),
            premises.configuration.site,
        )
        rate = float(Fraction(settings["rate"]))
        try:
            found = _predicted(settings, [(Fraction(1), model)])
            if "bursts" in settings:
                independent = {f"{INDEPENDENT_PREFIX}{name}": value for name, value in found.items()}
                return {
                    **_predicted(settings, add_channel_state(model, settings)),
                    **independent,
                    "first": rate,
                }
        except StateSpaceError as why:
            return str(why)
        return {**found, "attempt": rate}


def _predicted(
    settings: Mapping[str, Any], models: Iterable[tuple[Fraction, TrialModel]]
) -> dict[str, float]:
    """What is exactly to be expected of the condition's architecture, where each model has so much weight."""
    total = dict.fromkeys(PREDICTED_FIELDS, Fraction(0))
    for weight, model in models:
        found = predict(lambda: build_architecture(settings["architecture"], settings["options"]), model)
        total = {name: value + weight * getattr(found, name) for name, value in total.items()}
    return {name: float(value) for name, value in total.items()}


def _is_judged_by_measurement(condition: TrialCondition) -> bool:
    """Whether it is measured which tries have failed: elsewhere the plant says so."""
    return condition.plant == "physics" or "bursts" in condition.settings


def plant_factory(condition: TrialCondition, premises: TrialInputs) -> PlantFactory:
    """What opens the plants of a condition's trials."""
    settings = condition.settings
    routed = premises.routed(settings["task"])
    if condition.plant == "physics":
        return physics_plants(premises.configuration, routed, settings["faults"], fault_process(settings))
    modules, declared = _failing_modules(settings, premises)
    return symbolic_plants(
        premises.configuration.site, modules, routed.task, burst_outcomes(declared, settings)
    )


def _failing_modules(settings: Mapping[str, Any], premises: TrialInputs) -> tuple[dict[str, Ecm], Ecm]:
    """All modules, that of the task as it fails in the condition; and that one as it is declared."""
    modules = dict(premises.configuration.modules)
    declared = modules[premises.routed(settings["task"]).module]
    modules[declared.id] = module_with_failure_rate(declared, settings)
    return modules, declared


def _run_architecture(
    counting: CountingRuntime, routed: RoutedTask, settings: Mapping[str, Any], seed: int
) -> dict[str, Any]:
    """What came of it, counted here; an architecture that raises has failed."""
    means = TrialContextImpl(counting, routed, seed)
    architecture = build_architecture(settings["architecture"], settings["options"])
    raised = ""
    try:
        told = architecture.pursue(means)
    except (AuditError, InternalError, KeyboardInterrupt):
        raise
    except Exception as error:
        raised = f"{type(error).__name__}: {error}"
        told = ArchitectureReport(reason=raised)
    found = {
        "reached": means.is_goal_measured(),
        **told.findings(),
        "raised": raised,
        "steps": counting.steps,
        "actions": counting.actions,
        "denied": counting.denied,
    }
    if counting.judged:
        found |= {"tries": counting.tries, "failed_tries": counting.failed_tries}
        found |= {"first_tries": min(counting.tries, 1), "first_failed": counting.first_failed}
    return found


KIND: Final = TaskTrials()
