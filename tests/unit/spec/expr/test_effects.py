"""All planners, the closed loop, the supervisor and the symbolic plant give an effect the same meaning."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.execution.supervisor import StepAssessment, assess_step
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.runtime.ports import Reading, StepResult, StepStatus
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.spec.closed_loop.reachability import explore_task
from aeros.spec.expr import terms as t
from aeros.spec.expr.effects import (
    Increment,
    QuantityRange,
    state_after,
    value_after,
    values_reached,
)
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import LENGTH
from aeros.spec.flow.symbolic_paths import explore_paths
from aeros.spec.planning.bounded import bounded_plan
from aeros.spec.planning.domain import domain_for
from aeros.spec.planning.pddl import write_pddl
from aeros.spec.planning.search_result import AvoidSet
from aeros.spec.planning.shortest import DeleteRelaxation, breadth_first_plan
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy
from aeros.spec.planning.unreachability import unreachability_reasons
from tests.unit.spec.counting import AT_EDGE, ID, NUMBER, PLACE, WASHED, counting, counting_domain

ONE, TWO, THREE = map(Fraction, (1, 2, 3))
FINISHED = StepResult(StepStatus.FINISHED, "")


def test_an_increment_counts_from_the_value_before() -> None:
    assert value_after(Increment(TWO), ONE) == 3
    assert value_after(Increment(-ONE), ONE) == 0
    assert value_after(Increment(ONE), None) is None
    assert value_after("pot", "table") == "pot"
    assert state_after({"n": Increment(ONE), "m": Increment(ONE), "on": True}, {"n": ONE}) == {
        "n": 2,
        "m": None,
        "on": True,
    }
    assert (str(Increment(ONE)), str(Increment(-TWO))) == ("+= 1", "-= 2")
    assert values_reached([Increment(ONE), ONE], (ONE, THREE)) == (1, 2, 3)
    assert values_reached([True, False, True], None) == (True, False)


@given(st.fractions(-2, 2), st.sampled_from([None, 0, 1, 2]))
def test_a_range_contains_what_its_condition_admits(value: Fraction, axis: int | None) -> None:
    one = QuantityRange("p", axis, Fraction(-1, 2), ONE)
    _, site = counting()
    declared = site.state[PLACE].variable
    whole: Any = value if axis is None else tuple(value if at == axis else Fraction(9) for at in range(3))
    if axis is not None:
        assert is_true(one.term(declared), {PLACE: whole}) is one.contains(whole)
    assert one.contains(whole) is (Fraction(-1, 2) <= value <= 1)
    assert one.contains(one.middle_of(whole))


# Planners and proofs.


@pytest.mark.parametrize("number", [1, 2, 3])
def test_all_planners_count(number: int) -> None:
    domain = counting_domain(number)
    start = domain.state({WASHED: Fraction(0), AT_EDGE: True})
    wanted = [f"{ID}.wash"] * number
    shortest = breadth_first_plan(domain, start, AvoidSet(), 100)
    assert shortest is not None
    assert [choice.name for _, choice in shortest] == wanted
    assert [choice.name for _, choice in bounded_plan(domain, start, AvoidSet(), 0)] == wanted
    assert StrongCyclicStrategy(domain).solves(start)
    assert DeleteRelaxation(domain, start).steps_to_goal == number


def test_an_unknown_number_stays_unknown_and_reaches_no_goal() -> None:
    domain = counting_domain(1)
    assert breadth_first_plan(domain, domain.state({AT_EDGE: True}), AvoidSet(), 100) is None


def test_pddl_has_an_effect_for_each_number_before() -> None:
    domain = counting_domain(2)
    text, problem = write_pddl(domain, domain.state({WASHED: Fraction(0), AT_EDGE: True}))
    assert text.count(f"(when ({ID}--washed-is-") == 3
    assert f"(when ({ID}--washed-is-2) (and (not ({ID}--washed-is-2)) ({ID}--washed-is-3)))" in text
    assert f"({ID}--washed-is-0)" in problem


def test_a_quantity_in_a_range_is_unknown_to_plans() -> None:
    ecm, site = counting()
    place = t.Component(site.state[PLACE].variable, 1)
    goal = t.Compare("<=", t.Literal(Fraction(0), RealType(LENGTH)), place)
    domain = domain_for({ID: ecm}, site, {PLACE: (ONE, ONE, ONE), AT_EDGE: True}, goal)
    reasons = unreachability_reasons(domain, domain.state({AT_EDGE: True}))
    assert f"`{ID}.push` leaves `{PLACE}` in a range" in reasons


def test_the_closed_loop_counts_from_every_start_and_for_every_number() -> None:
    ecm, site = counting()
    reachable = explore_task(ecm, ecm.tasks["wash"], site)
    names = reachable.system.names
    at = {name: names.index(name) for name in (WASHED, NUMBER, AT_EDGE)}
    reached = {node.state for node in reachable.graph if node.phase == "reached"}
    assert {(state[at[NUMBER]], state[at[WASHED]]) for state in reached} == {(1, 1), (2, 2), (3, 3)}


def test_paths_of_a_composition_count_from_the_value_at_the_start() -> None:
    ecm, site = counting()
    paths = explore_paths(ecm.compositions["wash_two"], ecm.callable_skills, site.state)
    second = {dict(one.assignment).get(WASHED) for one in paths.states_at_steps["second"]}
    assert second == {Increment(ONE)}
    assert {dict(one.assignment)[WASHED] for one in paths.final_states} == {Increment(TWO)}
    (situation,) = paths.final_states
    washed = site.state[WASHED].variable
    term = situation.condition(t.Compare("==", washed, t.Literal(THREE, washed.type)), site.state)  # type: ignore[arg-type]
    assert [is_true(term, {WASHED: Fraction(n)}) for n in range(3)] == [False, True, False]


# The run.


def assessed(skill: str, before: dict[str, Any] | None, **after: Any) -> StepAssessment:
    ecm, _ = counting()
    return assess_step(ID, ecm.skills[skill], FINISHED, world(**after), before)


def world(**values: Any) -> WorldModel:
    _, site = counting()
    readings = {f"{ID}.{name}": Reading(value, 0.0) for name, value in values.items()}
    return world_from_readings(site.state, readings, 0.0)


def test_one_more_is_measured_as_a_success() -> None:
    assert assessed("wash", {WASHED: 1.0}, washed=2).outcome == "done"
    assert assessed("wash", {WASHED: 1.0}, washed=1).outcome == "dropped"
    # Two more is none of the outcomes with an effect, so it counts as the one without.
    assert assessed("wash", {WASHED: 1.0}, washed=3).outcome == "dropped"


def test_a_place_in_the_range_is_measured_as_the_outcome_with_that_range() -> None:
    for y, at_edge, outcome in ((0.40, True, "pushed"), (0.35, False, "short")):
        found = assessed("push", {}, sponge_position=(0.5, y, 0.0), sponge_at_edge=at_edge)
        assert (found.outcome, found.is_undeclared) == (outcome, False)
    outside = assessed("push", {}, sponge_position=(0.5, 0.5, 0.0), sponge_at_edge=True)
    assert outside.is_undeclared
    assert any(
        one.value == 0.5 and one.quantity == f"{PLACE}.y"
        for cause in outside.causes
        for one in cause.shortfalls
    )


def test_a_number_that_was_unknown_before_decides_no_outcome() -> None:
    assert assessed("push", {}, sponge_at_edge=True).is_unknown
    assert assessed("wash", None, washed=2).outcome == "dropped"


def test_the_symbolic_plant_counts_and_puts_a_quantity_into_its_range() -> None:
    ecm, site = counting()
    seeds = range(4)
    for seed in seeds:
        plant = SymbolicPlant(site, {ID: ecm}, seed, {PLACE: (0.5, 0.1, 0.0)})
        for skill in ("wash", "wash", "push"):
            plant.skill_began(f"{ID}.{skill}")
            plant.skill_ended(f"{ID}.{skill}", finished=True)
        drawn = [one.outcome for one in plant.drawn_outcomes()]
        seen = {name: reading.value for name, reading in plant.observe().items()}
        assert seen[WASHED] == drawn.count("done")
        assert seen[AT_EDGE] is ("pushed" in drawn)
        assert seen[PLACE] == (0.5, pytest.approx(0.4075 if "pushed" in drawn else 0.3445), 0.0)
