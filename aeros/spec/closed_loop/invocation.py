"""Skills as the agent's loop sees them: states in which they can start, and outcomes measured after."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import product
from math import prod
from typing import Any, Final, NamedTuple

from aeros.spec.closed_loop.definition_facts import UNDECIDED, OutcomeValues
from aeros.spec.closed_loop.giving_up import RunRule
from aeros.spec.closed_loop.outcome_probabilities import outcome_probabilities
from aeros.spec.expr import terms as t
from aeros.spec.expr.effects import QuantityRange, value_after
from aeros.spec.expr.lower import lower, with_constants
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import FamilyType, VectorType
from aeros.spec.model.ecm import Outcome, Skill
from aeros.spec.model.hold_conditions import hold_loss_outcomes, stop_outcomes

MAX_UNSETTLED: Final = 256
"""Greatest number of states that one outcome may lead to, as it leaves variables at any of several values."""

State = tuple[Any, ...]
"""A value for each state variable of a task, in the order of `TransitionSystem.names`.

With a rule of giving up, the history of the run follows (`giving_up.py`).
"""

FindValues = Callable[[Skill, Outcome], OutcomeValues]

_EITHER: Final = (False, True)


class StateCondition:
    """A condition over predicates and constant inputs, decided for states.

    A predicate is looked up, and a conjunction is decided part by part.  Any other term is evaluated, once
    for all states that agree on the predicates that it reads.
    """

    def __init__(self, term: t.Term, names: tuple[str, ...], inputs: Mapping[str, Any] | None = None) -> None:
        self._inputs = inputs or {}
        if any(isinstance(one.type, VectorType | FamilyType) for one in t.variables_of(term).values()):
            # A state has the scalars that a vector or a family consists of.
            term = lower(with_constants(term, self._inputs))
        self._looked_up: list[int] = []
        self._evaluated: list[_InterpretedTerm] = []
        places = _index_by_name(names)
        pending = [term]
        while pending:
            part = pending.pop()
            if isinstance(part, t.And):
                pending += reversed(part.operands)
            elif isinstance(part, t.Variable) and part.name in places and part.name not in self._inputs:
                self._looked_up.append(places[part.name])
            else:
                self._evaluated.append(_InterpretedTerm(part, places, self._inputs))

    @property
    def single_predicate_index(self) -> int | None:
        """The index in a state of the predicate that this condition is; None if it is anything else."""
        is_one = len(self._looked_up) == 1 and not self._evaluated
        return self._looked_up[0] if is_one else None

    def __call__(self, state: State) -> bool:
        """Return whether the condition holds in `state`."""
        for place in self._looked_up:
            if not state[place]:
                return False
        return not self._evaluated or all(part.is_true(state) for part in self._evaluated)


@lru_cache(16)
def _index_by_name(names: tuple[str, ...]) -> dict[str, int]:
    return {name: place for place, name in enumerate(names)}


class _InterpretedTerm:
    """A term that is decided by evaluating it."""

    def __init__(self, term: t.Term, places: Mapping[str, int], inputs: Mapping[str, Any]) -> None:
        self._term = term
        self._inputs = inputs
        self._read = [(places[name], name) for name in t.variables_of(term) if name in places]
        self._decided: dict[State, bool] = {}

    def is_true(self, state: State) -> bool:
        values = tuple([state[place] for place, _ in self._read])
        if values not in self._decided:
            read = {name: state[place] for place, name in self._read}
            self._decided[values] = is_true(self._term, {**self._inputs, **read})
        return self._decided[values]


class _OutcomeEffects(NamedTuple):
    """An outcome, and the places in a state that it changes.

    Attributes:
        outcome: the outcome.
        declared: declared effects by place, which say if it is measured.
        ranges: declared ranges by place, which say so, too.
        known: the declared effects, and values that follow from them.
        computed: by place, conditions on the state afterwards whose value a predicate has.
        unsettled: values by place of predicates that may be either, and of quantities that may be any.
        constraints: conditions that some of these values meet; the others are left out.
    """

    outcome: Outcome
    declared: list[tuple[int, Any]]
    ranges: list[tuple[int, QuantityRange]]
    known: list[tuple[int, Any]]
    computed: dict[int, StateCondition]
    unsettled: list[tuple[int, tuple[Any, ...]]]
    constraints: list[StateCondition]

    def is_measured(self, before: State, after: Sequence[Any]) -> bool:
        """Tell whether all that the outcome declares holds afterwards."""
        return all(
            after[place] == value_after(effect, before[place]) for place, effect in self.declared
        ) and (all(one.low <= after[place] <= one.high for place, one in self.ranges))


class UnsettledError(Exception):
    """An outcome may lead to more than `MAX_UNSETTLED` states."""


class Invocation:
    """A skill with its inputs, which are constant in a task.

    An outcome here is the *measured* one, as in the agent's supervisor.  Of all outcomes whose effects hold
    in the state afterwards, the step counts as the one with the most effects; of several, as a success.

    Args:
        skill: the skill that is run.
        inputs: constant inputs by name; an input left out has its default value.
        names: the predicates of a state, in order.
        settable: predicates that some skill of the loop can set, so that nothing else changes them after the
            hold-condition broke.
        values_after: finds the values that variables may have after an outcome that does not state them.
        rule: keeps the history of the run in each state; None for states without a history.
        has_unknown: a predicate that an outcome leaves at either value is None afterwards; else there is a
            state for each value.

    Raises:
        UnsettledError: one outcome has too many such states.

    Attributes:
        name: id of the skill.
        unsettled: what may be either after the outcomes asked for so far, in words; empty if nothing.
    """

    def __init__(
        self,
        skill: Skill,
        inputs: Mapping[str, Any],
        names: tuple[str, ...],
        settable: Collection[str] = (),
        values_after: FindValues = lambda _skill, _outcome: UNDECIDED,
        rule: RunRule | None = None,
        *,
        has_unknown: bool = False,
    ) -> None:
        bound = {
            declared.name: inputs.get(name, declared.default_value) for name, declared in skill.inputs.items()
        }
        clause = skill.precondition
        self.name = skill.id
        self._precondition = None if clause is None else StateCondition(clause.term, names, bound)
        self.unsettled = ""
        self._names = names
        self._has_unknown = has_unknown
        self._rule = rule
        self._outcomes = [
            (_effects_of(outcome, names, values_after(skill, outcome)), share)
            for outcome, share in outcome_probabilities(skill.outcomes.values())
        ]
        self._unheld = [
            _effects_of(outcome, names, values_after(skill, outcome))
            for outcome in hold_loss_outcomes(skill, settable)
        ]
        self._stops = [
            _effects_of(outcome, names, values_after(skill, outcome)) for outcome in stop_outcomes(skill)
        ]
        for one in self._ends:
            self._check_unsettled(one)

    @property
    def is_settled(self) -> bool:
        """True if no outcome leaves a predicate at either value."""
        return not any(one.unsettled for one in self._ends)

    @property
    def _ends(self) -> list[_OutcomeEffects]:
        """What ends a run that is not stopped."""
        return [*(one for one, _ in self._outcomes), *self._unheld]

    def can_start(self, state: State) -> bool:
        """Check that the precondition holds.

        Args:
            state: a value for each predicate, in the order of the names.

        Returns:
            True if the skill has no precondition or its precondition holds in the state.
        """
        return self._precondition is None or self._precondition(state)

    def after(self, state: State) -> list[tuple[State, Outcome, Fraction]]:
        """List the states that may follow, one for each outcome.

        An outcome is left out if it declares the probability 0, but not if the other outcomes leave it none.
        Being halted because the hold-condition broke is a failure of probability 0 in each state where that
        may happen.

        Args:
            state: a value for each predicate, before the skill runs.

        Returns:
            Each state afterwards, the outcome measured there, and the probability (0 to 1) of that.
        """
        return [ending for case in self.cases(state) for ending in case]

    def cases(self, state: State) -> list[list[tuple[State, Outcome, Fraction]]]:
        """List the states that may follow, as `after` does, together where nothing decides between them.

        Args:
            state: a value for each predicate, before the skill runs.

        Returns:
            For each outcome the states that it may leave: one, or one for each combination of the predicates
            that it leaves at either value. Their shares of its probability are equal, and mean nothing.
        """
        results = []
        for one, whole in self._outcomes:
            if one.outcome.probability != 0:
                states = self._states_after(state, one)
                if len(states) > 1:
                    shown = ", ".join(f"`{self._names[place]}`" for place, _ in one.unsettled)
                    many = "either" if all(values == _EITHER for _, values in one.unsettled) else "several"
                    self.unsettled = (
                        f"{shown} may be {many} after `{self.name} → {one.outcome.id}`: "
                        "state it as an effect of that outcome"
                    )
                share = whole / len(states)
                results.append([(*self._measured(state, after), share) for after in states])
        results += [
            [(tuple(after), one.outcome, Fraction(0)) for after in self._states_after(state, one)]
            for one in self._unheld
        ]
        return results

    def stopped(self, state: State) -> list[State]:
        """List the states in which a run may be stopped with a part of a composition around it.

        Args:
            state: a value for each predicate, before the skill runs.

        Returns:
            The states, each once.

        Raises:
            UnsettledError: there are too many.
        """
        for one in self._stops:
            self._check_unsettled(one)
        found = (tuple(after) for one in self._stops for after in self._states_after(state, one))
        return list(dict.fromkeys(found))

    def _check_unsettled(self, one: _OutcomeEffects) -> None:
        if prod(len(values) for _, values in one.unsettled) > MAX_UNSETTLED and not self._has_unknown:
            raise UnsettledError(f"`{self.name}` leaves {len(one.unsettled)} variables of it at any value")

    def _states_after(self, state: State, one: _OutcomeEffects) -> list[list[Any]]:
        changed = _apply_effects(state, one.known)
        for place, holds in one.computed.items():
            changed[place] = holds(tuple(changed))
        if not one.unsettled:
            return [changed]
        values = [(None,) if self._has_unknown else values for _, values in one.unsettled]
        states = []
        for chosen in product(*values):
            states.append(list(changed))
            for (place, _), value in zip(one.unsettled, chosen, strict=True):
                states[-1][place] = value
        if self._has_unknown:
            return states
        return [each for each in states if all(holds(tuple(each)) for holds in one.constraints)]

    def _measured(self, before: State, after: list[Any]) -> tuple[State, Outcome]:
        outcome = self._measured_outcome(before, after)
        if self._rule is not None:
            after[-1] = self._rule.after_step(before, self.name, outcome, after)
        return tuple(after), outcome

    def _measured_outcome(self, before: State, after: list[Any]) -> Outcome:
        matching = [one.outcome for one, _ in self._outcomes if one.is_measured(before, after)]
        return max(matching, key=lambda one: (one.effect_count, not one.failure))


def _effects_of(outcome: Outcome, names: tuple[str, ...], values: OutcomeValues) -> _OutcomeEffects:
    places = _index_by_name(names)
    declared = [(places[name], value) for name, value in outcome.effects.items()]
    following = [(places[name], value) for name, value in outcome.consequences.items() if name in places]
    computed = {places[name]: StateCondition(one, names) for name, one in values.computed.items()}
    either = [(place, _EITHER) for place, value in following if value is None and place not in computed]
    return _OutcomeEffects(
        outcome,
        declared,
        [(places[one.name], one) for one in outcome.ranges if one.name in places],
        declared + [(place, value) for place, value in following if value is not None],
        computed,
        either + [(places[name], several) for name, several in values.opened.items()],
        [StateCondition(one, names) for one in values.constraints],
    )


def _apply_effects(state: State, effects: list[tuple[int, Any]]) -> list[Any]:
    changed = list(state)
    for place, effect in effects:
        changed[place] = value_after(effect, state[place])
    return changed
