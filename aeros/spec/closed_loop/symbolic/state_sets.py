"""Sets of states as binary decision diagrams, and what the branches of a program do to them.

Each variable has bits for the number of its value in the list of its values.  A number with few values has a
bit for each but the first, which tells whether it is at least that.  Any other variable has the binary digits
of the value's number.  A second copy of the bits is for the values after a branch.  The diagrams are those of
the library `dd`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from math import prod
from typing import Any, Final

from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.symbolic.clauses import Clause, clauses_of
from aeros.spec.closed_loop.symbolic.program import afterwards
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import RealType

MAX_COMBINATIONS: Final = 65_536
"""Largest number of combinations of values that one comparison is decided for."""

MAX_ORDERED: Final = 32
"""Values of a number that has a bit for each of them, at most."""

MAX_CLAUSES: Final = 400
"""Largest number of clauses as which a set is told to a solver."""

StateSet = Any
"""A diagram of `dd`."""


class StateSets:
    """Sets of values of variables.

    Args:
        values: values of each variable, by name, in the order of the diagrams.
        variables: the variables as terms, by name.

    Attributes:
        values: values of each variable, and of the same variable afterwards, by name.
        bits: names of the bits of each of these, by name.
        after_names: name of each variable afterwards, by name.
        ordered: names of those that have a bit for each value but the first.
        none: the empty set.
        every: the set of everything.
        valid: the set of all states, in which bits are those of values.
    """

    def __init__(self, values: Mapping[str, Sequence[Any]], variables: Mapping[str, t.Variable]) -> None:
        self.bdd = _new_diagrams()
        self.values: dict[str, Sequence[Any]] = {}
        self.bits: dict[str, list[str]] = {}
        self.ordered: set[str] = set()
        self.after_names: dict[str, str] = {}
        self._equal: dict[tuple[str, Any], StateSet] = {}
        self._conditions: dict[int, tuple[t.Term, StateSet]] = {}
        self._clauses: dict[StateSet, tuple[Clause, ...] | None] = {}
        self.none: StateSet = self.bdd.false
        self.every: StateSet = self.bdd.true
        self.valid: StateSet = self.every
        for name, listed in values.items():
            self._declare(variables[name], listed)

    def _declare(self, variable: t.Variable, values: Sequence[Any]) -> None:
        """Add a variable with its values."""
        place, after = len(self.after_names), afterwards(variable).name
        self.after_names[variable.name] = after
        is_ordered = isinstance(variable.type, RealType) and len(values) <= MAX_ORDERED
        width = len(values) - 1 if is_ordered else max((len(values) - 1).bit_length(), 1)
        for number in range(width):
            self.bdd.declare(f"{place}.{number}", f"{place}.{number}'")
        for whole, mark in ((variable.name, ""), (after, "'")):
            self.values[whole] = values
            self.bits[whole] = [f"{place}.{number}{mark}" for number in range(width)]
            if is_ordered:
                self.ordered.add(whole)
        self.valid &= self.one_of(variable.name, values)

    def intersection(self, sets: Iterable[StateSet]) -> StateSet:
        """Intersect sets.

        Args:
            sets: the sets.

        Returns:
            The states in all of them.
        """
        common = self.bdd.true
        for one in sets:
            common &= one
        return common

    def equals(self, name: str, value: Any) -> StateSet:
        """Make the set of all states in which a variable has a value.

        Args:
            name: the variable.
            value: one of its values.

        Returns:
            The set.
        """
        key = (name, value)
        if key not in self._equal:
            self._equal[key] = self.bdd.cube(self.code(name, value))
        return self._equal[key]

    def code(self, name: str, value: Any) -> dict[str, bool]:
        """Give the bits of a variable that has a value.

        Args:
            name: the variable.
            value: one of its values.

        Returns:
            The bits by name.
        """
        number = self.values[name].index(value)
        if name in self.ordered:
            return {bit: number > at for at, bit in enumerate(self.bits[name])}
        return {bit: bool(number >> at & 1) for at, bit in enumerate(self.bits[name])}

    def one_of(self, name: str, values: Iterable[Any]) -> StateSet:
        """Make the set of all states in which a variable has one of some values.

        Args:
            name: the variable.
            values: some of its values.

        Returns:
            The set.
        """
        union = self.bdd.false
        for value in values:
            union |= self.equals(name, value)
        return union

    def where(self, term: t.Term) -> StateSet:
        """Make the set of all states in which a condition holds.

        Args:
            term: lowered condition over the variables, before a branch and after it.

        Returns:
            The set.

        Raises:
            StateSpaceError: a comparison in it reads variables with too many combinations of values.
        """
        known = self._conditions.get(id(term))
        if known is None:
            known = self._conditions[id(term)] = (term, self._where(term))
        return known[1]

    def _where(self, term: t.Term) -> StateSet:
        match term:
            case t.Literal(value=value):
                return self.bdd.true if value else self.bdd.false
            case t.Not(operand=operand):
                return ~self.where(operand)
            case t.And(operands=operands):
                return self.intersection(map(self.where, operands))
            case t.Or(operands=operands):
                return ~self.intersection(~self.where(one) for one in operands)
            case _:
                return self._enumerated(term)

    def _enumerated(self, term: t.Term) -> StateSet:
        """Decide a condition for every combination of the values that it reads.

        Raises:
            StateSpaceError: there are too many.
        """
        read = sorted(t.variables_of(term))
        if prod(len(self.values[name]) for name in read) > MAX_COMBINATIONS:
            names = " and ".join(f"`{name}`" for name in read)
            raise StateSpaceError(f"a condition compares too many values of {names}")
        found = self.bdd.false
        for chosen in product(*([(name, value) for value in self.values[name]] for name in read)):
            if is_true(term, dict(chosen)):
                found |= self.intersection(self.equals(*one) for one in chosen)
        return found

    def clauses(self, states: StateSet) -> tuple[Clause, ...] | None:
        """List clauses that hold together exactly in a set, wherever bits are those of values.

        Args:
            states: the set.

        Returns:
            The clauses; None if there are more than `MAX_CLAUSES`.
        """
        if states not in self._clauses:
            self._clauses[states] = clauses_of(self.bdd, states, self.valid, MAX_CLAUSES)
        return self._clauses[states]

    def pick(self, states: StateSet) -> dict[str, Any]:
        """Choose a state of a set.

        Args:
            states: the set; not empty.

        Returns:
            Value of each variable by name: for each in turn the first value with which there is a state.
        """
        chosen: dict[str, Any] = {}
        for name in self.after_names:
            for value in self.values[name]:
                left = states & self.equals(name, value)
                if left != self.none:
                    chosen[name], states = value, left
                    break
        return chosen

    def contains(self, states: StateSet, state: Mapping[str, Any]) -> bool:
        """Tell whether a state is in a set.

        Args:
            states: the set.
            state: value of each variable by name.

        Returns:
            True if it is.
        """
        bits = {
            bit: is_set for name, value in state.items() for bit, is_set in self.code(name, value).items()
        }
        return bool(self.bdd.let(bits, states) == self.every)


def _new_diagrams() -> Any:
    """Make an empty set of diagrams, by the C library of `dd` where it has one."""
    try:
        from dd import cudd as diagrams
    except ImportError:
        from dd import autoref as diagrams
    manager = diagrams.BDD()
    manager.configure(reordering=True)
    return manager
