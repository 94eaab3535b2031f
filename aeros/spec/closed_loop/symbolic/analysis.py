"""Analysis of a loop by sets of states, where there are too many states to list.

A fault is a set of reachable states.  The path to one of them is a run of `TransitionSystem`, made move by
move, so it does not rest on the sets.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

from aeros.spec.closed_loop.findings import BlockedStep, LoopPath
from aeros.spec.closed_loop.invocation import State
from aeros.spec.closed_loop.symbolic.builder import build_program
from aeros.spec.closed_loop.symbolic.certificate import CertificateClaim, certificate_claims
from aeros.spec.closed_loop.symbolic.fixpoints import Fixpoints
from aeros.spec.closed_loop.symbolic.program import PLAN, LoopProgram, Place, all_of
from aeros.spec.closed_loop.symbolic.state_sets import StateSet, StateSets
from aeros.spec.closed_loop.transition_system import LoopState, Transition, TransitionSystem
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, negate
from aeros.spec.model.ecm import TaskInvariant


@dataclass
class SymbolicLoop:
    """The loop of one task as sets of states; implements `LoopFindings`.

    Attributes:
        system: the loop.
    """

    system: TransitionSystem

    @cached_property
    def program(self) -> LoopProgram:
        """The loop as a program."""
        return build_program(self.system)

    @cached_property
    def fixpoints(self) -> Fixpoints:
        """Its sets of states."""
        starts = self.system.variables.starts(self.system.task.initial)
        starts |= dict.fromkeys(self.program.plan_bits, (False,))
        variables = self.system.variables
        facts = tuple(map(lower, variables.facts.equivalences(variables.variables)))
        sets = StateSets(self.program.values, self.program.variables)
        return Fixpoints(self.program, starts, sets, facts)

    @property
    def has_choices(self) -> bool:
        """True if the agent chooses between skills somewhere."""
        sets, reachable = self.fixpoints.sets, self.fixpoints.reachable
        return any(
            reachable[place] & sets.where(one.guard) & sets.where(other.guard) != sets.none
            for place, moves in self.program.moves.items()
            for one, other in combinations(moves, 2)
        )

    def blocked_step(self) -> BlockedStep | None:
        """Implement `LoopFindings.blocked_step`.

        Raises:
            InternalError: the step can start, so the diagrams are wrong.
        """
        for index, (due, starts) in enumerate(self.program.first_tries):
            able = all_of(*starts)
            path = self._path_to({Place("try", index): self._where(all_of(due, negate(able)))})
            if path is not None:
                node = path.node
                blocked = self.system.blocked_step(node)
                if blocked is None:
                    raise InternalError("a step starts where the diagrams have it blocked")
                return BlockedStep(path.shown, *blocked)
        return None

    def dead_end(self) -> LoopPath | None:
        """Implement `LoopFindings.dead_end`."""
        path = self._path_to({PLAN: ~self.fixpoints.hopeful[-1][PLAN]})
        return None if path is None else path.shown

    def violation(self, invariant: TaskInvariant) -> LoopPath | None:
        """Implement `LoopFindings.violation`."""
        violated = negate(lower(invariant.term))
        bad = self._where(violated)
        outside = {place: bad for place in self.program.moves if place.kind != "inside"}
        inside = {place: bad for place in self.program.moves if place.kind == "inside"}
        path = self._path_to(outside) or self._path_to(inside, violated)
        return None if path is None else path.shown

    def starts_at_goal(self) -> bool:
        """Implement `LoopFindings.starts_at_goal`."""
        missing = self.fixpoints.start & ~self._where(self.program.goal)
        return bool(missing == self.fixpoints.sets.none)

    def certificate(self) -> Iterator[CertificateClaim]:
        """Make the claims that prove that the loop has no fault, if none was found.

        Returns:
            The claims.
        """
        return certificate_claims(self.fixpoints, self.system.variables)

    def _where(self, term: t.Term) -> StateSet:
        return self.fixpoints.sets.where(term)

    def _path_to(self, wanted: Mapping[Place, StateSet], inside: t.Term | None = None) -> _Path | None:
        """Find a path to a reachable state of some sets.

        If that is in a composition, `inside` is the condition that holds there.

        Raises:
            InternalError: no run of the loop takes the path, so the diagrams are wrong.
        """
        reachable, none = self.fixpoints.reachable, self.fixpoints.sets.none
        meeting = {place: both for place, one in wanted.items() if (both := one & reachable[place]) != none}
        if not meeting:
            return None
        rings = self.fixpoints.rings(meeting)
        first = self.fixpoints.sets.pick(rings[-1][PLAN] & self.fixpoints.start)
        start = tuple(first[name] for name in self.system.names)
        node, labels = LoopState("plan", start), list[str]()
        ring = self._ring_of(node, rings)
        while ring:
            moves = self.system.transitions(node)
            if inside is not None:
                found = self._on_the_way(moves, inside)
                if found is not None:
                    state, name = found
                    return _Path(LoopPath(start, tuple(labels), state, name), node)
            move = min(moves, key=lambda one: self._ring_of(one.target, rings))
            following = self._ring_of(move.target, rings)
            # A recovery that runs nothing is no place of the program.
            if following > ring or (following == ring and node.phase != "recover"):
                raise InternalError("no run of the loop takes the path that the diagrams have")
            node, ring = move.target, following
            labels += [move.label] if move.label else []
        return _Path(LoopPath(start, tuple(labels), node.state), node)

    def _on_the_way(self, moves: list[Transition], violated: t.Term) -> tuple[State, str] | None:
        holds = self.system.condition(violated)
        for move in moves:
            for state in sorted(move.through, key=repr):
                if holds(state):
                    return state, move.label.partition(" → ")[0]
        return None

    def _ring_of(self, node: LoopState, rings: list[dict[Place, StateSet]]) -> int:
        """Find the number of the first ring that a state of the loop is in; their number if it is in none."""
        state = self.system.named(node.state)
        state |= dict.fromkeys(self.program.plan_bits, False)
        due = node.remaining_rules[1:] if node.tries else node.remaining_rules
        state |= {self.program.plan_bits[index]: True for index in due}
        places = self._places_of(node)
        sets = self.fixpoints.sets
        for number, ring in enumerate(rings):
            if any(place in ring and sets.contains(ring[place], state) for place in places):
                return number
        return len(rings)

    def _places_of(self, node: LoopState) -> list[Place]:
        """List the places at which the program has a state of the loop."""
        rules = self.system.task.rules
        if node.phase not in ("try", "recover"):
            return [Place(node.phase, *node.remaining_rules)]
        index = node.remaining_rules[0] if node.remaining_rules else len(rules)
        if node.phase == "recover" and rules[index].between_tries is not None:
            return [Place("recover", index, node.tries)]
        # Rules that are not due are passed over, so the state may be at any of them.
        return (
            [Place("try", index, node.tries)] if node.tries else [Place("try", at) for at in range(index + 1)]
        )


@dataclass(frozen=True, slots=True)
class _Path:
    """A path, and the state of the loop at its end."""

    shown: LoopPath
    node: LoopState
