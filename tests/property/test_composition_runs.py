"""Proofs of a composition hold when it is run, whatever the results of its steps, in any order.

Where every claim about it is proved, nothing ends it but a declared failure for which nothing more is to be
tried: no step that may not start, no condition without an alternative.  And its branches are a plan iff the
finite claims about them are proved.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from math import inf
from typing import Any

from hypothesis import given, seed
from hypothesis import strategies as st

from aeros.agent.execution.journal import Journal
from aeros.agent.execution.plan_executor import PlanExecutor
from aeros.agent.execution.step_attempt import StepRunner
from aeros.agent.planning.compositions import composition_to_graph
from aeros.agent.planning.task_graph import verify_plan
from aeros.runtime.ports import EndedStep, StepRequest, StepResult, StepStatus
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.composition import Composition
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.site import Site
from tests.differential.real_loop import Forgetful
from tests.hypothesis_profiles import PROFILE, examples
from tests.property.mix import Mix
from tests.property.test_compositions import (
    STATE,
    STATES,
    UNIT,
    _compositions,
    _module,
    _refuted,
    _site,
    _skills,
)
from tests.unit.agent.fake_runtime import FakeRuntime

MEASURED = {name: replace(one, max_age=Fraction(1)) for name, one in STATE.items()}
SITE = _site(state=MEASURED)
SKILLS = ("s0", "s1", "s2", "s3")
PLANS, RUNS = Mix(), Counter[str]()


class Chance(FakeRuntime):
    """Steps end in any order, with any outcome that may happen; `v` is anything meanwhile.

    A condition that is held for a step may be lost at any time.  A step that is cancelled has done nothing,
    or all of an outcome.
    """

    def __init__(self, module: Ecm, site: Site, start: Mapping[str, Any], seed: int) -> None:
        self.random = random.Random(seed)  # noqa: S311 - to choose, not to keep secrets
        self.module = module
        self.most = 0  # under way at the same time
        super().__init__({module.id: module}, chance=self._chosen, at=site)
        self.state = dict(start)

    def _chosen(self, skill: str, _: list[str]) -> str:
        outcomes = self.module.skills[skill].outcomes.values()
        return self.random.choice([one.id for one in outcomes if one.probability != 0])

    def wait(self, until: float = inf) -> EndedStep | None:
        self.most = max(self.most, len(self.under_way))
        keep = list(self.under_way.items())
        self.random.shuffle(keep)
        self.under_way = dict(keep)
        self.state["v"] = self.random.choice([Fraction(0), Fraction(1)])
        for handle, request in keep:
            if handle in self.cancelled:
                self._stop_midway(request)
            elif request.held and self.random.random() < 0.2:
                self._stop_midway(request)
                lost = self.random.randrange(len(request.held))
                for name in t.variables_of(request.held[lost].term):
                    values = UNIT if name == "v" else (False, True)
                    self.state[name] = self.random.choice(values)
                del self.under_way[handle]
                return EndedStep(handle, StepResult(StepStatus.CANCELLED, "is not held", lost_hold=lost))
        return super().wait(until)

    def _stop_midway(self, request: StepRequest) -> None:
        outcomes = self.module.skills[request.skill].outcomes.values()
        effects = [{}, *(one.effects for one in outcomes if one.probability != 0)]
        self.state |= self.random.choice(effects)


def _ends(
    module: Ecm, composition: Composition, start: Mapping[str, Any], seed: int
) -> tuple[str | None, Chance]:
    """Return why the run failed; None if it did not."""
    runtime = Chance(module, SITE, start, seed)
    memory = Forgetful()
    journal = Journal(runtime, memory, None)
    engine = PlanExecutor(StepRunner(runtime, memory, journal, "task"), journal, lambda: False)
    end = engine.run(composition_to_graph(composition, module.id).body)
    return None if end is None else end.reason, runtime


def _proved_claims_hold(
    composition: Composition, skills: dict[str, Skill], anytime: frozenset[str], seed: int
) -> None:
    # As drawn, hardly one is proved.
    skills = {
        name: replace(one, precondition=None) if name in anytime else one for name, one in skills.items()
    }
    module = replace(_module(skills, composition), id="module")
    _, refuted = _refuted(module, _site())
    finite = {id_ for id_ in refuted if "/par-" in id_}
    problems = verify_plan(composition_to_graph(composition, "module"), {"module": module}, SITE)
    PLANS.compare("plan", proved=not finite, expected=problems == [])
    if any(part in id_ for id_ in refuted for part in ("/par-", "/ready", "/covers")):
        return
    for number, start in enumerate(one for one in STATES if is_true(composition.precondition, one)):
        why, runtime = _ends(module, composition, start, seed + number)
        assert runtime.under_way == {}
        assert "step-not-started" not in runtime.kinds(), why
        words = ("failed: outcome `", "is not held", "time of this part", "matches no declared outcome")
        assert why is None or why == "`v` is not met" or any(one in why for one in words)
        RUNS["done" if why is None else "failed"] += 1
        RUNS["not held"] += why is not None and "is not held" in why
        RUNS["late"] += why is not None and "time of this part" in why
        RUNS["cancelled"] += sum(note.get("status") == "cancelled" for _, note in runtime.notes)
        RUNS["at the same time"] += runtime.most > 1


_DRAWN = (_skills(), st.frozensets(st.sampled_from(SKILLS)), st.integers(0, 2**32))
_plain = examples(200, report_multiple_bugs=False)(
    given(_compositions(pars_anywhere=True), *_DRAWN)(_proved_claims_hold)
)
_stoppable = examples(120, report_multiple_bugs=False)(
    given(_compositions(pars_anywhere=True, has_stops=True), *_DRAWN)(_proved_claims_hold)
)


def test_proved_claims_hold_in_runs() -> None:
    # Few draws have a step that is cancelled: these do, and each night's are new.
    run = seed(8)(_plain) if PROFILE == "ci" else _plain
    RUNS.clear()
    run()
    # Both verdicts and every kind of run occurred often enough.
    PLANS.assert_both("plan")
    assert min(RUNS[kind] for kind in ("done", "failed", "at the same time")) > 10, RUNS
    assert RUNS["cancelled"] > 0


def test_proved_claims_hold_in_runs_that_are_stopped_midway() -> None:
    run = seed(8)(_stoppable) if PROFILE == "ci" else _stoppable
    RUNS.clear()
    run()
    assert min(RUNS[kind] for kind in ("done", "failed", "not held")) > 10, RUNS
    assert min(RUNS["cancelled"], RUNS["late"]) > 0, RUNS
