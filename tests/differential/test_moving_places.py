"""Closed loop, compositions and planners against a robot on a line, whose places are enumerated.

What they say of predicates by definition must cover all that this robot may do.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from fractions import Fraction
from itertools import product

from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.closed_loop.invocation import Invocation, State
from aeros.spec.consequences.consequences import value_that_follows, with_consequences
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.flow.symbolic_paths import explore_paths
from aeros.spec.model.composition import STOP_ON_FAILURE, Composition, Step
from aeros.spec.model.ecm import Outcome, Skill
from aeros.spec.model.step_graph import Seq
from aeros.spec.planning.bounded import bounded_plan
from aeros.spec.planning.domain import PlanningDomain, domain_for
from aeros.spec.planning.pddl import write_pddl
from aeros.spec.planning.search_result import AvoidSet
from aeros.spec.planning.shortest import breadth_first_plan
from tests.differential.moving_places import DEFINED, NAMES, PLACES, World, values_of, worlds
from tests.differential.planning.test_pddl import shortest
from tests.hypothesis_profiles import examples
from tests.unit.agent.dumplings import SPAN, state

Standing = tuple[Fraction, dict[str, bool]]


def endings(world: World, one: Skill, standing: Standing) -> Iterator[tuple[Outcome, Standing]]:
    """All ends of a skill, each with the outcome that is measured there."""
    for drawn in one.outcomes.values():
        for place, values in world.endings(one, drawn, *standing):
            measured = [
                each
                for each in one.outcomes.values()
                if all(values[name] == value for name, value in each.effects.items())
            ]
            yield max(measured, key=lambda each: (len(each.effects), not each.failure)), (place, values)


def conjunction(names: list[str]) -> t.Term:
    return t.conjunction(*(state(name).variable for name in names))


@examples(60)
@given(worlds())
def test_a_value_follows_where_all_places_that_fit_the_effects_have_it(world: World) -> None:
    for one in world.ecm.skills.values():
        for outcome in one.outcomes.values():
            fitting = [
                found
                for found in map(world.predicates, PLACES)
                if all(found.get(name, value) == value for name, value in outcome.effects.items())
            ]
            for name in DEFINED:
                if name not in outcome.effects and not outcome.effects.keys().isdisjoint(DEFINED):
                    values = {found[name] for found in fitting}
                    expected = values.pop() if len(values) == 1 else None
                    found = value_that_follows(name, outcome, world.ecm.definitions, world.site.state)
                    assert found is expected


@examples(60)
@given(worlds())
def test_the_closed_loop_knows_every_end_and_the_outcome_that_is_measured_there(world: World) -> None:
    ecm = with_consequences(world.ecm, world.site)
    for one in ecm.skills.values():
        invocation = Invocation(one, {}, NAMES)
        for place, values in world.starts():
            assert invocation.can_start(values_of(NAMES, values)) is world.can_start(one, values)
            known = {(then, outcome.id) for then, outcome, _ in invocation.after(values_of(NAMES, values))}
            for outcome, (_, then) in endings(world, one, (place, values)):
                assert (values_of(NAMES, then), outcome.id) in known


def is_proved(world: World, composition: Composition, skills: Mapping[str, Skill]) -> bool:
    """True if each step can start in all its situations, for every value that a situation leaves open."""
    paths = explore_paths(composition, skills, world.site.state)
    for name, situations in paths.states_at_steps.items():
        clause = skills[name.partition("-")[0]].precondition
        if clause is None:
            continue
        for situation in situations:
            claim = situation.condition(clause.term, world.site.state)
            whole = t.conjunction(*situation.path_condition, t.Not(claim))
            free = sorted(t.variables_of(whole))
            for values in product((False, True), repeat=len(free)):
                if is_true(whole, dict(zip(free, values, strict=True))):
                    return False
    return True


def test_the_steps_of_a_proved_composition_can_start_wherever_the_robot_is() -> None:
    seen = Counter[bool]()

    @examples(150)
    @given(worlds(), st.data())
    def law(world: World, data: st.DataObject) -> None:
        skills = with_consequences(world.ecm, world.site).skills
        names = data.draw(st.lists(st.sampled_from(sorted(skills)), min_size=2, max_size=4))
        required = data.draw(st.lists(st.sampled_from(NAMES), max_size=3, unique=True))
        steps = tuple(
            Step(f"{name}-{number}", name, {}, {}, 0, None, STOP_ON_FAILURE, SPAN)
            for number, name in enumerate(names)
        )
        composition = Composition("c", conjunction(required), None, Seq(steps), {}, SPAN)
        proved = is_proved(world, composition, skills)
        seen[proved] += 1
        standings = [one for one in world.starts() if all(one[1][name] for name in required)]
        for name in names if proved else ():
            assert all(world.can_start(skills[name], values) for _, values in standings)
            found = {
                (place, tuple(values.items())): None
                for standing in standings
                for outcome, (place, values) in endings(world, skills[name], standing)
                if not outcome.failure
            }
            standings = [(place, dict(items)) for place, items in found]

    law()
    assert min(seen[True], seen[False]) > 10


def fits(domain: PlanningDomain, known: State, values: Mapping[str, bool]) -> bool:
    pairs = zip(domain.names, known, strict=True)
    return all(value is None or values[name] == value for name, value in pairs)


@examples(60)
@given(worlds(), st.data())
def test_plans_count_on_nothing_that_the_robot_may_have_left(world: World, data: st.DataObject) -> None:
    start = data.draw(st.sampled_from(list(world.starts())))
    goal = conjunction(data.draw(st.lists(st.sampled_from(NAMES), min_size=1, max_size=2, unique=True)))
    domain = domain_for({"m": world.ecm}, world.site, start[1], goal)
    first, none = domain.state(start[1]), AvoidSet()
    path = breadth_first_plan(domain, first, none, 1000)
    written = shortest(*write_pddl(domain, first))
    assert (None if written is None else len(written)) == (None if path is None else len(path))
    if path is None:
        return
    assert len(bounded_plan(domain, first, none, 0)) == len(path)
    standings = [start]
    for number, (_, choice) in enumerate(path):
        then = path[number + 1][0] if number + 1 < len(path) else None
        assert all(world.can_start(choice.skill, values) for _, values in standings)
        ends = [end for one in standings for _, end in endings(world, choice.skill, one)]
        known = {state for state, _, _ in domain.after(choice, path[number][0])}
        assert all(any(fits(domain, one, values) for one in known) for _, values in ends)
        counted_on = {then} if then is not None else {one for one in known if domain.goal(one) is True}
        standings = [end for end in ends if any(fits(domain, one, end[1]) for one in counted_on)]
    assert all(is_true(goal, values) for _, values in standings)
