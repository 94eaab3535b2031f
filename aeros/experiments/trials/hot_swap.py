"""Trials of a module that is loaded while the agent is awake: one task, the swap, and a task that needs it.

Settings of a condition: `first` and `second`, each the settings of a task's trial (`task.py`).
The registry starts with the first task's module alone.  The agent pursues the first task, is asked for the
second and refuses, as no module provides it.  Then the second module is installed, configured and activated,
each time with a proof, and the same agent pursues the second task, at a bench of its own.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Final, cast

from aeros.agent.agent import Agent, open_temporary_agent
from aeros.agent.errors import AgentError
from aeros.experiments.condition import TrialCondition
from aeros.experiments.inputs import TrialInputs
from aeros.experiments.trial_context import CountingRuntime
from aeros.experiments.trial_kinds import Findings, Trial, scratch_folder
from aeros.experiments.trials.task import KIND as TASKS
from aeros.experiments.trials.task import plant_factory
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.ports import Runtime
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.registry_governor import RegistryGovernor
from aeros.session.assembly import build_executor
from aeros.spec.model.configured import UNCONFIGURED


class HotSwapTrials:
    """Kind of trials in which a module is loaded between two tasks."""

    @contextmanager
    def open(self, condition: TrialCondition, premises: TrialInputs) -> Iterator[Trial]:
        """Implement `TrialKind.open`: one registry for all trials, which each trial leaves as it was."""
        tasks = [
            TrialCondition.create("task", condition.plant, condition.settings[one])
            for one in ("first", "second")
        ]
        routed = [premises.routed(task.settings["task"]) for task in tasks]
        plants = [plant_factory(task, premises) for task in tasks]
        with scratch_folder() as (folder, audit):
            registry = Registry(folder / "state")
            if premises.paths.site is not None:
                registry.set_policy(Path(premises.paths.site))
            first, second = (premises.configuration.modules[one.module] for one in routed)
            registry.install(Path(first.folder), active=UNCONFIGURED)
            gate = CompiledGate(premises.configuration)

            def trial(seed: int) -> Findings:
                began = time.process_time()
                with RegistryGovernor(registry) as governing, plants[0](seed) as bench:
                    configuration = governing.configuration()[1]
                    rest = audit, premises.skill_runs
                    with build_executor(
                        configuration,
                        bench.plant,
                        *rest,
                        gate=gate.with_configuration(configuration),
                        governor=governing,
                    ) as executor:
                        runtime = _SwitchableRuntime(executor)
                        with open_temporary_agent(
                            configuration.site.id, cast(Runtime, runtime), seed=seed
                        ) as agent:
                            found = {"first": _succeeds(agent, str(routed[0]))}
                            found["refused_before"] = _is_rejected(agent, str(routed[1]))
                            swap_began = time.perf_counter()
                            registry.install(Path(second.folder), active=UNCONFIGURED)
                            found["swapped"] = second.id in runtime.active_modules()
                            swap_s = time.perf_counter() - swap_began
                            configuration = governing.configuration()[1]
                            with (
                                plants[1](seed) as other,
                                build_executor(
                                    configuration,
                                    other.plant,
                                    *rest,
                                    gate=gate.with_configuration(configuration),
                                    governor=governing,
                                ) as moved,
                            ):
                                runtime.move(moved)
                                found["second"] = _succeeds(agent, str(routed[1]))
                registry.deactivate(second.id)
                registry.remove(second.id)
                return {
                    **found,
                    "reached": all(found.values()),
                    "steps": runtime.steps,
                    "swap_s": swap_s,
                    "processor_s": time.process_time() - began,
                }

            yield trial

    def expected_values(self, condition: TrialCondition, premises: TrialInputs) -> Mapping[str, float] | str:
        """Implement `TrialKind.expected_values`.

        The tasks are independent of each other, and the swap must succeed.
        """
        product, steps, second = 1.0, 0.0, 0.0
        for name in ("first", "second"):
            task = TrialCondition.create("task", condition.plant, condition.settings[name])
            found = TASKS.expected_values(task, premises)
            if isinstance(found, str):
                return found
            second = found["success"]
            product *= second
            steps += found["invocations"]
        return {"swapped": 1.0, "second": second, "success": product, "invocations": steps}


def _succeeds(agent: Agent, instruction: str) -> bool:
    try:
        return agent.run(instruction).reached
    except AgentError:
        return False


def _is_rejected(agent: Agent, instruction: str) -> bool:
    try:
        agent.run(instruction)
    except AgentError:
        return True
    return False


class _SwitchableRuntime(CountingRuntime):
    """Runtime of an agent that moves from one bench to the next, each with a plant of its own."""

    def move(self, runtime: Runtime) -> None:
        """Pass all further calls to `runtime`."""
        self._runtime = runtime


KIND: Final = HotSwapTrials()
