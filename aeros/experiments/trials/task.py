"""Trials of one task: an architecture pursues it, one of its skills fails at the condition's rate.

Settings of a condition: `task`; `architecture`, `options`; `skill`, `outcome` and `rate`, the failure;
`policy`, whether the gate decides; `faults`, on physics the faults file whose every fault has that rate.

On the symbolic plant the outcome's declared probability is the rate, and no other declared failure happens.
On physics nothing is declared: the faults happen at that rate, and outcomes are measured.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

from aeros.agent.routing import Routed
from aeros.experiments.architecture import Model, Told, made
from aeros.experiments.condition import Condition
from aeros.experiments.exact import predicted
from aeros.experiments.kinds import PREDICTED, RAM, Found, Trial
from aeros.experiments.means import CountingRuntime, TrialMeans
from aeros.experiments.open_gate import OpenGate, without_policy
from aeros.experiments.plants import Plants, physics_plants, symbolic_plants
from aeros.experiments.premises import Premises
from aeros.runtime.audit import AuditError, AuditLog
from aeros.runtime.executor import Executor
from aeros.runtime.ports import Runtime
from aeros.spec.closed_loop.chances import with_skill_probabilities
from aeros.spec.closed_loop.transition_system import NotExploredError
from aeros.spec.errors import InternalError
from aeros.spec.model import Durability, Ecm


class Tasks:
    """See `kinds.Kind`."""

    @contextmanager
    def opened(self, condition: Condition, premises: Premises) -> Iterator[Trial]:
        """One trial after the other, all in one audit log that nobody keeps."""
        settings = condition.settings
        routed = premises.routed(settings["task"])
        configuration, gate = premises.configuration, premises.gate
        if not settings["policy"]:
            configuration = without_policy(configuration)
            gate = OpenGate(configuration)
        plants = plants_of(condition, premises)
        with (
            tempfile.TemporaryDirectory(dir=RAM) as folder,
            AuditLog(Path(folder) / "audit.jsonl", durability=Durability.BATCHED) as audit,
        ):

            def trial(seed: int) -> Found:
                began = time.process_time()
                with (
                    plants(seed) as opened,
                    Executor(configuration, gate, opened.plant, audit, premises.runs) as executor,
                ):
                    watched = (routed.module, settings["skill"]) if condition.plant == "physics" else None
                    found = _pursued(executor, routed, settings, seed, watched)
                    simulated = opened.plant.now()
                    found |= {"simulated_s": simulated, **opened.counts}
                return {**found, "processor_s": time.process_time() - began}

            yield trial

    def expected(self, condition: Condition, premises: Premises) -> Mapping[str, float] | str:
        """From the manifest as it ran, by the architecture's own code or by what it says of itself."""
        settings = condition.settings
        routed = premises.routed(settings["task"])
        ecm = failing(premises.configuration.modules[routed.module], settings)
        model = Model(ecm, replace(routed.task, invariants=()), premises.configuration.site)
        try:
            found = predicted(lambda: made(settings["architecture"], settings["options"]), model)
        except NotExploredError as why:
            return str(why)
        exact = {name: float(getattr(found, name)) for name in PREDICTED}
        return {**exact, "attempt": float(Fraction(settings["rate"]))}


def failing(ecm: Ecm, settings: Mapping[str, Any]) -> Ecm:
    """The module where one skill fails at the condition's rate and no other declared failure happens."""
    chances: dict[str, dict[str, Fraction]] = {}
    for skill in ecm.skills.values():
        failures = {one.id: Fraction(0) for one in skill.outcomes.values() if one.failure}
        if skill.id == settings["skill"]:
            failures[settings["outcome"]] = Fraction(settings["rate"])
        chances[skill.id] = failures
    return with_skill_probabilities(ecm, chances)


def plants_of(condition: Condition, premises: Premises) -> Plants:
    """What opens the plants of a condition's trials."""
    settings = condition.settings
    routed = premises.routed(settings["task"])
    if condition.plant == "physics":
        rate = float(Fraction(settings["rate"]))
        return physics_plants(premises.configuration, routed, settings["faults"], rate)
    modules = dict(premises.configuration.modules)
    modules[routed.module] = failing(modules[routed.module], settings)
    return symbolic_plants(premises.configuration.site, modules, routed.task)


def _pursued(
    runtime: Runtime,
    routed: Routed,
    settings: Mapping[str, Any],
    seed: int,
    watched: tuple[str, str] | None,
) -> dict[str, Any]:
    """What came of it, counted here; an architecture that raises has failed.

    watched: the skill whose attempts are counted, where that is no matter of definition.
    """
    counting = CountingRuntime(runtime, watched)
    means = TrialMeans(counting, routed, seed)
    architecture = made(settings["architecture"], settings["options"])
    try:
        told = architecture.pursue(means)
    except (AuditError, InternalError, KeyboardInterrupt):
        raise
    except Exception as error:
        told = Told(reason=f"{type(error).__name__}: {error}")
    attempts = {"tries": counting.tries, "failed_tries": counting.failed_tries}
    return {
        **(attempts if watched else {}),
        "reached": means.measures_the_goal(),
        **asdict(told),
        "steps": counting.steps,
        "actions": counting.actions,
        "denied": counting.denied,
    }


KIND: Final = Tasks()
