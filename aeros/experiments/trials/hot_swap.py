"""Trials of a module loaded while the agent is awake: one task, the swap, and a task that needs it.

Settings of a condition: `first` and `second`, each the settings of a task's trial (`task.py`).
The registry starts with the first task's module alone.  The agent pursues the first task, is asked for the
second and refuses, as no module provides it; then the second module is installed, configured and activated,
each of which is proved, and the same agent pursues the second task, at a bench of its own.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, cast

from aeros.agent.agent import Agent, open_temporary_agent
from aeros.agent.errors import AgentError
from aeros.experiments.condition import TrialCondition
from aeros.experiments.inputs import TrialInputs
from aeros.experiments.trial_context import CountingRuntime
from aeros.experiments.trial_kinds import Findings, Trial, scratch_folder
from aeros.experiments.trials.task import KIND as TASKS
from aeros.experiments.trials.task import plant_factory
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.ports import Runtime
from aeros.runtime.proving import prove_configuration
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.registry_governor import RegistryGovernor
from aeros.session.assembly import build_executor
from aeros.spec.verification.reports import Report


class HotSwapTrials:
    """See `kinds.Kind`."""

    @contextmanager
    def open(self, condition: TrialCondition, premises: TrialInputs) -> Iterator[Trial]:
        """One registry for all trials, in which each finds what the one before found."""
        tasks = [
            TrialCondition.create("task", condition.plant, condition.settings[one])
            for one in ("first", "second")
        ]
        routed = [premises.routed(task.settings["task"]) for task in tasks]
        plants = [plant_factory(task, premises) for task in tasks]
        with scratch_folder() as (folder, audit):
            registry = Registry(folder / "state", _CachedProver())
            if premises.paths.site is not None:
                registry.set_policy(Path(premises.paths.site))
            first, second = (premises.configuration.modules[one.module] for one in routed)
            _load(registry, Path(first.folder), first.id)
            gate = _CachedGate(premises.configuration)

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
                            found = {"first": _succeeds(agent, routed[0].task.trigger_phrases[0])}
                            found["refused_before"] = _is_rejected(agent, routed[1].task.trigger_phrases[0])
                            swap_began = time.perf_counter()
                            _load(registry, Path(second.folder), second.id)
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
                                found["second"] = _succeeds(agent, routed[1].task.trigger_phrases[0])
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
        """The tasks are independent of each other; the swap is by definition."""
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


def _load(registry: Registry, folder: Path, name: str) -> None:
    registry.install(folder)
    registry.configure(name)
    registry.activate(name)


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
    """The runtime of an agent that is brought from one bench to the next, each with a plant of its own."""

    def move(self, runtime: Runtime) -> None:
        """Be this one from now on."""
        self._runtime = runtime


class _CachedProver:
    """Proves the modules of a registry; what was proved of the same files, the same ones active, is found."""

    def __init__(self) -> None:
        self._proved: dict[Any, tuple[Configuration, Report]] = {}

    def __call__(
        self,
        paths: Iterable[Path],
        site: Path,
        *,
        active: Callable[[str], bool] = lambda _: True,
        **options: Any,
    ) -> tuple[Configuration, Report]:
        """See `proving.prove_configuration`; `options` are its others."""
        folders = tuple(paths)
        # Below a registry a module's folder has its digest as its parent, and nobody here changes what it is
        # installed from.
        key = folders, site, *sorted(options.items()), tuple(active(one.name) for one in folders)
        if key not in self._proved:
            self._proved[key] = prove_configuration(folders, site, **options, active=active)
        return self._proved[key]


class _CachedGate(CompiledGate):
    """A gate that is compiled once for each configuration, and so are those that executors follow it to."""

    def __init__(self, configuration: Configuration, kept: dict[str, _CachedGate] | None = None) -> None:
        super().__init__(configuration)
        self._kept = {} if kept is None else kept

    def with_configuration(self, configuration: Configuration) -> _CachedGate:
        """See `Gate`."""
        if configuration.digest not in self._kept:
            self._kept[configuration.digest] = _CachedGate(configuration, self._kept)
        return self._kept[configuration.digest]


KIND: Final = HotSwapTrials()
