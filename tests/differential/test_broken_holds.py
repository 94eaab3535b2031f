"""The agent's own loop reaches no unexplored state, even if hold-conditions break at any time.

What breaks is drawn here and not from `aeros.spec.model.hold_conditions`: the skill is halted before it has
done anything, or
after it has done all of an outcome, and what its condition reads is then anything that some skill sets.
"""

from __future__ import annotations

import random
from collections import Counter
from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.ports import StepRequest, StepResult, StepStatus
from aeros.spec.closed_loop.reachability import explore_task
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import ActionCondition, Ecm, Skill
from aeros.spec.model.hold_conditions import start_condition
from aeros.spec.model.rules import Conjunct
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.closed_loop import closed_loop_obligations
from aeros.spec.obligations.verdicts import StaticClaim
from tests.differential.planning.small_tasks import Case, loops
from tests.differential.real_loop import Recording, pursue
from tests.hypothesis_profiles import examples
from tests.unit.agent.dumplings import PREDICATES, SPAN, term

_NOT = [f"not {name}" for name in PREDICATES]
_HELD = st.sampled_from([*_NOT, PREDICATES[0], "area == table", f"{_NOT[2]} and area == table"])
_SEEN: Counter[str] = Counter()


class Slipping(Recording):
    """A runtime in which hold-conditions break as `drawn` says."""

    def __init__(self, case: Case, ecm: Ecm, drawn: random.Random) -> None:
        super().__init__(ecm, case.site, case.start, lambda skill, outcomes: drawn.choice(outcomes))
        self.drawn = drawn
        rules = case.task.rules
        used = {name for one in rules for name in (one.skill, one.between_tries, one.on_failure)}
        runs = [ecm.skills[name] for name in used if name]
        self.settable = {name for one in runs for o in one.outcomes.values() for name in o.effects}

    def submit(self, request: StepRequest) -> StepResult:
        skill = self.modules[request.module].skills[request.skill]
        if skill.hold_condition is None or self.drawn.random() < 0.3:
            possible = [one.id for one in skill.outcomes.values() if one.probability != 0]
            self.chance = lambda name, outcomes: self.drawn.choice(possible)
            return super().submit(request)
        done = self.drawn.choice([{}, *(o.effects for o in skill.outcomes.values() if o.probability != 0)])
        self.state |= done
        for name in t.variables_of(skill.hold_condition.term).keys() & self.settable:
            self.state[name] = self.drawn.choice(("table", "pot") if name == "area" else (False, True))
        self.submitted.append(request.skill)
        self.clock += 1.0
        self.states.append(dict(self.state))
        return StepResult(StepStatus.HOLD_LOST, "it slipped", allowed=1)


def held(skill: Skill, text: str) -> Skill:
    clause = ActionCondition(term(text), text, SPAN, (Conjunct(term(text), SPAN),))
    return replace(skill, hold_condition=clause, precondition=start_condition(skill.precondition, clause))


def test_the_loop_comes_to_no_state_that_was_not_explored() -> None:
    _walked()
    assert _SEEN["broken"] > 30
    assert _SEEN["proved"] > 10


@examples(60)
@given(loops(), st.dictionaries(st.integers(0, 4), _HELD, min_size=1, max_size=3), st.integers(0, 2**32))
def _walked(case: Case, held_to: dict[int, str], seed: int) -> None:
    names = list(case.ecm.skills)
    changed = {
        names[at]: held(case.ecm.skills[names[at]], text) for at, text in held_to.items() if at < len(names)
    }
    ecm = replace(case.ecm, skills={**case.ecm.skills, **changed})
    explored = explore_task(ecm, case.task, case.site)
    states = {node.state for node in explored.graph}
    claims = (one for one in closed_loop_obligations(ecm, case.site) if isinstance(one, StaticClaim))
    refused = {one.id for one in claims if one.diagnostic is not None}
    limits = replace(case.site.limits, replans=2)
    again = replace(case, site=replace(case.site, limits=limits))
    for number in range(8):
        runtime = Slipping(again, ecm, random.Random(f"{seed} {number}"))  # noqa: S311
        report = pursue(ecm, case.task, runtime)
        for state in runtime.states:
            assert tuple(state[name] for name in explored.system.names) in states
        _SEEN["broken"] += sum(step.status is StepStatus.HOLD_LOST for step in report.steps)
        assert "broken-assumption" not in runtime.kinds()
        if not any(one.form is ClaimForm.RULES_DISPATCH for one in refused):
            _SEEN["proved"] += 1
            assert _first_tries_all_started(runtime)


def _first_tries_all_started(runtime: Recording) -> bool:
    """Return true if every step of every plan could start at its first try."""
    return all(details["role"] != "step" for kind, details in runtime.notes if kind == "step-not-started")
