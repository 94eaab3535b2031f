"""Values that outcomes leave predicates with a definition at: true, false, or either of them.

A predicate with a definition is either after a skill that may have changed what the definition reads, unless
an effect of the outcome states it, or

- the definition decides it, wherever the stated effects, the definitions of other stated predicates and the
  stated ranges hold (by the solver): at one of two docks that are far from each other, a robot is not at the
  other; or
- the other value belongs to another outcome. The measured outcome with the most effects counts, so after
  `blocked`, with no effects, the robot is not at the dock, if `docked` says only that it is there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache

from aeros.spec.backends.oracle import Oracle
from aeros.spec.backends.solver_results import Question, SatResult
from aeros.spec.consequences.disturbance import (
    Definitions,
    disturbed_by_actions,
    disturbed_by_changes,
    disturbed_by_effects,
    readings_behind,
)
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term
from aeros.spec.expr.effects import Increment
from aeros.spec.expr.types import VectorType
from aeros.spec.model.ecm import Ecm, Outcome, Skill
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared, ranges_of, relevant_facts


def with_consequences(ecm: Ecm, site: Site) -> Ecm:
    """Add their consequences to all outcomes of the skills that a module may run.

    Args:
        ecm: the module.
        site: site under which it is elaborated, with the variables of the modules that it requires.

    Returns:
        The module, whose skills know all predicates of it and of the modules that it requires.
    """
    definitions = known_definitions(ecm)
    if not definitions:
        return ecm
    own = {name: _skill_with_consequences(one, definitions, site) for name, one in ecm.skills.items()}
    foreign = {
        name: _skill_with_consequences(one, definitions, site) for name, one in ecm.foreign.skills.items()
    }
    return replace(ecm, skills=own, foreign=replace(ecm.foreign, skills=foreign))


def known_definitions(ecm: Ecm) -> Definitions:
    """Collect the definitions that matter to a module.

    Args:
        ecm: the module.

    Returns:
        Its own, and those of all modules that it requires or whose skills it may run, by full name.
    """
    owners = {one.id: one for one in (*ecm.with_owners, *ecm.foreign.modules.values())}
    return {name: one for owner in owners.values() for name, one in owner.definitions.items()}


def uncertain_predicates(definitions: Definitions) -> frozenset[str]:
    """List the predicates by definition that may be unknown although everything that they read is measured.

    Args:
        definitions: definitions by full name.

    Returns:
        Those with a margin, and those that read one of these, directly or not.
    """
    found = {name for name, one in definitions.items() if one.margin}
    while more := {
        name
        for name, one in definitions.items()
        if name not in found and not found.isdisjoint(t.variables_of(one.term))
    }:
        found |= more
    return frozenset(found)


def modules_with_consequences(modules: Mapping[str, Ecm], site: Site) -> dict[str, Ecm]:
    """Add their consequences to all outcomes of modules that are active together.

    Args:
        modules: the modules, by id.
        site: the site, with their variables.

    Returns:
        The modules, whose own skills know the predicates of all of them.
    """
    definitions = {name: one for owner in modules.values() for name, one in owner.definitions.items()}
    return {
        id_: replace(
            ecm,
            skills={
                name: _skill_with_consequences(one, definitions, site) for name, one in ecm.skills.items()
            },
        )
        for id_, ecm in modules.items()
    }


def _skill_with_consequences(skill: Skill, definitions: Definitions, site: Site) -> Skill:
    moved = disturbed_by_actions(skill, definitions, site)
    halted = {} if skill.hold_condition is None else t.variables_of(skill.hold_condition.term)
    changes = {**disturbed_by_changes(halted, definitions), **moved}
    outcomes: dict[str, Outcome] = {}
    for id_, outcome in skill.outcomes.items():
        disturbed = {**disturbed_by_effects(outcome, definitions), **moved}
        changes = {**disturbed, **changes}
        values = {
            name: value_that_follows(name, outcome, definitions, site.observed_variables)
            for name in disturbed
            if name not in outcome.effects
        }
        outcomes[id_] = replace(outcome, consequences=values)
    every = tuple(outcomes.values())
    outcomes = {
        id_: replace(outcome, consequences=_not_of_others(outcome, every))
        for id_, outcome in outcomes.items()
    }
    return replace(skill, outcomes=outcomes, disturbed=changes)


def _not_of_others(outcome: Outcome, every: Sequence[Outcome]) -> dict[str, bool | None]:
    """Decide the predicates of which one value is the declared state of another outcome that may happen."""
    others = [one for one in every if one.probability != 0 and one.ranges == outcome.ranges]
    decided: dict[str, bool | None] = {}
    for name, value in outcome.consequences.items():
        left = [
            each
            for each in (False, True)
            if not any(one.effects == {**outcome.effects, name: each} for one in others)
        ]
        decided[name] = left[0] if value is None and len(left) == 1 else value
    return decided


def value_that_follows(
    name: str, outcome: Outcome, definitions: Definitions, declared: Mapping[str, Declared]
) -> bool | None:
    """Find the value that a predicate has wherever all that an outcome states holds.

    Args:
        name: full name of a predicate that has a definition.
        outcome: the outcome.
        definitions: definitions by full name.
        declared: state variables of the site by name.

    Returns:
        The value; None if it may be either, or the solver gives up.
    """
    term = expanded_definition(name, definitions)
    stated = stated_terms(outcome, definitions, declared)
    read = readings_behind(name, definitions).keys()
    if not any(read & t.variables_of(one).keys() for one in stated):
        return None
    can_be_true = not are_excluded((*stated, term), declared)
    can_be_false = not are_excluded((*stated, t.Not(term)), declared)
    return None if can_be_true is can_be_false else can_be_true


def implications(
    outcome: Outcome, definitions: Definitions, declared: Mapping[str, Declared]
) -> Iterator[tuple[str, tuple[t.Term, ...], t.Term]]:
    """List the values that proofs rely on because they follow from what an outcome states.

    Args:
        outcome: the outcome, with its consequences.
        definitions: definitions by full name.
        declared: state variables of the site by name.

    Yields:
        The predicate, the conditions that the outcome states, and the condition that follows from them.
    """
    for name in outcome.consequences:
        value = value_that_follows(name, outcome, definitions, declared)
        if value is not None:
            term = expanded_definition(name, definitions)
            yield name, stated_terms(outcome, definitions, declared), term if value else t.Not(term)


def stated_terms(
    outcome: Outcome, definitions: Definitions, declared: Mapping[str, Declared]
) -> tuple[t.Term, ...]:
    """List what is true after an outcome by its declaration, on readings alone.

    Args:
        outcome: the outcome.
        definitions: definitions by full name.
        declared: state variables of the site by name.

    Returns:
        Conditions on the state afterwards; an increment states nothing, as the value before is not known.
    """
    stated: list[t.Term] = [one.term(declared[one.variable].variable) for one in outcome.ranges]
    for name, value in outcome.effects.items():
        variable = declared[name].variable
        if isinstance(value, bool):
            term = expanded_definition(name, definitions) if name in definitions else variable
            stated.append(term if value else t.Not(term))
        elif not isinstance(value, Increment) and not isinstance(variable.type, VectorType):
            stated.append(t.Compare("==", variable, constant_term(value, variable.type)))
    return tuple(stated)


def expanded_definition(name: str, definitions: Definitions) -> t.Term:
    """Write the definition of a predicate on readings alone.

    Args:
        name: full name of a predicate that has a definition.
        definitions: definitions by full name.

    Returns:
        Its definition, in which those of other predicates are inserted.
    """
    term = definitions[name].term
    while known := {name: definitions[name].term for name in t.variables_of(term) if name in definitions}:
        term = t.substitute(term, known)
    return term


def are_excluded(terms: tuple[t.Term, ...], declared: Mapping[str, Declared]) -> bool:
    """Ask the solver if no state agrees with all of some conditions.

    Args:
        terms: conditions on the state.
        declared: state variables of the site by name, with their ranges.

    Returns:
        True if there is no such state; False if there is one, or the solver gives up.
    """
    mentioned, whole = relevant_facts(terms, declared)
    variables = tuple(one.variable for one in mentioned)
    return _is_unsatisfiable(variables, tuple(ranges_of(mentioned).items()), tuple(whole))


@lru_cache(1024)
def _is_unsatisfiable(
    variables: tuple[t.Variable, ...],
    ranges: tuple[tuple[str, tuple[Fraction, Fraction]], ...],
    terms: tuple[t.Term, ...],
) -> bool:
    """Ask the solver, once for each question: plans are made anew all the time."""
    question = Question(list(variables), dict(ranges), terms)
    return Oracle().check_sat(*question).result is SatResult.UNSAT
