"""Certificate of a loop without faults: claims about its sets of states that a solver decides.

The sets were computed with diagrams.  The claims are about the sets as terms and the program as terms, on the
variables themselves: quantities are real numbers here, and not cells.  Together the claims say that

- the states at the start are in the set of the first place, and each branch leads from the set of its place
  into that of its target: so the sets hold all reachable states;
- in the sets, each step that is due can start, and each invariant holds;
- a state that has the goal within reach in n plans is one where, whichever move the agent makes, something
  likely leads to states that have it within reach in n plans, or in n - 1 after a move into a new plan; and
  each reachable state before a plan has the goal within reach in some number of plans.

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
    LoopProgram,
    Place,
    ProgramBranch,
    afterwards,
    all_of,
    any_of,
)
from aeros.spec.closed_loop.symbolic.set_terms import SetTerms
from aeros.spec.closed_loop.symbolic.state_sets import StateSet, StateSets
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term, equality_condition
from aeros.spec.expr.types import RealType

MAX_SIZE: Final = 150_000
"""Largest size of one certificate, as `SetTerms.size` counts it; a solver takes some ten seconds for it."""


class CertificateTooLargeError(Exception):
    """A certificate is larger than `MAX_SIZE`."""


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

    Raises:
        CertificateTooLargeError: together they are larger than `MAX_SIZE`.
    """
    # The sets are complete, so another order of the bits would only cost time.
    fixpoints.sets.bdd.configure(reordering=False)
    size = 0
    for question in _Certificate(fixpoints, variables).questions():
        size += question.size
        if size > MAX_SIZE:
            raise CertificateTooLargeError
        yield question.claim()


class _Question:
    """Terms of one claim, with the variables that are in it."""

    def __init__(self, sets: StateSets, program: LoopProgram, ranges: Mapping[str, Range]) -> None:
        self._sets, self._program = sets, program
        self._ranges = dict(ranges)
        self._terms: list[SetTerms] = []
        self._subject = ""
        self._parts: tuple[t.Term, ...] = ()
        self.variables = [*program.variables.values()]
        self.now = self.over(program.variables, "")

    def over(self, values: Mapping[str, t.Term], mark: str) -> SetTerms:
        """Make sets over other terms for the variables."""
        terms = SetTerms(self._sets, self._program, values, mark)
        self._terms.append(terms)
        return terms

    def after(self, branch: ProgramBranch, number: int) -> tuple[SetTerms, t.Term, Any]:
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
        terms: dict[str, t.Term] = {**self._program.variables, **branch.updates, **fresh}
        renamed = {afterwards(self._program.variables[name]).name: one for name, one in fresh.items()}
        return self.over(terms, f" after {number}"), all_of(*known), renamed

    def asks(self, subject: str, *parts: t.Term) -> _Question:
        """Ask if all parts hold."""
        self._subject, self._parts = subject, parts
        return self

    @property
    def size(self) -> int:
        """Number of clauses, and of definitions with their weight."""
        return sum(terms.size for terms in self._terms)

    def claim(self) -> CertificateClaim:
        """Make the claim that all parts hold."""
        definitions = [one for terms in self._terms for one in terms.definitions]
        defined = [one for terms in self._terms for one in terms.defined]
        variables = tuple((one, self._ranges.get(one.name)) for one in [*self.variables, *defined])
        return CertificateClaim(self._subject, variables, tuple(definitions), all_of(*self._parts))


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

    def _question(self) -> _Question:
        return _Question(self._sets, self._program, self._ranges)

    def questions(self) -> Iterator[_Question]:
        """Make the questions."""
        yield self.start()
        for place, states in self._fixpoints.reachable.items():
            if states != self._sets.none:
                yield self.reachability(place)
        yield from self.progress()

    def start(self) -> _Question:
        """Claim that all states at the start are in the set of the first place."""
        question = self._question()
        parts = [
            equality_condition(self._program.variables[name], values[0])
            for name, values in self._fixpoints.starts.items()
            if len(values) == 1
        ]
        parts += self._fixpoints.start_facts
        first = question.now.condition(self._fixpoints.reachable[PLAN])
        return question.asks("the start", t.Implies(all_of(*parts), first))

    def reachability(self, place: Place) -> _Question:
        """Claim that every branch stays in the sets, and that nothing is wrong at a place."""
        question = self._question()
        here = question.now.condition(self._fixpoints.reachable[place])
        parts: list[t.Term] = [t.Implies(here, one) for one in self._program.invariants.values()]
        if place.kind == "try" and not place.tries and place.rule < len(self._program.first_tries):
            due, starts = self._program.first_tries[place.rule]
            parts.append(t.Implies(all_of(here, due), all_of(*starts)))
        for number, (move, branch) in enumerate(self._program.branches(place)):
            after, known, renamed = question.after(branch, number)
            for end in branch.ends:
                premise = all_of(here, move.guard, branch.guard, known, t.substitute(end.guard, renamed))
                target = self._fixpoints.reachable[end.target]
                kept = after.condition(target, self._fixpoints.reachable[place], _changed(branch))
                parts.append(t.Implies(premise, kept))
        return question.asks(_named(place), *parts)

    def progress(self) -> Iterator[_Question]:
        """Claim that the goal stays within reach.

        Yields:
            For each number of plans the claims about places where more states have the goal within reach than
            with fewer plans, and that all states before a plan have it within reach in the end.
        """
        rounds, none = self._fixpoints.hopeful, self._sets.none
        fewer: Mapping[Place, StateSet] = dict.fromkeys(self._program.moves, none)
        for number, found in enumerate(rounds):
            targets = {**found, PLAN: fewer[PLAN]}
            for place in self._program.moves:
                if place != REACHED and found[place] != fewer[place]:
                    yield self._progress_at(place, number, found[place], targets)
            fewer = found
        question = self._question()
        reachable, within = (question.now.condition(one[PLAN]) for one in (self._fixpoints.reachable, fewer))
        yield question.asks("every plan", t.Implies(reachable, within))

    def _progress_at(
        self, place: Place, number: int, states: StateSet, targets: Mapping[Place, StateSet]
    ) -> _Question:
        question = self._question()
        here = question.now.condition(states)
        parts: list[t.Term] = []
        count = 0
        for move in self._program.moves[place]:
            ways: list[t.Term] = []
            for branch in move.branches:
                if branch.is_likely:
                    after, known, renamed = question.after(branch, count)
                    count += 1
                    leads_on = [
                        t.Implies(
                            all_of(known, t.substitute(end.guard, renamed)),
                            after.condition(targets[end.target], states, _changed(branch)),
                        )
                        for end in branch.ends
                    ]
                    ways.append(all_of(branch.guard, *leads_on))
            parts.append(t.Implies(all_of(here, move.guard), any_of(ways)))
        return question.asks(f"{number} plans from {_named(place)}", *parts)


def _changed(branch: ProgramBranch) -> set[str]:
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
