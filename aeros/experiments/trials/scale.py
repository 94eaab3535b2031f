"""Trials of AEROS with many modules: time to install one more, to find a task, to decide and to plan.

Settings of a condition: `modules`, how many synthetic ones there are; `skills`, of each.  They are proved
from nothing and compiled once for some twenty trials, each of which reports how long that took; a trial
measures the rest itself.  All times are processor time of this process, which other load of the machine
affects least.  Times are not predicted, and differ from run to run.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any, Final, NamedTuple

from aeros.agent.instructions.understand import understand
from aeros.agent.planning.base import RulePlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.smt import SmtPlanner
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.experiments.condition import TrialCondition
from aeros.experiments.inputs import TrialInputs
from aeros.experiments.trial_kinds import SCRATCH_ROOT, Findings, Trial
from aeros.experiments.trials.synthetic import write_module, write_modules
from aeros.files import temporary_folder
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, DecisionKind
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.ports import Readings
from aeros.runtime.proving import configuration_of
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.skill import act
from aeros.spec.backends.answer_store import AnswerStore
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.model.ecm import Ecm
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.verification.reports import Report
from aeros.spec.verification.verify import Detail, verify

_REPETITIONS: Final = 200
"""Repetitions of one measurement of an operation that takes microseconds."""

_FIRST_NEW_MODULE: Final = 1000
"""Number of the first module that a trial installs; no existing module has it."""

_MAX_NEW_MODULES: Final = 890
"""Number of modules that trials install: the second thousand, without those that depend on another."""

_GRIP: Final = act("grip", width=0.03, force=1.0)
"""An action that every synthetic skill may ask for."""


@dataclass(frozen=True)
class _Installation:
    """Proved and compiled modules, with their proofs stored as `aeros verify` stores them.

    proving, compiling: processor time of each, from nothing, s.
    """

    folder: Path
    store: AnswerStore
    site: Path
    configuration: Configuration
    gate: CompiledGate
    proving: float
    compiling: float


class _TaskCase(NamedTuple):
    """A task of one of the modules, and the state in which it begins."""

    routed: RoutedTask
    words: str
    readings: Readings
    world: WorldModel


class ScaleTrials:
    """Kind of trials that measure times with many modules."""

    @contextmanager
    def open(self, condition: TrialCondition, premises: TrialInputs) -> Iterator[Trial]:
        """Implement `TrialKind.open`: the modules are proved and compiled once."""
        settings = condition.settings
        skills = settings["skills"]
        with temporary_folder(SCRATCH_ROOT) as folder:
            robot = _robot(folder, settings["modules"], skills, premises.paths.site)
            with closing(robot.store):
                yield lambda seed: _run_trial(robot, skills, seed)

    def expected_values(self, condition: TrialCondition, premises: TrialInputs) -> Mapping[str, float] | str:
        """Implement `TrialKind.expected_values`.

        Only that a task is found, however many modules there are.
        """
        return {"success": 1.0}


def _run_trial(robot: _Installation, skills: int, seed: int) -> Findings:
    """Run one trial and return its findings."""
    began = time.process_time()
    errand = _errand(robot, seed)
    caller = Caller(errand.routed.module, "skill_0", {})
    unused = {quota.id: 0 for quota in robot.configuration.site.quotas}
    verdict = robot.gate.decide(caller, errand.readings, _GRIP, 0.0, unused).kind
    modules = robot.configuration.modules
    rules, shortest = RulePlanner(), SmtPlanner(robot.configuration.site)
    found = {
        "installing_s": _cpu_seconds(lambda: _install_one_more(robot, skills, seed)),
        "lookup_us": 1e6 * _cpu_seconds(lambda: understand(errand.words, modules), _REPETITIONS),
        "decide_us": 1e6
        * _cpu_seconds(lambda: robot.gate.decide(caller, errand.readings, _GRIP, 0.0, unused), _REPETITIONS),
        "rules_us": 1e6
        * _cpu_seconds(lambda: rules.plan(errand.routed, errand.world, modules), _REPETITIONS),
        "shortest_ms": 1e3 * _cpu_seconds(lambda: shortest.plan(errand.routed, errand.world, modules)),
        "proving_s": robot.proving,
        "compiling_s": robot.compiling,
    }
    right = verdict is DecisionKind.ALLOW and understand(errand.words, modules).first == errand.routed
    return {**found, "reached": right, "processor_s": time.process_time() - began}


def _robot(folder: Path, count: int, skills: int, given: str | None) -> _Installation:
    site = reference_site_path() if given is None else Path(given)
    paths = write_modules(folder / "modules", count, skills)
    store = AnswerStore(folder / "proved.sqlite3")
    began = time.process_time()
    report = _require_proved(verify(paths, site, store=store, detail=Detail.BRIEF))
    proving = time.process_time() - began
    configuration = configuration_of(report, site)
    began = time.process_time()
    gate = CompiledGate(configuration)
    return _Installation(folder, store, site, configuration, gate, proving, time.process_time() - began)


def _require_proved(report: Report) -> Report:
    if report.conclusion is not Conclusion.PROVED:
        raise MisuseError(
            "the synthetic modules are not proved under this site; they are made for AEROS's own"
        )
    return report


def _install_one_more(robot: _Installation, skills: int, seed: int) -> None:
    """Prove a new module together with those that are proved, as `aeros verify` does."""
    # Skip every tenth number: such a module would depend on its predecessor.
    number = _FIRST_NEW_MODULE + (seed + seed // 9) % _MAX_NEW_MODULES
    module = write_module(robot.folder / "modules", number, f"1.0.{seed}", skills)
    try:
        _require_proved(
            verify([robot.folder / "modules"], robot.site, store=robot.store, detail=Detail.BRIEF)
        )
    finally:
        shutil.rmtree(module)


def _errand(robot: _Installation, seed: int) -> _TaskCase:
    """Choose a task at random."""
    modules = [ecm for ecm in robot.configuration.modules.values() if ecm.tasks]
    ecm: Ecm = Random(seed).choice(modules)  # noqa: S311  no secret
    (task,) = ecm.tasks.values()
    site = robot.configuration.site
    readings = SymbolicPlant(site, {ecm.id: ecm}, 0, to_doubles(task.start)).observe()
    return _TaskCase(
        RoutedTask(ecm.id, task),
        task.trigger_phrases[0],
        readings,
        world_from_readings(site.state, readings, 0.0),
    )


def _cpu_seconds(done: Callable[[], Any], times: int = 1) -> float:
    """Measure the processor time of one call, s, as the mean of `times` calls."""
    began = time.process_time()
    for _ in range(times):
        done()
    return (time.process_time() - began) / times


KIND: Final = ScaleTrials()
