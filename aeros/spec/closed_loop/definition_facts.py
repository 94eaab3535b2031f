"""Definitions as facts about the states of a loop: a predicate is true exactly where its definition holds.

That is used where a state has everything that the definition reads.  At the start, states that contradict a
definition are left out.  After an outcome that leaves a predicate at either value, it has the value of its
definition; and of quantities that the outcome leaves open, those values are left out with which a predicate
would not have the value that it is known to have.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Any, Final, NamedTuple

from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import junction, negate
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.ecm import Outcome

MAX_COMBINATIONS: Final = 4096
"""Combinations of values for which a definition is evaluated, at most; with more, it leaves out none."""


class OutcomeValues(NamedTuple):
    """Values of variables after an outcome that its effects do not state.

    Attributes:
        opened: values of each quantity of which nothing decides which it has.
        computed: predicates that have the value of a condition on the state afterwards, none of which reads
            an open variable.
        constraints: conditions on the state afterwards that hold for some values of the open variables.
    """

    opened: Mapping[str, tuple[Any, ...]]
    computed: Mapping[str, t.Term]
    constraints: tuple[t.Term, ...]


UNDECIDED: Final = OutcomeValues({}, {}, ())
"""Nothing is known beside the effects."""


@dataclass(frozen=True)
class DefinitionFacts:
    """Definitions of predicates of a loop, on its other variables alone.

    Attributes:
        conditions: the condition under which each predicate is true, on scalars.
    """

    conditions: Mapping[str, t.Term]

    def equivalences(self, variables: Mapping[str, t.Variable]) -> tuple[t.Term, ...]:
        """Write each definition as a condition on a state.

        Args:
            variables: the variables of the loop by name.

        Returns:
            That predicate and definition have the same value, for each.
        """
        return tuple(_equivalence(variables[name], one) for name, one in self.conditions.items())

    def after(
        self,
        outcome: Outcome,
        opened: Mapping[str, tuple[Any, ...]],
        variables: Mapping[str, t.Variable],
    ) -> OutcomeValues:
        """Find what definitions say after an outcome.

        Args:
            outcome: the outcome with its consequences.
            opened: values of quantities of which nothing decides which they have.
            variables: the variables of the loop by name.

        Returns:
            The values; each constraint is met by some values of open variables, whatever the others are.
        """
        open_predicates = {name for name, value in outcome.consequences.items() if value is None}
        computed: dict[str, t.Term] = {}
        constraints: list[t.Term] = []
        known: list[t.Term] = []
        for name, condition in self.conditions.items():
            read = t.variables_of(condition).keys()
            if name in open_predicates and read.isdisjoint(opened):
                computed[name] = condition
            elif name in open_predicates:
                constraints.append(_equivalence(variables[name], condition))
            elif read <= opened.keys():
                value = {**outcome.consequences, **outcome.effects}.get(name)
                if isinstance(value, bool):
                    known.append(condition if value else negate(condition))
        return OutcomeValues(opened, computed, (*constraints, *_possible(known, opened)))


def _equivalence(variable: t.Variable, condition: t.Term) -> t.Term:
    both = junction(t.And, [variable, condition])
    neither = junction(t.And, [negate(variable), negate(condition)])
    return junction(t.Or, [both, neither])


def _possible(conditions: Sequence[t.Term], opened: Mapping[str, tuple[Any, ...]]) -> Iterable[t.Term]:
    """Return the conditions if some values of open variables meet them all, else none of them."""
    names = {name for one in conditions for name in t.variables_of(one)}
    if prod(len(opened[name]) for name in names) > MAX_COMBINATIONS:
        return ()
    for values in product(*([(name, value) for value in opened[name]] for name in names)):
        if all(is_true(one, dict(values)) for one in conditions):
            return conditions
    return ()
