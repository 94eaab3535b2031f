"""Fixpoints of a program: reachable states, and states from which the goal stays within reach.

A state has the goal within reach in `n` plans if, whichever move the agent makes there, something likely
leads to states that have it within reach, whatever the open variables become.  A move into a new plan counts
one.  So the sets for 0, 1, 2 … plans grow until they do not change.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from heapq import heappop, heappush
from typing import Any, Final

from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.symbolic.branch_images import BranchImages
from aeros.spec.closed_loop.symbolic.program import PLAN, REACHED, LoopProgram, Move, Place
from aeros.spec.closed_loop.symbolic.state_sets import StateSet, StateSets
from aeros.spec.expr import terms as t

MAX_IMAGES: Final = 200_000
"""Largest number of images of branches that one analysis computes."""

MAX_NODES: Final = 3_000_000
"""Largest number of nodes of all diagrams together."""


@dataclass
class Fixpoints:
    """Sets of states of a program.

    Attributes:
        program: the program.
        starts: values that each variable may have at the start.
        sets: the diagrams.
        facts: definitions of variables, as conditions on a state.
    """

    program: LoopProgram
    starts: Mapping[str, tuple[Any, ...]]
    sets: StateSets
    facts: tuple[t.Term, ...] = ()
    _images: int = 0

    @cached_property
    def _branches(self) -> BranchImages:
        return BranchImages(self.sets)

    @cached_property
    def start(self) -> StateSet:
        """The states at the start."""
        return self._stated & self.sets.intersection(map(self.sets.where, self.start_facts))

    @cached_property
    def start_facts(self) -> tuple[t.Term, ...]:
        """The definitions, unless no state that the task may start in agrees with them."""
        agreeing = self._stated & self.sets.intersection(map(self.sets.where, self.facts))
        return () if agreeing == self.sets.none else self.facts

    @cached_property
    def _stated(self) -> StateSet:
        """The states that the task states as its start."""
        return self.sets.valid & self.sets.intersection(
            self.sets.one_of(name, values) for name, values in self.starts.items()
        )

    @cached_property
    def reachable(self) -> dict[Place, StateSet]:
        """Reachable states by place."""
        places = list(self.program.moves)
        order = {place: -number for number, place in enumerate(places)}
        found: dict[Place, StateSet] = dict.fromkeys(places, self.sets.none)
        new = dict(found)
        found[PLAN] = new[PLAN] = self.start
        waiting = [(order[PLAN], PLAN)]
        while waiting:
            _, place = heappop(waiting)
            states, new[place] = new[place], self.sets.none
            for move, branch in self.program.branches(place):
                self._count()
                for target, after in self._branches.after(states, move, branch):
                    more = after & ~found[target]
                    if more != self.sets.none:
                        if new[target] == self.sets.none:
                            heappush(waiting, (order[target], target))
                        found[target] |= more
                        new[target] |= more
        return found

    @cached_property
    def hopeful(self) -> list[dict[Place, StateSet]]:
        """Reachable states that have the goal within reach in 0, 1, 2 … plans, by place.

        The last entry holds for any number of plans.
        """
        rounds: list[dict[Place, StateSet]] = []
        while True:
            last: StateSet = rounds[-1][PLAN] if rounds else self.sets.none
            found: dict[Place, StateSet] = {PLAN: last}
            for place, moves in self.program.moves.items():
                found[place] = self.reachable[place] & self._surely(place, moves, found)
            if rounds and found[PLAN] == last:
                return rounds
            rounds.append(found)

    def _surely(self, place: Place, moves: tuple[Move, ...], targets: Mapping[Place, StateSet]) -> StateSet:
        if place == REACHED:
            return self.sets.every
        if not moves:
            return self.sets.none
        common = self.sets.every
        for move in moves:
            some = ~self.sets.where(move.guard)
            for branch in move.branches:
                if branch.is_likely:
                    self._count()
                    some |= self._branches.surely_before(targets, branch)
            common &= some
        return common

    def rings(self, wanted: Mapping[Place, StateSet]) -> list[dict[Place, StateSet]]:
        """Find the reachable states from which some states are reached in 0, 1, 2 … branches.

        Args:
            wanted: the states by place; some of them are reachable.

        Returns:
            For each number the states from which it takes so many, by place, until a start is among them.
        """
        ring: dict[Place, StateSet] = {place: one & self.reachable[place] for place, one in wanted.items()}
        seen: dict[Place, StateSet] = dict(ring)
        rings = [ring]
        while ring.get(PLAN, self.sets.none) & self.start == self.sets.none:
            before: dict[Place, StateSet] = {}
            for place, move, branch in self._leading_to(ring):
                self._count()
                fresh = self._branches.before(ring, move, branch) & self.reachable[place]
                fresh &= self.sets.every if place not in seen else ~seen[place]
                if fresh != self.sets.none:
                    before[place] = before.get(place, self.sets.none) | fresh
            for place, one in before.items():
                seen[place] = seen.get(place, self.sets.none) | one
            ring = before
            rings.append(ring)
        return rings

    def _leading_to(self, ring: Mapping[Place, StateSet]) -> Iterator[tuple[Place, Move, Any]]:
        """Yield what leads to some places, each once, with the place before."""
        for place in self.program.moves:
            for move, branch in self.program.branches(place):
                if any(end.target in ring for end in branch.ends):
                    yield place, move, branch

    def _count(self) -> None:
        """Count one image.

        Raises:
            StateSpaceError: there were too many of them, or the diagrams are too large.
        """
        self._images += 1
        if self._images > MAX_IMAGES or (self._images % 64 == 0 and len(self.sets.bdd) > MAX_NODES):
            raise StateSpaceError("it has too many states, also as decision diagrams")
