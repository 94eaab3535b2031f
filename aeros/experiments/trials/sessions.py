"""Trials of an agent over many sessions, with memory and without, while one of two skills degrades.

Settings of a condition: `module`, the text of each of its files; `task`; `sessions`, how many; `first` and
`second`, the skills that provide what the task needs, each with the outcome that is its failure and its
`rates`, pairs of a session and the rate then, linear between them, and the `seconds` that it takes, for the
prediction; `remembers`, whether memory is kept from
one session to the next; `replans`, most of each session: with none there is one try; `faults`, on physics the
file in which each fault is named like the skill that it makes fail.

With memory, each session is one of the robot's one agent, as `aeros run` has it: identity and memory are in a
folder, and outlive it.  Without, it is a new agent each time.  Every session has a plant of its own.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

from aeros.agent.agent import Agent, open_temporary_agent, start_agent
from aeros.agent.planning.routing import RoutedTask
from aeros.experiments.condition import TrialCondition
from aeros.experiments.failure_models import independent_process
from aeros.experiments.inputs import TrialInputs
from aeros.experiments.trial_kinds import Findings, Trial, scratch_folder
from aeros.experiments.trial_plants import PlantFactory, physics_plants, symbolic_plants
from aeros.experiments.trials.inline_module import prove_module, write_module_files
from aeros.experiments.trials.thompson import (
    ExpectedSession,
    SuccessProbabilities,
    oracle,
    with_memory,
    without_memory,
)
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.ports import Runtime
from aeros.session.assembly import build_executor
from aeros.session.scene_files import scene_of_task
from aeros.spec.closed_loop.outcome_probabilities import with_skill_probabilities

LAST_SESSIONS: Final = 10
"""Number of sessions at the end that are also counted by themselves."""


class SessionTrials:
    """Kind of trials with many sessions, which also predicts series."""

    @contextmanager
    def open(self, condition: TrialCondition, premises: TrialInputs) -> Iterator[Trial]:
        """Implement `TrialKind.open`.

        Plants for each session are made ready once; each trial has its own agent.
        """
        settings = condition.settings
        with scratch_folder() as (folder, audit):
            configuration = prove_module(write_module_files(settings["module"], folder / "module"), premises)
            site = configuration.site
            limits = replace(site.limits, replans=min(settings["replans"], site.limits.replans))
            configuration = replace(configuration, site=replace(site, limits=limits))
            gate = CompiledGate(configuration)
            ((module, ecm),) = configuration.modules.items()
            routed = RoutedTask(module, ecm.tasks[settings["task"]])
            plants = [
                _plants(condition.plant, settings, configuration, routed, premises, number)
                for number in range(settings["sessions"])
            ]

            def trial(seed: int) -> Findings:
                began = time.process_time()
                reached, tries, first = [], [], []
                with tempfile.TemporaryDirectory(dir=folder) as state:
                    for number, opened in enumerate(plants):
                        own = seed * len(plants) + number
                        with (
                            opened(own) as bench,
                            build_executor(
                                configuration, bench.plant, audit, premises.skill_runs, gate=gate
                            ) as executor,
                            _agent(Path(state), site.id, executor, own, settings["remembers"]) as agent,
                        ):
                            report = agent.run(str(routed))
                        reached.append(report.reached)
                        tries.append(len(report.steps))
                        first.append([one.skill == settings["first"]["skill"] for one in report.steps])
                chances = _success_probabilities(settings)
                return {
                    "reached": all(reached),
                    "successes": sum(reached),
                    "late": sum(reached[-LAST_SESSIONS:]),
                    "tries": sum(tries) / len(tries),
                    "regret": _regret(chances, first),
                    "series": {"success": list(map(float, reached)), "tries": tries},
                    "processor_s": time.process_time() - began,
                }

            yield trial

    def expected_values(self, condition: TrialCondition, premises: TrialInputs) -> Mapping[str, float] | str:
        """Implement `TrialKind.expected_values`.

        For sessions with one try.
        """
        settings = condition.settings
        if settings["replans"]:
            return "its sessions have several tries each, and how many follows from chance"
        sessions, known = _expected(settings), oracle(_success_probabilities(settings))
        return {
            "successes": sum(one.success for one in sessions),
            "late": sum(one.success for one in sessions[-LAST_SESSIONS:]),
            "tries": 1.0,
            "regret": sum(one.success for one in known) - sum(one.success for one in sessions),
        }

    def expected_series(self, condition: TrialCondition) -> Mapping[str, Sequence[float]]:
        """Implement `PredictsSeries.expected_series`.

        `best` is that of an agent that knows the probabilities.
        """
        settings = condition.settings
        if settings["replans"]:
            return {}
        return {
            "success": [one.success for one in _expected(settings)],
            "best": [one.success for one in oracle(_success_probabilities(settings))],
        }


def _agent(
    folder: Path, site: str, runtime: Runtime, seed: int, with_memory: bool
) -> AbstractContextManager[Agent]:
    if with_memory:
        return start_agent(folder, site, runtime, seed=seed)
    return open_temporary_agent(site, runtime, seed=seed)


def _plants(
    plant: str,
    settings: Mapping[str, Any],
    configuration: Configuration,
    routed: RoutedTask,
    premises: TrialInputs,
    number: int,
) -> PlantFactory:
    """Make the plants of session `number` ready, in which each skill fails at the rate of that session."""
    skills = [settings[one] for one in ("first", "second")]
    rates = {one["skill"]: _rate(one["rates"], number) for one in skills}
    if plant == "physics":
        return physics_plants(
            configuration,
            scene_of_task(premises.configuration, routed.task),
            settings["faults"],
            {name: independent_process(rate) for name, rate in rates.items()},
        )
    failures = {one["skill"]: {one["outcome"]: Fraction(rates[one["skill"]])} for one in skills}
    ecm = with_skill_probabilities(configuration.modules[routed.module], failures)
    return symbolic_plants(configuration.site, {ecm.id: ecm}, routed.task)


def _rate(points: Sequence[tuple[float, float]], number: int) -> float:
    """Interpolate the rate in session `number`, counted from 0; constant before and after all points."""
    for (begin, low), (end, high) in pairwise(points):
        if begin <= number < end:
            return low + (number - begin) / (end - begin) * (high - low)
    return points[0][1] if number < points[0][0] else points[-1][1]


def _success_probabilities(settings: Mapping[str, Any]) -> SuccessProbabilities:
    def success(which: str, number: int) -> float:
        return 1.0 - _rate(settings[which]["rates"], number)

    return [(success("first", number), success("second", number)) for number in range(settings["sessions"])]


def _expected(settings: Mapping[str, Any]) -> list[ExpectedSession]:
    chances = tuple(_success_probabilities(settings))
    if not settings["remembers"]:
        return without_memory(chances)
    return _remembering(chances, (settings["first"]["seconds"], settings["second"]["seconds"]))


_remembering = lru_cache(maxsize=4)(with_memory)


def _regret(chances: SuccessProbabilities, first: Sequence[Sequence[bool]]) -> float:
    """Sum over all tries how much less likely each was to succeed than the better skill's."""
    return sum(
        max(pair) - pair[0 if is_first else 1]
        for pair, tries in zip(chances, first, strict=True)
        for is_first in tries
    )


KIND: Final = SessionTrials()
