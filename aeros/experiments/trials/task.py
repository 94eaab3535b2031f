"""Trials of one task: an architecture pursues it, and one of its skills fails at the condition's rate.

Settings of a condition: `task`; `architecture`, `options`; `skill`, `outcome` and `rate`, the failure;
`policy`, whether the gate decides; `budget`, at most so many `tries` of that skill, or `seconds` of plant
time; `faults`, on physics the faults file whose every fault has that rate; `bursts`, where attempts are not
independent: `mean_length`, and the rates `within` and `between` them.

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
from aeros.experiments.architecture import (
    ArchitectureReport,
    Budget,
    BudgetSpentError,
    TrialModel,
    build_architecture,
)
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
from aeros.experiments.trial_context import CountingRuntime, TrialContextImpl, is_goal_measured
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
from aeros.session.scene_files import scene_of_task
from aeros.sim.referee import judge_goal
from aeros.sim.symbolic.outcomes import OutcomeSampler, outcome_probabilities_by_skill
from aeros.spec.closed_loop.giving_up import declared_beliefs
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.task_parameters import arguments_in_force

_ARCHITECTURE_SETTINGS: Final = {"architecture", "options", "budget"}
"""Settings that decide the requests to a plant, but not its answers."""


class TaskTrials:
    """Kind of trials of one task, whose conditions share trials and plants."""

    def __init__(self) -> None:
        self._traces = PlantTraceCache()

    @contextmanager
    def open(self, condition: TrialCondition, premises: TrialInputs) -> Iterator[Trial]:
        """Implement `TrialKind.open`.

        Trials run one after the other; plants of their own share an audit log that is not kept.
        """
        settings = condition.settings
        routed = premises.routed(settings["task"])
        goal = routed.task.goal
        configuration, gate = premises.configuration, premises.gate
        if not settings["policy"]:
            configuration = without_policy(configuration)
            gate = OpenGate(configuration)
        watched, judged = (routed.module, settings["skill"]), _is_judged_by_measurement(condition)
        budget = Budget(**settings.get("budget", {}))
        plants_alike = f"{premises.digest} {condition.plant} {self.scheduling_group(condition)}"
        stream_of = self._random_streams(condition, premises)
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

            def tried(seed: int, stream: RandomStream, traces: list[PlantTrace]) -> Findings:
                began = time.process_time()
                with ReplayingRuntime(configuration, traces, stream, lambda: live(seed, *bench())) as runtime:
                    counting = CountingRuntime(runtime, watched, judge_by_measurement=judged, budget=budget)
                    found = _run_architecture(counting, routed, settings, seed)
                state, took = runtime.state, time.process_time() - began
                found["reached"] = is_goal_measured(goal, configuration.site, state.readings, state.now)
                judgement = judge_goal(
                    goal,
                    found["reached"],
                    state.truth,
                    routed.module,
                    arguments_in_force(configuration.modules.values(), routed.variables),
                )
                if judgement.true is not None or condition.plant == "physics":
                    # Elsewhere the state is what is measured; here, what no scene defines is no success.
                    found |= {
                        "reached": judgement.true is True,
                        "believed": judgement.believed,
                        "false_claim": judgement.is_false_claim,
                    }
                if budget.seconds is not None and state.now > budget.seconds:
                    found["reached"] = False
                return {
                    **found,
                    **state.counts,
                    "simulated_s": state.now,
                    EQUIVALENT_INTERVAL: list(stream.equivalent_interval(state.draws)),
                    "live": runtime.is_live,
                    "processor_s": took,
                    "alone_s": took - runtime.cpu_time_s + runtime.unshared_cpu_time_s,
                }

            def trial(seed: int) -> Findings:
                stream = stream_of(seed)
                traces = self._traces.traces(f"{plants_alike} {stream.plant_group}")
                if condition.plant == "physics":
                    return tried(seed, stream, traces)
                # A trial that needs a plant is rehearsed: many follow a trace, and code that is compiled at
                # its first use would be counted in each of them.
                rehearsed = tried(seed, stream, list(traces))
                if not rehearsed["live"]:
                    return rehearsed
                found = tried(seed, stream, traces)
                return {**found, "processor_s": rehearsed["processor_s"] + found["processor_s"]}

            yield trial

    def comparison_group(self, condition: TrialCondition) -> tuple[str, float]:
        """Implement `SharesTrials.comparison_group`.

        The conditions of a family differ in the rate alone, or in the mean length of bursts at the same rate:
        a seed draws the same numbers to compare it with.
        """
        settings = condition.settings
        number = settings["bursts"].pop("mean_length") if "bursts" in settings else settings.pop("rate")
        return TrialCondition.create(condition.kind, condition.plant, settings).canonical_json, float(
            Fraction(number)
        )

    def scheduling_group(self, condition: TrialCondition) -> str:
        """Implement `SharesTrials.scheduling_group`.

        By plant and failures, whatever the architecture and rate.
        """
        settings = json.loads(self.comparison_group(condition)[0])
        return json.dumps(
            {name: settings[name] for name in settings.keys() - _ARCHITECTURE_SETTINGS}, sort_keys=True
        )

    def _random_streams(
        self, condition: TrialCondition, premises: TrialInputs
    ) -> Callable[[int], RandomStream]:
        """Return a function from a seed to the random draws of its plant."""
        settings = condition.settings
        if condition.plant == "physics":
            number = self.comparison_group(condition)[1]
            return lambda seed: SeedRandomStream(seed, number)
        modules, declared = _failing_modules(settings, premises)
        shares, bursts = outcome_probabilities_by_skill(modules.values()), burst_outcomes(declared, settings)
        drawing = draw_equivalence(declared, settings)
        return lambda seed: OutcomeRandomStream(seed, OutcomeSampler(shares, bursts, seed), drawing)

    def expected_values(self, condition: TrialCondition, premises: TrialInputs) -> Mapping[str, float] | str:
        """Implement `TrialKind.expected_values`.

        From the manifest as it ran, by the architecture's code or own prediction.
        """
        settings = condition.settings
        routed = premises.routed(settings["task"])
        ecm = premises.configuration.modules[routed.module]
        model = TrialModel(
            module_with_failure_rate(ecm, settings),
            replace(routed.task, invariants=()),
            premises.configuration.site,
            declared_beliefs(ecm),
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
    """Predict the condition's architecture exactly, as the weighted mean over models."""
    total = dict.fromkeys(PREDICTED_FIELDS, Fraction(0))
    for weight, model in models:
        found = predict(
            lambda: build_architecture(settings["architecture"], settings["options"]),
            model,
            Budget(**settings.get("budget", {})),
            settings["skill"],
        )
        total = {name: value + weight * getattr(found, name) for name, value in total.items()}
    return {name: float(value) for name, value in total.items()}


def _is_judged_by_measurement(condition: TrialCondition) -> bool:
    """Return true if measurement decides which tries failed; elsewhere the plant reports it."""
    return condition.plant == "physics" or "bursts" in condition.settings


def plant_factory(condition: TrialCondition, premises: TrialInputs) -> PlantFactory:
    """Make the plants of a condition's trials ready.

    Args:
        condition: kind, plant and settings of the trials.
        premises: proved modules, site and compiled gate.

    Returns:
        A function that opens the plant of a seed.
    """
    settings = condition.settings
    routed = premises.routed(settings["task"])
    if condition.plant == "physics":
        return physics_plants(
            premises.configuration,
            scene_of_task(premises.configuration, routed.task),
            settings["faults"],
            fault_process(settings),
        )
    modules, declared = _failing_modules(settings, premises)
    return symbolic_plants(
        premises.configuration.site, modules, routed.task, burst_outcomes(declared, settings)
    )


def _failing_modules(settings: Mapping[str, Any], premises: TrialInputs) -> tuple[dict[str, Ecm], Ecm]:
    """Return all modules, with that of the task as it fails in the condition; and that module as declared."""
    modules = dict(premises.configuration.modules)
    declared = modules[premises.routed(settings["task"]).module]
    modules[declared.id] = module_with_failure_rate(declared, settings)
    return modules, declared


def _run_architecture(
    counting: CountingRuntime, routed: RoutedTask, settings: Mapping[str, Any], seed: int
) -> dict[str, Any]:
    """Run the architecture and collect the counted findings; an architecture that raises has failed.

    Raises:
        AuditError: the audit log cannot be written.
        InternalError: a fault of AEROS.
        KeyboardInterrupt: the user interrupted the trial.
    """
    context = TrialContextImpl(counting, routed, seed)
    architecture = build_architecture(settings["architecture"], settings["options"])
    raised = ""
    try:
        counted = architecture.pursue(context).findings()
    except BudgetSpentError as spent:  # what the architecture counted so far is not known
        counted = {"reason": str(spent)}
    except (AuditError, InternalError, KeyboardInterrupt):
        raise
    except Exception as error:
        raised = f"{type(error).__name__}: {error}"
        counted = ArchitectureReport(reason=raised).findings()
    found = {
        **counted,
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
