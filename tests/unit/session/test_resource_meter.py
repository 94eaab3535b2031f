"""The use of resources of modules is measured beside its limits, and changes no run."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

import aeros
from aeros.runtime.perception.perceiver_run import ViewInput
from aeros.runtime.ports import StepStatus
from aeros.runtime.skills.in_process_run import SkillRunResult
from aeros.session.resource_meter import PERIOD_S, ResourceMeter
from aeros.skill import Action, act
from aeros.spec.model.policy import WorkerLimits
from tests.repo.tree import ROOT
from tests.unit.runtime.bench import configuration
from tests.unit.runtime.perception.kettle import configuration as kettle_configuration
from tests.unit.runtime.perception.kettle import kettle

VIEW = ViewInput(0.0, {}, {}, {})


class Clock:
    """Real time that goes on when code runs."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


class Code:
    """Runs of skills and perceivers that take these times."""

    def __init__(self, clock: Clock, *seconds: float) -> None:
        self._clock, self._seconds = clock, list(seconds)
        self.closed = 0

    def resume(
        self, observation: Mapping[str, Any], seconds: float, denial: str = ""
    ) -> Action | SkillRunResult:
        self._clock.now += self._seconds.pop(0)
        if not self._seconds:
            return SkillRunResult(StepStatus.RAISED, "it failed")
        return act("wait", duration=1.0)

    def perceive(self, view: ViewInput, seconds: float) -> dict[str, Any]:
        self._clock.now += self._seconds.pop(0)
        if not self._seconds:
            raise ValueError("it failed")
        return {}

    def close(self) -> None:
        self.closed += 1


def test_answers_and_processes_of_skills_are_counted() -> None:
    clock = Clock()
    found = configuration()
    (ecm, *_) = found.modules.values()
    skill = next(iter(ecm.skills.values()))
    code = Code(clock, 0.1, 0.3, 0.2)
    meter = ResourceMeter(found, lambda *_: code, lambda *_: code, clock)
    first = meter.usage(False)
    assert first is not None
    assert first[ecm.id]["processes"] == {"running": 0, "started": 0}
    run = meter.open_run(found.site, ecm, skill, {})
    for _ in range(3):
        run.resume({}, 60.0)
    latest = meter.usage(True)
    assert latest is not None
    assert latest[ecm.id]["processes"] == {"running": 1, "started": 1}
    assert latest[ecm.id]["answer"]["longest"] == pytest.approx(0.3)
    run.close()
    run.close()
    ended = meter.usage(True)
    assert ended is not None
    assert ended[ecm.id]["processes"] == {"running": 0, "started": 1}
    assert code.closed == 2


def test_limits_are_those_in_force_and_trusted_code_has_none() -> None:
    found, clock = configuration(), Clock()
    (ecm, *_) = found.modules.values()
    code = Code(clock, 1.0)
    meter = ResourceMeter(found, lambda *_: code, lambda *_: code, clock)
    own = replace(ecm, worker=WorkerLimits(2**20, Fraction(1)))
    meter.open_run(found.site, own, next(iter(ecm.skills.values())), {})
    use = (meter.usage(True) or {})[ecm.id]
    assert (use["memory"]["at_most"], use["answer"]["at_most"], use["is_isolated"]) == (2**20, 1.0, True)
    trusting = replace(
        found.site, isolation=replace(found.site.isolation, trusted_modules=frozenset({ecm.id}))
    )
    meter.open_run(trusting, own, next(iter(ecm.skills.values())), {})
    use = (meter.usage(True) or {})[ecm.id]
    assert (use["memory"]["at_most"], use["answer"]["at_most"], use["is_isolated"]) == (None, None, False)
    assert use["processes"]["started"] == 2


def test_calls_of_a_perceiver_are_timed_also_where_they_fail() -> None:
    ecm, clock = kettle(), Clock()
    found, name = kettle_configuration(ecm), ecm.id
    (perceiver, *_) = ecm.perceivers.values()
    code = Code(clock, 0.1, 0.4)
    meter = ResourceMeter(found, lambda *_: code, lambda *_: code, clock)
    run = meter.open_perceiver(found.site, ecm, perceiver)
    run.perceive(VIEW, 1.0)
    with pytest.raises(ValueError, match="it failed"):
        run.perceive(VIEW, 1.0)
    use = (meter.usage(True) or {})[name]["perceivers"][perceiver.id]
    assert use["answer"] == {"longest": pytest.approx(0.4), "at_most": float(perceiver.timeout)}
    assert use["memory"]["at_most"] == perceiver.memory
    run.close()
    assert (meter.usage(True) or {})[name]["perceivers"][perceiver.id]["processes"]["running"] == 0


def test_memory_is_not_read_more_often_than_needed() -> None:
    clock = Clock()
    meter = ResourceMeter(configuration(), lambda *_: Code(clock), lambda *_: Code(clock), clock)
    assert meter.usage(False) is not None
    assert meter.usage(False) is None
    assert meter.usage(True) is not None
    clock.now += PERIOD_S
    assert meter.usage(False) is not None


def test_a_session_publishes_what_its_modules_used(tmp_path: Path) -> None:
    with aeros.open_session(ROOT / "ecms" / "clean_table", out=tmp_path / "run") as session:
        session.run("clean the table")
    lines = [json.loads(line) for line in (tmp_path / "run" / "measured.jsonl").read_text().splitlines()]
    use = lines[-1]["modules"]["clean_table"]
    assert use["is_isolated"] is True
    # A small skill may need no page beyond those of its interpreter.
    assert 0 <= use["memory"]["used"] < use["memory"]["at_most"]
    assert 0 < use["answer"]["longest"] < use["answer"]["at_most"]
    assert use["processes"]["started"] >= 3
    assert use["processes"]["running"] == 0
