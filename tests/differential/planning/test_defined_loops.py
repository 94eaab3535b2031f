"""A predicate with a definition, and the definition written in its place, give loops with equal verdicts."""

from __future__ import annotations

from dataclasses import replace
from random import Random

import pytest

from aeros.spec.closed_loop.definition_facts import DefinitionFacts, OutcomeValues
from aeros.spec.closed_loop.findings import LoopFindings
from aeros.spec.closed_loop.reachability import ReachableStates, explore_system
from aeros.spec.closed_loop.symbolic.analysis import SymbolicLoop
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.expr import terms as t
from aeros.spec.model.ecm import Outcome, Skill
from aeros.spec.model.perception import Definition
from aeros.spec.obligations.closed_loop import certificate_obligations
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.discharge import discharge_obligations
from tests.differential.planning.number_loops import Loop, number_loop, term
from tests.unit.agent.dumplings import SPAN

_FLAG = "dumpling_wrapped"
_AT_GOAL = 2  # the place of "starts at the goal" among the verdicts
_DEFINITIONS = (
    "count >= 3",
    "not (count == 1)",
    "fill_level > 0.5",
    "abs(fill_level - 0.5) < 0.25",
    "count < 2 or fill_level <= 0.2",
    "count >= 2 and fill_level > 0.2",
)


def defined_loop(seed: int) -> tuple[Loop, t.Term]:
    """A random loop with a definition for a flag that no outcome states and no start, and the definition."""
    ecm, task, site = number_loop(seed)
    text = Random(seed).choice(_DEFINITIONS)  # noqa: S311  cases of a test
    skills = {name: _without_flag(one) for name, one in ecm.skills.items()}
    initial = {name: value for name, value in task.initial.items() if name != _FLAG}
    task = replace(task, initial=initial)
    definitions = {_FLAG: Definition(term(text), text, SPAN)}
    ecm = replace(ecm, skills=skills, tasks={task.id: task}, definitions=definitions)
    return (ecm, task, site), term(text)


def _without_flag(skill: Skill) -> Skill:
    def without(outcome: Outcome) -> Outcome:
        return replace(outcome, effects={n: one for n, one in outcome.effects.items() if n != _FLAG})

    return replace(skill, outcomes={name: without(one) for name, one in skill.outcomes.items()})


def written_out(loop: Loop, definition: t.Term) -> Loop:
    """The same loop without the flag: its definition stands wherever it is read."""
    ecm, task, site = loop

    def inserted(condition: t.Term) -> t.Term:
        return t.substitute(condition, {_FLAG: definition})

    def skill_without(skill: Skill) -> Skill:
        clause = skill.precondition
        return (
            skill
            if clause is None
            else replace(skill, precondition=replace(clause, term=inserted(clause.term)))
        )

    task = replace(
        task,
        goal=inserted(task.goal),
        rules=tuple(
            replace(one, satisfied_condition=inserted(one.satisfied_condition)) for one in task.rules
        ),
        invariants=tuple(replace(one, term=inserted(one.term)) for one in task.invariants),
    )
    skills = {name: skill_without(one) for name, one in ecm.skills.items()}
    return replace(ecm, skills=skills, tasks={task.id: task}, definitions={}), task, site


def verdicts(found: LoopFindings) -> list[bool]:
    """For each kind of fault, if there is none, and if the goal holds at every start."""
    return [
        found.blocked_step() is None,
        found.dead_end() is None,
        found.starts_at_goal(),
        *(found.violation(one) is None for one in found.system.task.invariants),
    ]


def listed(loop: Loop) -> ReachableStates:
    """The states of a loop; each of these loops has few enough to list them."""
    return explore_system(TransitionSystem(*loop))


@pytest.mark.parametrize("seed", range(150))
def test_a_definition_has_the_meaning_of_its_text(seed: int) -> None:
    loop, definition = defined_loop(seed)
    found, without = listed(loop), listed(written_out(loop, definition))
    expected = verdicts(without)
    assert verdicts(found) == expected
    assert verdicts(SymbolicLoop(TransitionSystem(*loop))) == expected


@pytest.mark.parametrize("seed", range(150))
def test_each_reachable_state_agrees_with_the_definition(seed: int) -> None:
    loop, definition = defined_loop(seed)
    found = listed(loop)
    variables = found.system.variables
    facts = [found.system.condition(one) for one in variables.facts.equivalences(variables.variables)]
    assert len(facts) == ({_FLAG, *t.variables_of(definition)} <= variables.variables.keys())
    assert all(holds(node.state) for node in found.graph for holds in facts)


def test_without_definitions_some_loops_would_be_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(DefinitionFacts, "after", lambda _, __, opened, ___: OutcomeValues(opened, {}, ()))
    monkeypatch.setattr(DefinitionFacts, "equivalences", lambda _, __: ())
    pairs = [(loop, written_out(loop, definition)) for loop, definition in map(defined_loop, range(60))]
    refused = [
        [
            proved
            for proved, expected in zip(*map(verdicts, map(listed, pair)), strict=True)
            if proved < expected
        ]
        for pair in pairs
    ]
    assert any(refused)


@pytest.mark.parametrize("seed", range(60))
def test_certificates_of_loops_with_definitions_are_proved(seed: int) -> None:
    loop, _ = defined_loop(seed)
    found = SymbolicLoop(TransitionSystem(*loop))
    if not all(one for number, one in enumerate(verdicts(found)) if number != _AT_GOAL):
        return
    obligations = certificate_obligations(loop[1], found.certificate())
    assert {one.verdict for one in discharge_obligations(obligations)} == {Verdict.PROVED}
