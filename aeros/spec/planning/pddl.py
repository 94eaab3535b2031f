"""PDDL writer of planning domains, for classical planners; `plan_check.py` checks their plans.

Each success of a choice becomes an action of its own (the usual determinization of several outcomes: a
planner may hope for each), with the conditions under which it is measured as a success. Choices that cannot
start for lack of a measurement are left out. Failures and the invariants of a task are not written, so a plan
that works in PDDL may still be rejected. What an outcome leaves at either value is unknown after it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from itertools import product
from typing import Any

from aeros.spec.closed_loop.invocation import State
from aeros.spec.expr import terms as t
from aeros.spec.expr.effects import Increment, value_after
from aeros.spec.expr.types import BoolType
from aeros.spec.model.ecm import Outcome
from aeros.spec.planning.domain import GroundSkill, PartialCondition, PlanningDomain


def action_name(choice: GroundSkill, outcome: str) -> str:
    """Make the PDDL name of a success of a choice; `plan_check.py` reads it, too.

    Args:
        choice: skill with inputs.
        outcome: id of the outcome.

    Returns:
        The name.
    """
    given = [_word(value) for value in choice.inputs.values()]
    return "-".join([choice.module, choice.skill.id, *given, outcome])


def write_pddl(
    domain: PlanningDomain, start: State, excluded: Collection[tuple[State, str]] = ()
) -> tuple[str, str]:
    """Write a planning problem as PDDL.

    Args:
        domain: planning domain.
        start: first state.
        excluded: pairs of a state and the case-folded name of an action that must not be used in it.

    Returns:
        The text of the domain file and of the problem file.
    """
    writer = _PddlWriter(domain, start, excluded)
    return writer.domain_file(), writer.problem_file()


class _PddlWriter:
    """Writer of one domain.

    `_values` holds every value that a variable may ever have, `_unknown` the variables unknown at the start.
    """

    def __init__(self, domain: PlanningDomain, start: State, excluded: Collection[tuple[State, str]]) -> None:
        self._domain = domain
        self._excluded = excluded
        self._start = dict(zip(domain.names, start, strict=True))
        self._unknown = [
            name for name, value in self._start.items() if value is None or name in domain.unsettled
        ]
        self._values: dict[str, tuple[Any, ...]] = {
            name: tuple(dict.fromkeys(v for v in (self._start[name], *set_) if v is not None))
            for name, set_ in domain.settings.items()
        }

    def domain_file(self) -> str:
        atoms = [
            self._atom(name, value) for name in self._domain.names for value in self._values_with_atoms(name)
        ]
        atoms += [_unknown(name) for name in self._unknown]
        actions = [
            action
            for choice in self._domain.choices
            if not choice.condition.missing
            for action in self._actions(choice)
        ]
        predicates = "\n    ".join(dict.fromkeys(atoms))
        return (
            "(define (domain aeros)\n  (:requirements :adl)\n"
            f"  (:predicates\n    {predicates})\n" + "\n".join(actions) + ")\n"
        )

    def problem_file(self) -> str:
        true = [
            self._atom(name, value)
            for name, value in self._start.items()
            if value is not None and value in self._values_with_atoms(name)
        ]
        true += [_unknown(name) for name in self._unknown if self._start[name] is None]
        goal = self._condition(self._domain.goal)
        return f"(define (problem goal)\n  (:domain aeros)\n  (:init {' '.join(true)})\n  (:goal {goal}))\n"

    def _actions(self, choice: GroundSkill) -> Iterator[str]:
        for outcome in choice.skill.outcomes.values():
            ways = [] if outcome.probability == 0 else self._success_conditions(choice, outcome)
            if not ways:
                continue
            success = [] if [] in ways else [f"(or {' '.join(_conjunction(way) for way in ways)})"]
            name = action_name(choice, outcome.id)
            states = [state for state, action in self._excluded if action == name.casefold()]
            elsewhere = [f"(not {self._state_facts(state)})" for state in states]
            needs = [self._condition(choice.condition), *success, *elsewhere]
            effects = [
                part
                for name, value in outcome.known_effects.items()
                if name in self._values
                for part in self._setting(name, value)
            ]
            effects += [_unknown(name) for name in outcome.unsettled if name in self._values]
            yield (
                f"  (:action {name}\n    :parameters ()\n"
                f"    :precondition {_conjunction(needs)}\n    :effect {_conjunction(effects)})"
            )

    def _success_conditions(self, choice: GroundSkill, outcome: Outcome) -> list[list[str]]:
        """Return the conditions under which a success, and no failure with more effects, is measured."""
        ways = []
        for success in choice.skill.success_outcomes:
            if _clash(success, outcome):
                continue
            more = choice.skill.failures_with_more_effects(success)
            rivals = [
                f"(not {_conjunction(self._remaining_effects(o, outcome))})"
                for o in more
                if not _clash(o, outcome)
            ]
            ways.append([*self._remaining_effects(success, outcome), *rivals])
        return ways

    def _remaining_effects(self, measured: Outcome, happened: Outcome) -> list[str]:
        """Return the effects of `measured` that must hold before, since `happened` does not set them.

        An increment that did not happen is not measured, nor is what may be either.
        """
        rest = {name: v for name, v in measured.effects.items() if name not in happened.known_effects}
        return [
            "(or)" if isinstance(effect, Increment) or name in happened.unsettled else self._is(name, effect)
            for name, effect in rest.items()
        ]

    def _setting(self, name: str, effect: Any) -> Iterator[str]:
        """Yield the parts of an effect; an increment has a part for each value before, under `when`."""
        if not isinstance(effect, Increment):
            yield from self._setting_to(name, effect)
            return
        for before in self._values[name]:
            after = value_after(effect, before)
            if after in self._values[name]:
                change = f"(and (not {self._atom(name, before)}) {self._atom(name, after)})"
                yield f"(when {self._atom(name, before)} {change})"

    def _setting_to(self, name: str, value: Any) -> Iterator[str]:
        for other in self._values_with_atoms(name):
            atom = self._atom(name, other)
            yield atom if other == value else f"(not {atom})"
        if name in self._unknown:
            yield f"(not {_unknown(name)})"

    # Conditions.

    def _state_facts(self, state: State) -> str:
        """Return the condition that all values are as in `state`."""
        values = zip(self._domain.names, state, strict=True)
        return _conjunction(
            [_unknown(name) if value is None else self._is(name, value) for name, value in values]
        )

    def _condition(self, condition: PartialCondition) -> str:
        if condition.missing:
            return "(or)"
        known = [f"(not {_unknown(name)})" for name in condition.reads if name in self._unknown]
        return _conjunction([*known, self._formula(condition.term, condition.constants)])

    def _formula(self, term: t.Term, constants: Mapping[str, Any]) -> str:
        match term:
            case t.And(operands=operands):
                return _conjunction([self._formula(one, constants) for one in operands])
            case t.Or(operands=operands):
                return f"(or {' '.join(self._formula(one, constants) for one in operands)})"
            case t.Not(operand=operand):
                return f"(not {self._formula(operand, constants)})"
        one = PartialCondition(term, self._domain.names, constants)
        ways = [
            _conjunction([self._is(name, value) for name, value in zip(one.reads, values, strict=True)])
            for values in product(*(self._values[name] for name in one.reads))
            if one.evaluate_on(values) is True
        ]
        return ways[0] if len(ways) == 1 else f"(or {' '.join(ways)})"

    def _is(self, name: str, value: Any) -> str:
        if self._is_truth(name):
            atom = self._atom(name, True)
            known = "" if name not in self._unknown else f"(not {_unknown(name)})"
            holds = atom if value else f"(not {atom})"
            return f"(and {known} {holds})" if known else holds
        return self._atom(name, value) if value in self._values[name] else "(or)"

    def _atom(self, name: str, value: Any) -> str:
        word = _pddl_name(name)
        return f"({word})" if self._is_truth(name) else f"({word}-is-{_word(value)})"

    def _values_with_atoms(self, name: str) -> tuple[Any, ...]:
        """Return the values that have an atom each."""
        return (True,) if self._is_truth(name) else self._values[name]

    def _is_truth(self, name: str) -> bool:
        return isinstance(self._domain.variables[name].type, BoolType)


def _conjunction(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"(and {' '.join(parts)})"


def _clash(measured: Outcome, happened: Outcome) -> bool:
    return any(measured.effects.get(name, value) != value for name, value in happened.known_effects.items())


def _unknown(name: str) -> str:
    return f"(unknown-{_pddl_name(name)})"


def _pddl_name(name: str) -> str:
    """Write the name of a state variable; that of a module's variable has a `.`, which PDDL has not."""
    return name.replace(".", "--")


def _word(value: Any) -> str:
    """Format a value as part of a name."""
    return str(value).lower().replace("-", "minus-").replace("/", "-over-").replace(".", "-point-")
