"""Sets of states as binary decision diagrams, and what the branches of a program do to them.

Each variable has bits for the number of its value in the list of its values.  A number with few values has a
bit for each but the first, which tells whether it is at least that.  Any other variable has the binary digits
of the value's number.  A second copy of the bits is for the values after a branch.  The diagrams are those of
the library `dd`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Any, Final

from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.symbolic.clauses import Clause, clauses_of
from aeros.spec.closed_loop.symbolic.program import Branch, Move, Place, afterwards
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import evaluate, is_true
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
        self._after: dict[str, str] = {}
        self._equal: dict[tuple[str, Any], StateSet] = {}
        self._conditions: dict[int, tuple[t.Term, StateSet]] = {}
        self._clauses: dict[StateSet, tuple[Clause, ...] | None] = {}
        self._changes: dict[int, _Change] = {}
        self.none: StateSet = self.bdd.false
        self.every: StateSet = self.bdd.true
        self.valid: StateSet = self.every
        for name, listed in values.items():
            self.declare(variables[name], listed)

    def declare(self, variable: t.Variable, values: Sequence[Any]) -> None:
        """Add a variable.

        Args:
            variable: the variable.
            values: its values.
        """
        place, after = len(self._after), afterwards(variable).name
        self._after[variable.name] = after
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
            self._equal[key] = self.bdd.cube(self._code(name, value))
        return self._equal[key]

    def _code(self, name: str, value: Any) -> dict[str, bool]:
        """Give the bits of a variable that has a value."""
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
            case t.Variable(name=name):
                return self.equals(name, True)
            case t.Not(operand=operand):
                return ~self.where(operand)
            case t.And(operands=operands):
                return self.intersection(map(self.where, operands))
            case t.Or(operands=operands):
                return ~self.intersection(~self.where(one) for one in operands)
            case t.Implies(premise=premise, conclusion=conclusion):
                return ~self.where(premise) | self.where(conclusion)
            case _:
                return self._enumerated(term)

    def _enumerated(self, term: t.Term) -> StateSet:
        """Decide a condition for every combination of the values that it reads."""
        read = sorted(t.variables_of(term))
        if prod(len(self.values[name]) for name in read) > MAX_COMBINATIONS:
            names = " and ".join(f"`{name}`" for name in read)
            raise StateSpaceError(f"a condition compares too many values of {names}")
        found = self.bdd.false
        for chosen in product(*(self.values[name] for name in read)):
            if is_true(term, dict(zip(read, chosen, strict=True))):
                found |= self.intersection(map(self.equals, read, chosen))
        return found

    def after(self, states: StateSet, move: Move, branch: Branch) -> Iterator[tuple[Place, StateSet]]:
        """Find the states in which a branch ends.

        Args:
            states: states before.
            move: the move that the branch is of.
            branch: the branch.

        Yields:
            Each place to which it leads, with the states there.
        """
        change = self._change_of(branch)
        possible = states & self.where(move.guard) & self.where(branch.guard) & change.relation
        for end in branch.ends:
            left = possible & self.where(end.guard)
            if left != self.none:
                left = self.bdd.exist(change.old_bits, left)
                yield end.target, self._let(change.to_old, left) & change.stated

    def before(self, targets: Mapping[Place, StateSet], move: Move, branch: Branch) -> StateSet:
        """Find the states from which a branch may lead to some states.

        Args:
            targets: states by place; none at places that are not listed.
            move: the move that the branch is of.
            branch: the branch.

        Returns:
            The states before.
        """
        leading = self._leading(branch, targets, self.none)
        return self.where(move.guard) & leading

    def surely_before(self, targets: Mapping[Place, StateSet], branch: Branch) -> StateSet:
        """Find the states from which a branch leads to some states, whatever the open variables become.

        Args:
            targets: states by place; none at places that are not listed.
            branch: the branch.

        Returns:
            The states before, whether the agent may make the move there or not.
        """
        missing = self._leading(branch, {place: ~one for place, one in targets.items()}, self.every)
        return self.where(branch.guard) & ~missing

    def _leading(self, branch: Branch, targets: Mapping[Place, StateSet], otherwise: StateSet) -> StateSet:
        """Find the states before a branch that may lead to some states, or to any at other places."""
        change = self._change_of(branch)
        found = self.none
        for end in branch.ends:
            wanted = targets.get(end.target, otherwise)
            if wanted != self.none:
                wanted = self._let(change.functions, self._let(change.to_new, wanted))
                found |= self.where(end.guard) & wanted
        return self.where(branch.guard) & self.bdd.exist(change.new_bits, found & change.relation)

    def _let(self, replaced: Mapping[str, Any], states: StateSet) -> StateSet:
        return self.bdd.let(replaced, states) if replaced else states

    def _change_of(self, branch: Branch) -> _Change:
        if id(branch) not in self._changes:
            self._changes[id(branch)] = self._make_change(branch)
        return self._changes[id(branch)]

    def _make_change(self, branch: Branch) -> _Change:
        functions: dict[str, StateSet] = {}
        relation, related = self.every, []
        for name, term in branch.updates.items():
            if isinstance(term, t.Literal):
                for bit, is_set in self._code(name, term.value).items():
                    functions[bit] = self.every if is_set else self.none
            elif self.values[name] == (False, True):
                functions[self.bits[name][0]] = self.where(term)
            else:
                related.append(name)
                relation &= self._sum(name, term)
        for name, values in branch.opened.items():
            related.append(name)
            relation &= self.one_of(self._after[name], values)
        pairs = [
            pair
            for name in related
            for pair in zip(self.bits[name], self.bits[self._after[name]], strict=True)
        ]
        return _Change(
            branch,
            functions,
            self.intersection(
                self.bdd.apply("<=>", self.bdd.var(bit), one) for bit, one in functions.items()
            ),
            relation,
            old_bits=[*functions, *(old for old, _ in pairs)],
            new_bits=[new for _, new in pairs],
            to_old={new: old for old, new in pairs},
            to_new=dict(pairs),
        )

    def _sum(self, name: str, term: t.Term) -> StateSet:
        """Relate the value of a whole number to its value after an increment, where it stays in its range."""
        found = self.none
        for value in self.values[name]:
            after = evaluate(term, {name: value})
            if after in self.values[name]:
                found |= self.equals(name, value) & self.equals(self._after[name], after)
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
        for name in self._after:
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
            bit: is_set for name, value in state.items() for bit, is_set in self._code(name, value).items()
        }
        return bool(self.bdd.let(bits, states) == self.every)


@dataclass(frozen=True, slots=True)
class _Change:
    """What a branch changes.

    Attributes:
        branch: the branch, which lives as long as this.
        functions: bits after the branch as sets of states before, where the value afterwards is a function.
        stated: the states after the branch in which these bits are so.
        relation: pairs of a state before and values afterwards, for all other variables that change.
        old_bits: bits before the branch of all variables that change.
        new_bits: bits afterwards of those in `relation`.
        to_old: these bits, and the bits of the same variables before.
        to_new: the reverse.
    """

    branch: Branch
    functions: Mapping[str, StateSet]
    stated: StateSet
    relation: StateSet
    old_bits: Sequence[str]
    new_bits: Sequence[str]
    to_old: Mapping[str, str]
    to_new: Mapping[str, str]


def _new_diagrams() -> Any:
    """Make an empty set of diagrams, by the C library of `dd` where it has one."""
    try:
        from dd import cudd as diagrams
    except ImportError:
        from dd import autoref as diagrams
    manager = diagrams.BDD()
    manager.configure(reordering=True)
    return manager
