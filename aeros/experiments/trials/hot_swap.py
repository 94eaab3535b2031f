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

from aeros.agent.agent import Agent, awake_once
from aeros.agent.errors import RefusedError
from aeros.experiments.condition import Condition
from aeros.experiments.inputs import Premises
from aeros.experiments.trial_context import CountingRuntime
from aeros.experiments.trial_kinds import Found, Trial, scratch
from aeros.experiments.trials.task import KIND as TASKS
from aeros.experiments.trials.task import plants_of
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.ports import Runtime
from aeros.runtime.proving import prove
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.registry_governor import Governing
from aeros.session.assembly import build_executor
from aeros.spec.verification.reports import Report


class HotSwaps:
    """See `kinds.Kind`."""

    @contextmanager
    def opened(self, condition: Condition, premises: Premises) -> Iterator[Trial]:
        """One registry for all trials, in which each finds what the one before found."""
        tasks = [
            Condition.of("task", condition.plant, condition.settings[one]) for one in ("first", "second")
        ]
        routed = [premises.routed(task.settings["task"]) for task in tasks]
        plants = [plants_of(task, premises) for task in tasks]
        with scratch() as (folder, audit):
            registry = Registry(folder / "state", _ProvedOnce())
            if premises.where.site is not None:
                registry.policy(Path(premises.where.site))
            first, second = (premises.configuration.modules[one.module] for one in routed)
            _load(registry, Path(first.folder), first.id)
            gate = _KeptGate(premises.configuration)

            def trial(seed: int) -> Found:
                began = time.process_time()
                with Governing(registry) as governing, plants[0](seed) as bench:
                    configuration = governing.configuration()[1]
                    rest = audit, premises.runs
                    with build_executor(
                        configuration,
                        bench.plant,
                        *rest,
                        gate=gate.under(configuration),
                        governor=governing,
                    ) as executor:
                        runtime = _Moving(executor)
                        with awake_once(configuration.site.id, cast(Runtime, runtime), seed=seed) as agent:
                            found = {"first": _does(agent, routed[0].task.words[0])}
                            found["refused_before"] = _refuses(agent, routed[1].task.words[0])
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
                                    gate=gate.under(configuration),
                                    governor=governing,
                                ) as moved,
                            ):
                                runtime.move(moved)
                                found["second"] = _does(agent, routed[1].task.words[0])
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

    def expected(self, condition: Condition, premises: Premises) -> Mapping[str, float] | str:
        """The tasks are independent of each other; the swap is by definition."""
        product, steps, second = 1.0, 0.0, 0.0
        for name in ("first", "second"):
            task = Condition.of("task", condition.plant, condition.settings[name])
            found = TASKS.expected(task, premises)
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


def _does(agent: Agent, instruction: str) -> bool:
    try:
        return agent.run(instruction).reached
    except RefusedError:
        return False


def _refuses(agent: Agent, instruction: str) -> bool:
    try:
        agent.run(instruction)
    except RefusedError:
        return True
    return False


class _Moving(CountingRuntime):
    """The runtime of an agent that is brought from one bench to the next, each with a plant of its own."""

    def move(self, runtime: Runtime) -> None:
        """Be this one from now on."""
        self._runtime = runtime


class _ProvedOnce:
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
        """See `proving.prove`; `options` are its others."""
        folders = tuple(paths)
        # Below a registry a module's folder has its digest as its parent, and nobody here changes what it is
        # installed from.
        key = folders, site, *sorted(options.items()), tuple(active(one.name) for one in folders)
        if key not in self._proved:
            self._proved[key] = prove(folders, site, **options, active=active)
        return self._proved[key]


class _KeptGate(CompiledGate):
    """A gate that is compiled once for each configuration, and so are those that executors follow it to."""

    def __init__(self, configuration: Configuration, kept: dict[str, _KeptGate] | None = None) -> None:
        super().__init__(configuration)
        self._kept = {} if kept is None else kept

    def under(self, configuration: Configuration) -> _KeptGate:
        """See `Gate`."""
        if configuration.digest not in self._kept:
            self._kept[configuration.digest] = _KeptGate(configuration, self._kept)
        return self._kept[configuration.digest]


KIND: Final = HotSwaps()
