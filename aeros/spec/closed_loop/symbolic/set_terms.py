"""Sets of states as terms, so that a solver can check what was computed with diagrams.

A set that few clauses describe becomes their conjunction.  Of any other, each node of its diagram becomes a
truth value that is defined by the bit that it tests: so a set of n nodes is n short definitions.  A bit is a
condition on a variable: its value is one of those whose number has that bit.  A value of a quantity stands
for its cell.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any, Final

from aeros.spec.closed_loop.symbolic.program import LoopProgram, all_of, any_of
from aeros.spec.closed_loop.symbolic.state_sets import StateSet, StateSets
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term
from aeros.spec.expr.lower import negate
from aeros.spec.expr.types import BOOL, BoolType, RealType

DEFINITION_SIZE: Final = 40
"""Number of clauses that a solver takes as long for as for one definition, about."""


class SetTerms:
    """Definitions of sets over one choice of terms for the variables.

    Args:
        sets: the diagrams.
        program: the program, whose variables they are over.
        values: term of the value of each variable, before or after a branch, by name.
        mark: end of the names of defined truth values, different for each choice of terms in one question.

    Attributes:
        size: number of clauses so far, and `DEFINITION_SIZE` for each definition.
        definitions: the definitions so far.
        defined: the truth values that they define.
    """

    def __init__(
        self, sets: StateSets, program: LoopProgram, values: Mapping[str, t.Term], mark: str = ""
    ) -> None:
        self._sets = sets
        self._program = program
        self._values = values
        self._mark = mark
        self._bits = {bit: (name, at) for name in values for at, bit in enumerate(sets.bits[name])}
        self._known: dict[object, t.Term] = {}
        self.size = 0
        self.definitions: list[t.Term] = []
        self.defined: list[t.Variable] = []

    def condition(
        self, states: StateSet, given: StateSet | None = None, changed: Collection[str] = ()
    ) -> t.Term:
        """Make the condition that the values are in a set.

        Args:
            states: the set, of which no bit is one afterwards.
            given: a set that the values before are known to be in; clauses that it has, too, are left out.
            changed: variables whose values differ from those before; clauses on them are not left out.

        Returns:
            The condition.
        """
        clauses = self._sets.clauses(states)
        if clauses is None:
            return self._of_nodes(states)
        known = set() if given is None else set(self._sets.clauses(given) or ())
        bits = {bit for name in changed for bit in self._sets.bits[name]}
        kept = [one for one in clauses if one not in known or any(bit in bits for bit, _ in one)]
        self.size += len(kept)
        return all_of(*(any_of([self._literal(*one) for one in sorted(clause)]) for clause in kept))

    def _literal(self, bit: str, value: bool) -> t.Term:
        return self._bit(bit) if value else negate(self._bit(bit))

    def _of_nodes(self, states: StateSet) -> t.Term:
        if states == self._sets.every:
            return t.TRUE
        if states == self._sets.none:
            return t.FALSE
        if states.negated:
            return negate(self._of_nodes(~states))
        return self._defined(int(states), lambda: self._node(states))

    def _node(self, states: StateSet) -> t.Term:
        bit = self._bit(states.var)
        positive = all_of(bit, self._of_nodes(states.high))
        return any_of([positive, all_of(negate(bit), self._of_nodes(states.low))])

    def _bit(self, bit: str) -> t.Term:
        name, at = self._bits[bit]
        if isinstance(self._program.variables[name].type, BoolType):
            return self._values[name]
        if name in self._sets.ordered:
            listed = self._sets.values[name]
            return self._between(name, listed, at + 1, len(listed) - 1)
        return self._defined(bit, lambda: any_of(list(self._ranges(name, at))))

    def _ranges(self, name: str, at: int) -> Iterator[t.Term]:
        """Yield conditions that together say that the number of a variable's value has a bit."""
        listed = self._sets.values[name]
        for begin in range(1 << at, len(listed), 2 << at):
            yield self._between(name, listed, begin, min(begin + (1 << at), len(listed)) - 1)

    def _between(self, name: str, listed: Sequence[Any], first: int, last: int) -> t.Term:
        """Make the condition that a value is one of some that follow each other, or in their cells."""
        value, type_ = self._values[name], self._program.variables[name].type
        if not isinstance(type_, RealType):
            return any_of(
                [t.Compare("==", value, constant_term(one, type_)) for one in listed[first : last + 1]]
            )
        number = RealType(type_.dimension)
        parts: list[t.Term] = []
        if first > 0:
            low, is_open = self._edge(name, listed, first, -1)
            parts.append(t.Compare("<" if is_open else "<=", t.Literal(low, number), value))
        if last < len(listed) - 1:
            high, is_open = self._edge(name, listed, last, 1)
            parts.append(t.Compare("<" if is_open else "<=", value, t.Literal(high, number)))
        return all_of(*parts)

    def _edge(self, name: str, listed: Sequence[Any], at: int, side: int) -> tuple[Fraction, bool]:
        """Find where a value, or its cell, ends on one side, and whether the cell is open there.

        Between two breakpoints, the cell is open, and its neighbours are these.
        """
        points = self._program.breakpoints.get(name)
        if points is None or listed[at] in points:
            return listed[at], False
        return listed[at + side], True

    def _defined(self, key: object, make: Callable[[], t.Term]) -> t.Term:
        if key not in self._known:
            term = make()
            if not isinstance(term, t.Literal | t.Variable):
                kind = "set" if isinstance(key, int) else "bit"
                name = f"{kind} {len(self.defined)}{self._mark}"
                variable = t.Variable(name, BOOL, t.VariableRole.STATE)
                self.size += DEFINITION_SIZE
                self.definitions.append(t.And((t.Implies(variable, term), t.Implies(term, variable))))
                self.defined.append(variable)
                term = variable
            self._known[key] = term
        return self._known[key]
