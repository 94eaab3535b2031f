"""Trials of an agent over many sessions, with memory and without, while one of two skills degrades.

Settings of a condition: `module`, the text of each of its files; `task`; `sessions`, how many; `first` and
`second`, the skills that provide what the task needs, each with the outcome that is its failure and its
`rates`, pairs of a session and the rate then, on straight lines between; `remembers`, whether memory is kept
from one session to the next; `replans`, of each session at most: with none there is one try; `faults`, on
physics the file in which each fault is named like the skill that it lets fail.

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

from aeros.agent.agent import Agent, awake, awake_once
from aeros.agent.planning.routing import Routed
from aeros.experiments.condition import Condition
from aeros.experiments.failure_models import independent
from aeros.experiments.inputs import Premises
from aeros.experiments.trial_kinds import Found, Trial, scratch
from aeros.experiments.trial_plants import Plants, physics_plants, symbolic_plants
from aeros.experiments.trials.inline_module import proved, written
from aeros.experiments.trials.thompson import Chances, Session, best, forgetting, remembering
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.ports import Runtime
from aeros.session.assembly import build_executor
from aeros.spec.closed_loop.outcome_probabilities import with_skill_probabilities

LATE: Final = 10
"""The sessions at the end that are looked at by themselves."""


class Sessions:
    """See `kinds.Kind` and `kinds.Tracing`."""

    @contextmanager
    def opened(self, condition: Condition, premises: Premises) -> Iterator[Trial]:
        """Plants for each session are made ready once; each trial has an agent of its own."""
        settings = condition.settings
        with scratch() as (folder, audit):
            configuration = proved(written(settings["module"], folder / "module"), premises)
            site = configuration.site
            limits = replace(site.limits, replans=min(settings["replans"], site.limits.replans))
            configuration = replace(configuration, site=replace(site, limits=limits))
            gate = CompiledGate(configuration)
            ((module, ecm),) = configuration.modules.items()
            routed = Routed(module, ecm.tasks[settings["task"]])
            plants = [
                _plants(condition.plant, settings, configuration, routed, number)
                for number in range(settings["sessions"])
            ]

            def trial(seed: int) -> Found:
                began = time.process_time()
                reached, tries, first = [], [], []
                with tempfile.TemporaryDirectory(dir=folder) as state:
                    for number, opened in enumerate(plants):
                        own = seed * len(plants) + number
                        with (
                            opened(own) as bench,
                            build_executor(
                                configuration, bench.plant, audit, premises.runs, gate=gate
                            ) as executor,
                            _agent(Path(state), site.id, executor, own, settings["remembers"]) as agent,
                        ):
                            report = agent.run(routed.task.words[0])
                        reached.append(report.reached)
                        tries.append(len(report.steps))
                        first.append([one.skill == settings["first"]["skill"] for one in report.steps])
                chances = _chances(settings)
                return {
                    "reached": all(reached),
                    "successes": sum(reached),
                    "late": sum(reached[-LATE:]),
                    "tries": sum(tries) / len(tries),
                    "regret": _regret(chances, first),
                    "series": {"success": list(map(float, reached)), "tries": tries},
                    "processor_s": time.process_time() - began,
                }

            yield trial

    def expected(self, condition: Condition, premises: Premises) -> Mapping[str, float] | str:
        """Of sessions with one try, by all that memory can hold."""
        settings = condition.settings
        if settings["replans"]:
            return "its sessions have several tries each, and how many follows from chance"
        sessions, known = _expected(settings), best(_chances(settings))
        return {
            "successes": sum(one.success for one in sessions),
            "late": sum(one.success for one in sessions[-LATE:]),
            "tries": 1.0,
            "regret": sum(one.success for one in known) - sum(one.success for one in sessions),
        }

    def traced(self, condition: Condition) -> Mapping[str, Sequence[float]]:
        """See `kinds.Tracing`; and with `best`, what one comes to who knows the chances."""
        settings = condition.settings
        if settings["replans"]:
            return {}
        return {
            "success": [one.success for one in _expected(settings)],
            "best": [one.success for one in best(_chances(settings))],
        }


def _agent(
    folder: Path, site: str, runtime: Runtime, seed: int, remembers: bool
) -> AbstractContextManager[Agent]:
    if remembers:
        return awake(folder, site, runtime, seed=seed)
    return awake_once(site, runtime, seed=seed)


def _plants(
    plant: str, settings: Mapping[str, Any], configuration: Configuration, routed: Routed, number: int
) -> Plants:
    """Those of session `number`, in which each skill fails at the rate of that session."""
    skills = [settings[one] for one in ("first", "second")]
    rates = {one["skill"]: _rate(one["rates"], number) for one in skills}
    if plant == "physics":
        return physics_plants(
            configuration,
            routed,
            settings["faults"],
            {name: independent(rate) for name, rate in rates.items()},
        )
    failures = {one["skill"]: {one["outcome"]: Fraction(rates[one["skill"]])} for one in skills}
    ecm = with_skill_probabilities(configuration.modules[routed.module], failures)
    return symbolic_plants(configuration.site, {ecm.id: ecm}, routed.task)


def _rate(points: Sequence[tuple[float, float]], number: int) -> float:
    """The rate in session `number`, counted from 0; level before the first point and after the last."""
    for (begin, low), (end, high) in pairwise(points):
        if begin <= number < end:
            return low + (number - begin) / (end - begin) * (high - low)
    return points[0][1] if number < points[0][0] else points[-1][1]


def _chances(settings: Mapping[str, Any]) -> Chances:
    def success(which: str, number: int) -> float:
        return 1.0 - _rate(settings[which]["rates"], number)

    return [(success("first", number), success("second", number)) for number in range(settings["sessions"])]


def _expected(settings: Mapping[str, Any]) -> list[Session]:
    chances = tuple(_chances(settings))
    return _remembering(chances) if settings["remembers"] else forgetting(chances)


_remembering = lru_cache(maxsize=4)(remembering)


def _regret(chances: Chances, first: Sequence[Sequence[bool]]) -> float:
    """By how much every try together was less likely to succeed than the better skill's."""
    return sum(
        max(pair) - pair[0 if taken else 1]
        for pair, tries in zip(chances, first, strict=True)
        for taken in tries
    )


KIND: Final = Sessions()
