"""Trials of AEROS with many modules: what it takes to install one more, to find one, to decide and to plan.

Settings of a condition: `modules`, how many synthetic ones there are; `skills`, of each.  They are proved
from nothing and compiled once for some twenty trials, each of which says how long that took; the rest it
measures itself.  All times are of this process's processor, so that what else the machine does falls on them
least; none of them is predicted, and none is twice the same.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any, Final, NamedTuple

from aeros.agent.planning.base import RulePlanner
from aeros.agent.planning.routing import Routed, route
from aeros.agent.planning.smt import SmtPlanner
from aeros.agent.world.world import World, measured_world
from aeros.experiments.condition import Condition
from aeros.experiments.inputs import Premises
from aeros.experiments.trial_kinds import RAM, Found, Trial
from aeros.experiments.trials.synthetic import write_module, write_modules
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Verdict
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.ports import Readings
from aeros.runtime.proving import configuration_of
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.skill import act
from aeros.spec.backends.answer_store import Store
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.expr.doubles import as_doubles
from aeros.spec.model.model import Ecm
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.text.discovery import reference_site
from aeros.spec.verification.reports import Report
from aeros.spec.verification.verify import Detail, verify

_TIMES: Final = 200
"""How often what takes microseconds is done for one measurement."""

_FURTHER: Final = 1000
"""The number of the first module that a trial installs: of none that is there."""

_FURTHER_AT_MOST: Final = 890
"""How many of these trials install: of the second thousand all but those that depend on another."""

_GRIP: Final = act("grip", width=0.03, force=1.0)
"""An action that every synthetic skill may ask for."""


@dataclass(frozen=True)
class _Robot:
    """Proved and compiled modules, and what was proved of them kept as `aeros verify` keeps it.

    proving, compiling: processor time of each, from nothing, s.
    """

    folder: Path
    store: Store
    site: Path
    configuration: Configuration
    gate: CompiledGate
    proving: float
    compiling: float


class _Errand(NamedTuple):
    """A task of one of the modules, and what is measured where it begins."""

    routed: Routed
    words: str
    readings: Readings
    world: World


class Scale:
    """See `kinds.Kind`."""

    @contextmanager
    def opened(self, condition: Condition, premises: Premises) -> Iterator[Trial]:
        """The modules are proved and compiled once."""
        settings = condition.settings
        skills = settings["skills"]
        with tempfile.TemporaryDirectory(dir=RAM) as folder:
            robot = _robot(Path(folder), settings["modules"], skills, premises.where.site)
            with closing(robot.store):
                yield lambda seed: _tried(robot, skills, seed)

    def expected(self, condition: Condition, premises: Premises) -> Mapping[str, float] | str:
        """Only that what is found is found whatever else there is."""
        return {"success": 1.0}


def _tried(robot: _Robot, skills: int, seed: int) -> Found:
    """What one trial finds."""
    began = time.process_time()
    errand = _errand(robot, seed)
    caller = Caller(errand.routed.module, "skill_0", {})
    unused = {quota.id: 0 for quota in robot.configuration.site.quotas}
    verdict = robot.gate.decide(caller, errand.readings, _GRIP, 0.0, unused).verdict
    modules = robot.configuration.modules
    rules, shortest = RulePlanner(), SmtPlanner(robot.configuration.site)
    found = {
        "installing_s": _seconds(lambda: _install_one_more(robot, skills, seed)),
        "lookup_us": 1e6 * _seconds(lambda: route(errand.words, modules), _TIMES),
        "decide_us": 1e6
        * _seconds(lambda: robot.gate.decide(caller, errand.readings, _GRIP, 0.0, unused), _TIMES),
        "rules_us": 1e6 * _seconds(lambda: rules.plan(errand.routed, errand.world, modules), _TIMES),
        "shortest_ms": 1e3 * _seconds(lambda: shortest.plan(errand.routed, errand.world, modules)),
        "proving_s": robot.proving,
        "compiling_s": robot.compiling,
    }
    right = verdict is Verdict.ALLOW and route(errand.words, modules) == errand.routed
    return {**found, "reached": right, "processor_s": time.process_time() - began}


def _robot(folder: Path, count: int, skills: int, given: str | None) -> _Robot:
    site = reference_site() if given is None else Path(given)
    paths = write_modules(folder / "modules", count, skills)
    store = Store(folder / "proved.sqlite3")
    began = time.process_time()
    report = _proved(verify(paths, site, store=store, detail=Detail.BRIEF))
    proving = time.process_time() - began
    configuration = configuration_of(report, site)
    began = time.process_time()
    gate = CompiledGate(configuration)
    return _Robot(folder, store, site, configuration, gate, proving, time.process_time() - began)


def _proved(report: Report) -> Report:
    if report.conclusion is not Conclusion.PROVED:
        raise MisuseError(
            "the synthetic modules are not proved under this site; they are made for AEROS's own"
        )
    return report


def _install_one_more(robot: _Robot, skills: int, seed: int) -> None:
    """Prove a module that nobody knows beside those that are proved, as `aeros verify` does."""
    # Not one in ten, which would depend on its predecessor.
    number = _FURTHER + (seed + seed // 9) % _FURTHER_AT_MOST
    module = write_module(robot.folder / "modules", number, f"1.0.{seed}", skills)
    try:
        _proved(verify([robot.folder / "modules"], robot.site, store=robot.store, detail=Detail.BRIEF))
    finally:
        shutil.rmtree(module)


def _errand(robot: _Robot, seed: int) -> _Errand:
    """A task by chance."""
    modules = [ecm for ecm in robot.configuration.modules.values() if ecm.tasks]
    ecm: Ecm = Random(seed).choice(modules)  # noqa: S311  no secret
    (task,) = ecm.tasks.values()
    site = robot.configuration.site
    readings = SymbolicPlant(site, {ecm.id: ecm}, 0, as_doubles(task.initial)).observe()
    return _Errand(Routed(ecm.id, task), task.words[0], readings, measured_world(site.state, readings, 0.0))


def _seconds(done: Callable[[], Any], times: int = 1) -> float:
    """Of processor, that it takes once."""
    began = time.process_time()
    for _ in range(times):
        done()
    return (time.process_time() - began) / times


KIND: Final = Scale()
