"""One claim in many situations: an obligation for each in which it is not settled at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from aeros.spec.consequences.words import unsettled_note
from aeros.spec.expr import terms as t
from aeros.spec.expr.effects import Increment
from aeros.spec.flow.symbolic_paths import SymbolicState, SymbolicStates, earlier_measurements
from aeros.spec.model.composition import Composition
from aeros.spec.model.ecm import Skill
from aeros.spec.model.step_graph import steps_of
from aeros.spec.model.variables import Declared
from aeros.spec.obligations.claim_id import ClaimPattern
from aeros.spec.obligations.obligation import LabelledConjunct, Obligation, VariableSpace
from aeros.spec.obligations.verdicts import StaticClaim


def skills_of_steps(composition: Composition, skills: Mapping[str, Skill]) -> dict[str, tuple[Skill, ...]]:
    """List the skills that each step or handler of a composition may run.

    Args:
        composition: the composition.
        skills: skills of the module by name.

    Returns:
        The skills by the id of the step.
    """
    steps = (*composition.handlers.values(), *steps_of(composition.body))
    return {step.id: tuple(skills[name] for name in step.runs) for step in steps}


def obligation_per_situation(
    claim: Obligation,
    case: ClaimPattern,
    situations: SymbolicStates,
    state: Mapping[str, Declared],
    skills: Mapping[str, Sequence[Skill]],
) -> Iterator[Obligation | StaticClaim]:
    """Claim that a condition holds in every situation.

    It is settled at once where no variable matters, else there is an obligation for each situation.  Where it
    certainly fails in one, that situation is the only one reported.

    Args:
        claim: the claim, whose conclusion is a condition on the state in a situation.
        case: kind of the claim if there are several; it takes the names of `claim`, and a number from 1.
        situations: situations in which the condition must hold.
        state: state variables of the site by name.
        skills: skills that each step may run, by its id, for the words on a predicate that one has disturbed.

    Yields:
        The claim if it is settled, or its obligations, whose conclusions are about the state at the start.
    """
    asked: dict[tuple[tuple[t.Term, ...], t.Term], Obligation] = {}
    for situation, trace in situations.items():
        found = _claim_in(situation, trace, claim, state, skills)
        if found.conclusion == t.TRUE:
            continue
        if found.conclusion == t.FALSE and not situation.known:
            yield found
            return
        asked.setdefault((found.space.assumptions, found.conclusion), found)
    if not asked:
        yield StaticClaim(claim.id, None)
    for number, found in enumerate(asked.values(), 1):
        yield replace(found, id=case(*claim.id.names, number)) if len(asked) > 1 else found


def _effect_words(effect: Any) -> str:
    """Write what a path leaves of a variable: a value, or an increment of its value at the start."""
    return str(effect) if isinstance(effect, Increment) else f"= {str(effect).lower()}"


def _claim_in(
    situation: SymbolicState,
    trace: tuple[str, ...],
    claim: Obligation,
    state: Mapping[str, Declared],
    skills: Mapping[str, Sequence[Skill]],
) -> Obligation:
    """Express a claim in one situation as an obligation about the state at the start."""
    assumed = tuple(sorted(situation.known, key=repr))
    values = dict(situation.assignment)
    named = (name for name in t.variables_of(claim.conclusion) if name in values)
    then = [f"then {name} {_effect_words(values[name])}" for name in named]
    members = (
        LabelledConjunct(situation.condition(one.term, state), one.label) for one in claim.labelled_conjuncts
    )
    ran = [line.partition(" → ")[0].partition(" by ")[0] for line in reversed(trace)]
    left = t.variables_of(claim.conclusion).keys() - values.keys()
    disturbed = unsettled_note(left, ((step, one) for step in ran for one in skills.get(step, ())))
    notes = ("\n".join(["after", *trace, *then]),) if trace else ()
    variables = (*claim.space.variables, *earlier_measurements(assumed, state))
    return replace(
        claim,
        space=VariableSpace(variables, assumed),
        conclusion=situation.condition(claim.conclusion, state),
        labelled_conjuncts=tuple(members),
        notes=notes if disturbed is None else (*notes, disturbed),
    )
