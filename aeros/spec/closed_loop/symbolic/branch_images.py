"""States before and after the branches of a program, as sets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from aeros.spec.closed_loop.symbolic.program import Move, Place, ProgramBranch
from aeros.spec.closed_loop.symbolic.state_sets import StateSet, StateSets
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import evaluate


class BranchImages:
    """States before and after branches.

    Args:
        sets: the diagrams.
    """

    def __init__(self, sets: StateSets) -> None:
        self._sets = sets
        self._changes: dict[int, _Change] = {}

    def after(self, states: StateSet, move: Move, branch: ProgramBranch) -> Iterator[tuple[Place, StateSet]]:
        """Find the states in which a branch ends.

        Args:
            states: states before.
            move: the move that the branch is of.
            branch: the branch.

        Yields:
            Each place to which it leads, with the states there.
        """
        change = self._change_of(branch)
        possible = states & self._sets.where(move.guard) & self._sets.where(branch.guard) & change.relation
        for end in branch.ends:
            left = possible & self._sets.where(end.guard)
            if left != self._sets.none:
                left = self._sets.bdd.exist(change.old_bits, left)
                yield end.target, self._let(change.to_old, left) & change.stated

    def before(self, targets: Mapping[Place, StateSet], move: Move, branch: ProgramBranch) -> StateSet:
        """Find the states from which a branch may lead to some states.

        Args:
            targets: states by place; none at places that are not listed.
            move: the move that the branch is of.
            branch: the branch.

        Returns:
            The states before.
        """
        leading = self._leading(branch, targets, self._sets.none)
        return self._sets.where(move.guard) & leading

    def surely_before(self, targets: Mapping[Place, StateSet], branch: ProgramBranch) -> StateSet:
        """Find the states from which a branch leads to some states, whatever the open variables become.

        Args:
            targets: states by place; none at places that are not listed.
            branch: the branch.

        Returns:
            The states before, whether the agent may make the move there or not.
        """
        missing = self._leading(branch, {place: ~one for place, one in targets.items()}, self._sets.every)
        return self._sets.where(branch.guard) & ~missing

    def _leading(
        self, branch: ProgramBranch, targets: Mapping[Place, StateSet], otherwise: StateSet
    ) -> StateSet:
        """Find the states before a branch that may lead to some states, or to any at other places."""
        change = self._change_of(branch)
        found = self._sets.none
        for end in branch.ends:
            wanted = targets.get(end.target, otherwise)
            if wanted != self._sets.none:
                wanted = self._let(change.functions, self._let(change.to_new, wanted))
                found |= self._sets.where(end.guard) & wanted
        return self._sets.where(branch.guard) & self._sets.bdd.exist(change.new_bits, found & change.relation)

    def _let(self, replaced: Mapping[str, Any], states: StateSet) -> StateSet:
        return self._sets.bdd.let(replaced, states) if replaced else states

    def _change_of(self, branch: ProgramBranch) -> _Change:
        if id(branch) not in self._changes:
            self._changes[id(branch)] = self._make_change(branch)
        return self._changes[id(branch)]

    def _make_change(self, branch: ProgramBranch) -> _Change:
        functions: dict[str, StateSet] = {}
        relation, related = self._sets.every, []
        changing = {*branch.updates, *branch.opened}
        for name, term in branch.updates.items():
            if isinstance(term, t.Literal):
                for bit, is_set in self._sets.code(name, term.value).items():
                    functions[bit] = self._sets.every if is_set else self._sets.none
            elif self._sets.values[name] == (False, True):
                if t.variables_of(term).keys().isdisjoint(changing):
                    functions[self._sets.bits[name][0]] = self._sets.where(term)
                else:
                    # A function of values that are gone afterwards.
                    related.append(name)
                    (bit,) = self._sets.bits[self._sets.after_names[name]]
                    relation &= self._sets.bdd.apply("<=>", self._sets.bdd.var(bit), self._sets.where(term))
            else:
                related.append(name)
                relation &= self._sum(name, term)
        for name, values in branch.opened.items():
            related.append(name)
            relation &= self._sets.one_of(self._sets.after_names[name], values)
        pairs = [
            pair
            for name in related
            for pair in zip(self._sets.bits[name], self._sets.bits[self._sets.after_names[name]], strict=True)
        ]
        return _Change(
            branch,
            functions,
            self._sets.intersection(
                self._sets.bdd.apply("<=>", self._sets.bdd.var(bit), one) for bit, one in functions.items()
            ),
            relation,
            old_bits=[*functions, *(old for old, _ in pairs)],
            new_bits=[new for _, new in pairs],
            to_old={new: old for old, new in pairs},
            to_new=dict(pairs),
        )

    def _sum(self, name: str, term: t.Term) -> StateSet:
        """Relate the value of a whole number to its value after an increment, where it stays in its range."""
        found = self._sets.none
        for value in self._sets.values[name]:
            after = evaluate(term, {name: value})
            if after in self._sets.values[name]:
                found |= self._sets.equals(name, value) & self._sets.equals(
                    self._sets.after_names[name], after
                )
        return found


@dataclass(frozen=True, slots=True)
class _Change:
    """Change that a branch makes.

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

    branch: ProgramBranch
    functions: Mapping[str, StateSet]
    stated: StateSet
    relation: StateSet
    old_bits: Sequence[str]
    new_bits: Sequence[str]
    to_old: Mapping[str, str]
    to_new: Mapping[str, str]
