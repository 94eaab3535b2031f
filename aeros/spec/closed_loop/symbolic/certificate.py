"""Certificate of a loop without faults: claims about its sets of states that a solver decides.

The sets were computed with diagrams.  The claims are about the sets as terms and the program as terms, on the
variables themselves: quantities are real numbers here, and not cells.  Together the claims say that

- the states at the start are in the set of the first place, and each branch leads from the set of its place
  into that of its target: so the sets hold all reachable states;
- in the sets, each step that is due can start, and each invariant holds;
- a state that has the goal within reach in n plans is one where, whichever move the agent makes, something
  likely leads to states that have it within reach in n plans, or in n - 1 after a move into a new plan; and
  each reachable state before a plan has the goal within reach.

So a mistake in the diagrams, in the cells of quantities or in the search shows as a claim that is not proved.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Final

from aeros.spec.closed_loop.loop_variables import LoopVariables
from aeros.spec.closed_loop.symbolic.fixpoints import Fixpoints
from aeros.spec.closed_loop.symbolic.program import (
    PLAN,
    REACHED,
    Branch,
    LoopProgram,
    Place,
    afterwards,
    all_of,
    any_of,
)
from aeros.spec.closed_loop.symbolic.set_terms import SetTerms
from aeros.spec.closed_loop.symbolic.state_sets import StateSet, StateSets
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term, equality_condition
from aeros.spec.expr.types import IntegerType, RealType
from aeros.spec.expr.units import NUMBER

PLANS_LEFT: Final = t.Variable("plans left", IntegerType(), t.VariableRole.STATE)
"""Number of plans in which a state has the goal within reach."""

Range = tuple[Fraction, Fraction] | None


@dataclass(frozen=True)
class CertificateClaim:
    """One claim of a certificate.

    Attributes:
        subject: what it is about, in words.
        variables: variables that the terms read, with the range of each number.
        assumptions: definitions of the sets.
        conclusion: what holds then.
    """

    subject: str
    variables: tuple[tuple[t.Variable, Range], ...]
    assumptions: tuple[t.Term, ...]
    conclusion: t.Term


def certificate_claims(fixpoints: Fixpoints, variables: LoopVariables) -> Iterator[CertificateClaim]:
    """Make the claims about a loop in which no fault was found.

    Args:
        fixpoints: sets of states of its program.
        variables: its state variables.

    Yields:
        The claims: of the start, of each place, and of the way to the goal from each place.
    """
    # The sets are complete, so another order of the bits would only cost time.
    fixpoints.sets.bdd.configure(reordering=False)
    certificate = _Certificate(fixpoints, variables)
    yield certificate.start()
    for place in fixpoints.program.moves:
        if fixpoints.reachable[place] != fixpoints.sets.none:
            yield certificate.reachability(place)
    yield from certificate.progress()


class _Question:
    """Terms of one claim, with the variables that are in it."""

    def __init__(self, sets: StateSets, program: LoopProgram, ranges: Mapping[str, Range]) -> None:
        self._sets, self._program = sets, program
        self._ranges = dict(ranges)
        self._terms: list[SetTerms] = []
        self.variables = [*program.variables.values()]
        self.now = self.over(program.variables, "")

    def over(self, values: Mapping[str, t.Term], mark: str) -> SetTerms:
        """Make sets over other terms for the variables."""
        terms = SetTerms(self._sets, self._program, values, mark)
        self._terms.append(terms)
        return terms

    def after(self, branch: Branch, number: int, more: Mapping[str, t.Term]) -> tuple[SetTerms, t.Term, Any]:
        """Make sets over the values after a branch, with what is known of open ones, and their names."""
        fresh: dict[str, t.Variable] = {}
        known: list[t.Term] = []
        for name, values in branch.opened.items():
            variable = self._program.variables[name]
            one = t.Variable(f"{name} after {number}", variable.type, variable.role)
            fresh[name] = one
            self.variables.append(one)
            self._ranges[one.name] = self._ranges.get(name)
            if isinstance(variable.type, RealType) and len(values) < len(self._sets.values[name]):
                low, high = (constant_term(bound, variable.type) for bound in (values[0], values[-1]))
                known += [t.Compare("<=", low, one), t.Compare("<=", one, high)]
        terms: dict[str, t.Term] = {**self._program.variables, **branch.updates, **fresh, **more}
        renamed = {afterwards(self._program.variables[name]).name: one for name, one in fresh.items()}
        return self.over(terms, f" after {number}"), all_of(*known), renamed

    def claim(self, subject: str, *parts: t.Term) -> CertificateClaim:
        """Make the claim that all parts hold."""
        definitions = [one for terms in self._terms for one in terms.definitions]
        defined = [one for terms in self._terms for one in terms.defined]
        variables = tuple((one, self._ranges.get(one.name)) for one in [*self.variables, *defined])
        return CertificateClaim(subject, variables, tuple(definitions), all_of(*parts))


class _Certificate:
    """Maker of the claims about one loop."""

    def __init__(self, fixpoints: Fixpoints, variables: LoopVariables) -> None:
        self._fixpoints = fixpoints
        self._program = fixpoints.program
        self._sets = fixpoints.sets
        self._ranges: dict[str, Range] = {
            name: variables.declared[name].range
            for name, one in variables.variables.items()
            if isinstance(one.type, RealType)
        }
        self._whole = variables.values

    def _question(self) -> _Question:
        return _Question(self._sets, self._program, self._ranges)

    def start(self) -> CertificateClaim:
        """Claim that all states at the start are in the set of the first place."""
        question = self._question()
        parts = [
            equality_condition(self._program.variables[name], values[0])
            for name, values in self._fixpoints.starts.items()
            if len(values) == 1
        ]
        first = question.now.condition(self._fixpoints.reachable[PLAN])
        return question.claim("the start", t.Implies(all_of(*parts), first))

    def reachability(self, place: Place) -> CertificateClaim:
        """Claim that every branch stays in the sets, and that nothing is wrong at a place."""
        question = self._question()
        here = question.now.condition(self._fixpoints.reachable[place])
        parts: list[t.Term] = [t.Implies(here, one) for one in self._program.invariants.values()]
        if place.kind == "try" and not place.tries and place.rule < len(self._program.first_tries):
            due, starts = self._program.first_tries[place.rule]
            parts.append(t.Implies(all_of(here, due), all_of(*starts)))
        for number, (move, branch) in enumerate(self._program.branches(place)):
            after, known, renamed = question.after(branch, number, {})
            for end in branch.ends:
                premise = all_of(here, move.guard, branch.guard, known, t.substitute(end.guard, renamed))
                target = self._fixpoints.reachable[end.target]
                kept = after.condition(target, self._fixpoints.reachable[place], _changed(branch))
                parts.append(t.Implies(premise, kept))
        return question.claim(_named(place), *parts)

    def progress(self) -> Iterator[CertificateClaim]:
        """Claim that the goal stays within reach."""
        rounds = self._fixpoints.hopeful
        numbers = tuple(map(Fraction, range(len(rounds))))
        self._sets.declare(PLANS_LEFT, numbers)
        self._ranges[PLANS_LEFT.name] = (numbers[0], numbers[-1])
        self._program.variables[PLANS_LEFT.name] = PLANS_LEFT
        within = {place: self._within_reach(place, rounds, numbers) for place in self._program.moves}
        for place in self._program.moves:
            if place != REACHED and within[place] != self._sets.none:
                yield self._progress_at(place, within)
        question = self._question()
        last = question.over(
            {**self._program.variables, PLANS_LEFT.name: constant_term(numbers[-1], PLANS_LEFT.type)},
            " at last",
        )
        reachable = question.now.condition(self._fixpoints.reachable[PLAN])
        yield question.claim("every plan", t.Implies(reachable, last.condition(within[PLAN])))

    def _within_reach(
        self, place: Place, rounds: list[dict[Place, StateSet]], numbers: tuple[Fraction, ...]
    ) -> StateSet:
        union = self._sets.none
        for number, found in zip(numbers, rounds, strict=True):
            union |= self._sets.equals(PLANS_LEFT.name, number) & found[place]
        return union

    def _progress_at(self, place: Place, within: Mapping[Place, StateSet]) -> CertificateClaim:
        question = self._question()
        here = question.now.condition(within[place])
        parts: list[t.Term] = []
        number = 0
        for move in self._program.moves[place]:
            ways = []
            for branch in move.branches:
                if branch.is_likely:
                    leads_on = self._leads_on(question, branch, number, place, within)
                    ways.append(all_of(branch.guard, leads_on))
                    number += 1
            parts.append(t.Implies(all_of(here, move.guard), any_of(ways)))
        return question.claim(f"the way on from {_named(place)}", *parts)

    def _leads_on(
        self,
        question: _Question,
        branch: Branch,
        number: int,
        place: Place,
        within: Mapping[Place, StateSet],
    ) -> t.Term:
        """Make the condition that a branch leads on, whatever its open variables become."""
        one_less = t.Add(PLANS_LEFT, t.Literal(Fraction(-1), RealType(NUMBER)))
        fewer = any(end.target == PLAN for end in branch.ends)
        more: dict[str, t.Term] = {PLANS_LEFT.name: one_less} if fewer else {}
        after, known, renamed = question.after(branch, number, more)
        parts: list[t.Term] = []
        for end in branch.ends:
            target = within[end.target]
            premise = all_of(known, t.substitute(end.guard, renamed))
            changed = {*_changed(branch), *more}
            parts.append(t.Implies(premise, after.condition(target, within[place], changed)))
        if fewer:
            parts.append(t.Compare("<=", t.Literal(Fraction(1), RealType(NUMBER)), PLANS_LEFT))
        return all_of(*parts)


def _changed(branch: Branch) -> set[str]:
    return {*branch.updates, *branch.opened}


def _named(place: Place) -> str:
    match place.kind:
        case "try":
            return f"try {place.tries} of rule {place.rule}"
        case "recover" | "reset":
            return f"recovery {place.tries} of rule {place.rule}"
        case "inside":
            return f"place {place.number} inside a step"
        case _:
            return f"`{place.kind}`"
