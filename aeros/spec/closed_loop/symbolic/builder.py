"""The program of a task: the rules of `aeros.spec.closed_loop.transition_system`, over sets of states.

Each place has the moves that `TransitionSystem.transitions` lists for the states there.  A rule that is not
in the plan is passed over, and its variable is false once it is tried or passed over, so places and variables
together are the states of that system.  Differential tests compare the two.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice, product
from typing import Any, Final

import networkx as nx

from aeros.spec.closed_loop.loop_variables import StateSpaceError, skills_of
from aeros.spec.closed_loop.symbolic.composition_places import CompositionPlaces
from aeros.spec.closed_loop.symbolic.program import (
    PLAN,
    REACHED,
    REJECTED,
    End,
    LoopProgram,
    Move,
    Place,
    ProgramBranch,
    all_of,
    any_of,
    plan_bit,
    step,
)
from aeros.spec.closed_loop.symbolic.skill_branches import SymbolicSkill, symbolic_skill
from aeros.spec.closed_loop.transition_system import MAX_PLAN_STEPS, TransitionSystem
from aeros.spec.consequences.consequences import known_definitions, uncertain_predicates
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, negate
from aeros.spec.model.ecm import Alternative, PlanningRule

MAX_PLACES: Final = 5_000
"""Largest number of places of a program."""

MAX_CYCLES: Final = 1_000
"""Largest number of ways in which failures of several steps may lead back to one of them."""


def build_program(system: TransitionSystem) -> LoopProgram:
    """Build the program of a task.

    Args:
        system: transition system of the task.

    Returns:
        The program.

    Raises:
        StateSpaceError: it has more than `MAX_PLACES` places, more rules than a plan may have steps, or a
            composition in which an outcome leaves a variable open.
    """
    return _Builder(system).build()


class _Builder:
    """The places made so far, those that moves lead to first."""

    def __init__(self, system: TransitionSystem) -> None:
        self._system = system
        self._rules = system.task.rules
        self._goal = lower(system.task.goal)
        self._unless = [lower(rule.satisfied_condition) for rule in self._rules]
        self._settable = {
            name
            for skill in skills_of(system.ecm, system.task)
            for one in skill.outcomes.values()
            for name in one.effects
        }
        self._skills: dict[tuple[str, int], SymbolicSkill] = {}
        self._inputs: list[Mapping[str, Any]] = []
        self._moves: dict[Place, tuple[Move, ...]] = {}
        self._inside = 0
        self._first_tries: list[tuple[t.Term, list[t.Term]]] = []
        if len(self._rules) > MAX_PLAN_STEPS:
            raise StateSpaceError(f"it has more than {MAX_PLAN_STEPS} rules")

    def build(self) -> LoopProgram:
        """Build the places from the last to the first."""
        self.add(REACHED)
        self.add(REJECTED)
        done = Place("try", len(self._rules))
        self.add(
            done,
            step(self._goal, REACHED, self._forgotten()),
            step(negate(self._goal), PLAN, self._forgotten()),
        )
        for index in reversed(range(len(self._rules))):
            self._add_rule(index)
        self._add_plan()
        variables = self._system.variables
        ordered = {one.name: one for one in _ordered(variables.variables, self._unless)}
        return LoopProgram(
            values={name: variables.values.get(name, (False, True)) for name in ordered},
            variables=ordered,
            breakpoints=variables.breakpoints,
            moves=self._moves,
            first_tries=self._first_tries[::-1],
            goal=self._goal,
            invariants={one.id: lower(one.term) for one in self._system.task.invariants},
        )

    def add(self, place: Place, *moves: Move) -> Place:
        """Add a place with its moves.

        Args:
            place: the place.
            moves: its moves.

        Returns:
            The place.

        Raises:
            StateSpaceError: there are too many places.
        """
        if len(self._moves) >= MAX_PLACES:
            raise StateSpaceError("its compositions have too many steps and tries")
        self._moves[place] = moves
        return place

    def inside(self, *moves: Move) -> Place:
        """Add a place between two phases of the loop.

        Args:
            moves: its moves.

        Returns:
            The place.
        """
        self._inside += 1
        return self.add(Place("inside", number=self._inside), *moves)

    def skill(self, name: str, inputs: Mapping[str, Any]) -> SymbolicSkill:
        """Describe a skill that the loop runs.

        Args:
            name: its name.
            inputs: its constant inputs.

        Returns:
            The skill; the same object for the same arguments.
        """
        if inputs not in self._inputs:
            self._inputs.append(inputs)
        key = (name, self._inputs.index(inputs))
        if key not in self._skills:
            ecm, variables = self._system.ecm, self._system.variables
            self._skills[key] = symbolic_skill(ecm.callable_skills[name], inputs, variables, self._settable)
        return self._skills[key]

    def _forgotten(self) -> dict[str, t.Term]:
        """Make the updates after which no rule is due."""
        return {plan_bit(index).name: t.FALSE for index in range(len(self._rules))}

    def _add_plan(self) -> None:
        rejected = any_of(
            [
                all_of(*map(negate, (self._unless[index] for index in rules)))
                for rules in self._rejected_sets()
            ]
            + [all_of(*self._unless)]
        )
        chosen = {plan_bit(index).name: negate(one) for index, one in enumerate(self._unless)}
        open_ = negate(self._goal)
        self.add(
            PLAN,
            step(self._goal, REACHED, self._forgotten()),
            step(all_of(open_, rejected), REJECTED),
            step(all_of(open_, negate(rejected)), Place("try"), chosen),
        )

    def _rejected_sets(self) -> list[frozenset[int]]:
        """List sets of rules that no accepted plan contains.

        Raises:
            StateSpaceError: there are too many.
        """
        alone = [frozenset((index,)) for index in range(len(self._rules)) if self._system.rejection((index,))]
        by_edge: dict[tuple[str, str], set[int]] = {}
        for index in range(len(self._rules)):
            for edge in self._system.recovery_edges(index):
                by_edge.setdefault(edge, set()).add(index)
        cycles = list(islice(nx.simple_cycles(nx.DiGraph(by_edge.keys())), MAX_CYCLES + 1))
        found = list(alone)
        for cycle in cycles:
            edges = zip(cycle, [*cycle[1:], cycle[0]], strict=True)
            found += [
                frozenset(chosen) for chosen in islice(product(*(by_edge[e] for e in edges)), MAX_CYCLES)
            ]
        if len(cycles) > MAX_CYCLES or len(found) > MAX_CYCLES:
            raise StateSpaceError("its failures lead back to themselves in too many ways")
        return found

    def _add_rule(self, index: int) -> None:
        rule, after = self._rules[index], Place("try", index + 1)
        lost = self._add_failure(rule, index)
        last = self.inside(
            step(self._unless[index], after),
            step(negate(self._unless[index]), lost, self._forgotten()),
        )
        for tries in reversed(range(rule.retry + 1)):
            failing, given_up = last, None
            if tries < rule.retry:
                failing = self._between(index, rule, tries + 1)
                given_up = lost if lost.kind == "reset" else None
            self._add_try(Place("try", index, tries), after, failing, given_up, lost)

    def _add_try(
        self, here: Place, after: Place, failing: Place, given_up: Place | None, lost: Place
    ) -> None:
        """Add a try of a rule's step.

        At the first, the rule's variable becomes false: whatever follows, the rule is not due any more.
        """
        rule, skipped = self._rules[here.rule], self._unless[here.rule]
        cleared: dict[str, t.Term] = {}
        if not here.tries:
            cleared = {plan_bit(here.rule).name: t.FALSE}
            skipped = any_of([negate(plan_bit(here.rule)), skipped])
        due = all_of(negate(self._goal), negate(skipped))
        moves, starts = [], []
        for way in self._system.ecm.alternatives(rule.skill):
            can_start, branches = self._way(way, rule, (after, failing, given_up), cleared)
            moves.append(Move(all_of(due, can_start), branches))
            starts.append(can_start)
        if not here.tries:
            self._first_tries.append((due, starts))
        self.add(
            here,
            step(self._goal, REACHED, self._forgotten()),
            step(all_of(negate(self._goal), skipped), after, cleared),
            step(all_of(due, *map(negate, starts)), lost if here.tries else PLAN, self._forgotten()),
            *moves,
        )

    def _add_failure(self, rule: PlanningRule, index: int) -> Place:
        """Add the place after the last try of a rule's step has failed."""
        if rule.on_failure is None:
            return PLAN
        helpers = [self.skill(name, {}) for name in self._system.ecm.providers(rule.on_failure)]
        return self.add(
            Place("reset", index),
            step(self._goal, REACHED, self._forgotten()),
            *_recovery(helpers, PLAN, self._goal),
        )

    def _between(self, index: int, rule: PlanningRule, tries: int) -> Place:
        """Add the place between two tries of a rule's step."""
        next_try = Place("try", index, tries)
        if rule.between_tries is None:
            return next_try
        helpers = [self.skill(name, {}) for name in self._system.ecm.providers(rule.between_tries)]
        skipped = all_of(negate(self._goal), self._unless[index])
        return self.add(
            Place("recover", index, tries),
            step(self._goal, REACHED, self._forgotten()),
            step(skipped, Place("try", index + 1)),
            *_recovery(helpers, next_try, any_of([self._goal, self._unless[index]])),
        )

    def _way(
        self,
        way: Alternative,
        rule: PlanningRule,
        targets: tuple[Place, Place, Place | None],
        cleared: Mapping[str, t.Term],
    ) -> tuple[t.Term, tuple[ProgramBranch, ...]]:
        """Make the condition of an alternative's start, and what may happen in one try of it.

        The targets are those after a success, after a failure, and where memory leaves out further tries.
        """
        done, failing, given_up = targets
        if way.composition is not None:
            leaving = [] if given_up is None else [_given_up(t.TRUE, t.TRUE, given_up, self._forgotten())]
            lost = self.inside(Move(t.TRUE, (ProgramBranch(t.TRUE, (End(t.TRUE, failing),)), *leaving)))
            composition, variables = way.composition, self._system.variables
            places = CompositionPlaces(
                composition,
                self._goal,
                self.inside,
                self.skill,
                lambda part: symbolic_skill(
                    self._system.stop(part, composition), {}, variables, self._settable
                ),
                uncertain_predicates(known_definitions(self._system.ecm)),
            )
            entry = places.entry(self.inside(step(t.TRUE, done)), lost)
            return lower(way.composition.precondition), (
                ProgramBranch(t.TRUE, (End(t.TRUE, entry),), cleared),
            )
        skill = self.skill(way.name, rule.inputs)
        branches: list[ProgramBranch] = []
        for one in skill.branches:
            ends = (End(one.is_success, done), End(one.is_failure, failing))
            updates = {**one.updates, **cleared}
            branches.append(ProgramBranch(one.guard, ends, updates, one.opened, one.is_likely))
            if given_up is not None:
                updates = {**one.updates, **self._forgotten()}
                branches.append(_given_up(one.guard, one.is_failure, given_up, updates, one.opened))
        return skill.can_start, tuple(branches)


def _given_up(
    guard: t.Term,
    is_failure: t.Term,
    target: Place,
    updates: Mapping[str, t.Term],
    opened: Mapping[str, tuple[Any, ...]] | None = None,
) -> ProgramBranch:
    """Make the branch in which the agent's memory leaves out the tries that are left."""
    return ProgramBranch(guard, (End(is_failure, target),), updates, opened or {}, is_likely=False)


def _ordered(variables: Mapping[str, t.Variable], unless: Sequence[t.Term]) -> Iterator[t.Variable]:
    """Yield each rule's variable after those that decide it: so diagrams of plans are small."""
    seen = set[str]()
    for index, condition in enumerate(unless):
        names = [name for name in sorted(t.variables_of(condition)) if name in variables]
        yield from (variables[name] for name in names if name not in seen)
        seen.update(names)
        yield plan_bit(index)
    yield from (one for name, one in variables.items() if name not in seen)


def _recovery(helpers: Sequence[SymbolicSkill], target: Place, over: t.Term) -> list[Move]:
    """Make the moves of a recovery; where no helper can start, it is skipped."""
    unable = all_of(negate(over), *(negate(one.can_start) for one in helpers))
    return [
        step(unable, target),
        *(
            Move(
                all_of(negate(over), one.can_start),
                tuple(
                    ProgramBranch(
                        each.guard, (End(each.agrees, target),), each.updates, each.opened, each.is_likely
                    )
                    for each in one.branches
                ),
            )
            for one in helpers
        ),
    ]
