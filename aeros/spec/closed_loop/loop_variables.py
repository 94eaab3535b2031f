"""State variables that a task's loop depends on, and the values that each can have in a state of it.

A truth value, a member of an enum and a whole number with a range have their own values.  A quantity has a
value for each of its cells (`aeros.spec.closed_loop.cells`).  A vector or a family counts as the scalars that
it consists of.

After an outcome, a quantity has the value that the outcome states, or any in the range that it states.  If it
states neither, the quantity may have any value where the skill may move what measures it
(`aeros.spec.consequences.disturbance`), or where the outcome states a predicate that is defined by it.  Else
it is as before.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any, Final

from aeros.spec.closed_loop.cells import NoCellsError, breakpoints, cells, values_between
from aeros.spec.closed_loop.definition_facts import DefinitionFacts, OutcomeValues
from aeros.spec.consequences.consequences import expanded_definition, known_definitions
from aeros.spec.consequences.disturbance import is_moved, readings_behind
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, values_by_scalar, with_constants
from aeros.spec.expr.types import BoolType, EnumType, FamilyType, IntegerType, RealType, VectorType
from aeros.spec.expr.units import format_quantity
from aeros.spec.model.ecm import Ecm, Outcome, PlanningRule, Skill, Task
from aeros.spec.model.hold_conditions import HOLD_LOST, STOPPED, predicates_of
from aeros.spec.model.site import Site
from aeros.spec.model.step_graph import HeldPart, If, steps_of, walk_parts
from aeros.spec.model.task_parameters import is_parameter
from aeros.spec.model.variables import Declared

MAX_NUMBERS: Final = 4096
"""Values of a whole number, at most."""

MAX_CELLS: Final = 256
"""Cells of a quantity, at most."""

Values = tuple[Any, ...]


class StateSpaceError(Exception):
    """The state space of the loop is infinite or too large; the message says which."""


class LoopVariables:
    """The state variables of one task's loop.

    Args:
        ecm: module that declares the task.
        task: the task.
        site: site under which the module is elaborated.

    Raises:
        StateSpaceError: a variable does not have finitely many values or cells.

    Attributes:
        variables: the variables as terms, by name, in the order of every state.
        values: the values of each of them.
        breakpoints: those values of each quantity that are cells of their own.
        declared: declaration of each variable, or of the vector or family that it is a part of.
        facts: definitions of variables that read other variables of the loop alone.
    """

    def __init__(self, ecm: Ecm, task: Task, site: Site) -> None:
        self._site = site
        self._definitions = known_definitions(ecm)
        conditions = list(conditions_of(ecm, task))
        skills = skills_of(ecm, task)
        self.variables = _scalars(conditions, skills, site)
        self.declared = {one.name: site.state[_whole_name(one, site)] for one in self.variables.values()}
        numbers = _compared_numbers(skills, task, self.variables)
        defining = self._defining_conditions()
        self.values: dict[str, Values] = {}
        self.breakpoints: dict[str, frozenset[Fraction]] = {}
        quantities = [name for name, one in self.variables.items() if is_quantity(one)]
        for name, one in self.variables.items():
            if name not in quantities:
                self.values[name] = _listed_values(self.declared[name], one)
        self.facts = DefinitionFacts(
            {name: one for name, one in defining.items() if self._has_cells(one, quantities)}
        )
        conditions += self.facts.conditions.values()
        for name in quantities:
            self.values[name] = self._cells(name, conditions, numbers.get(name, set()), quantities)
        self.values = {name: self.values[name] for name in self.variables}
        self._quantities = tuple(quantities)
        set_by_skills = {name for skill in skills for one in skill.outcomes.values() for name in one.effects}
        self._counts = tuple(
            name
            for name, one in self.variables.items()
            if isinstance(one.type, IntegerType) and name in set_by_skills
        )

    def starts(self, initial: Mapping[str, Any]) -> dict[str, Values]:
        """List the values that each variable may have at the start of a task.

        Args:
            initial: values that the task states, by name of a whole variable.

        Returns:
            For each variable that value alone, or all its values; a parameter may have any.
        """
        found: dict[str, Values] = {}
        for name in self.variables:
            declared = self.declared[name]
            stated = initial.get(declared.name)
            if stated is None or is_parameter(declared):
                found[name] = self.values[name]
            else:
                scalars = values_by_scalar({declared.name: declared.variable}, {declared.name: stated})
                found[name] = (scalars[name],)
        return found

    def format(self, name: str, value: Any) -> str:
        """Format a value as a manifest writes it.

        Args:
            name: name of the variable.
            value: a value of it, SI.

        Returns:
            `NAME = VALUE`, with the unit of a quantity.
        """
        declared = self.declared[name]
        in_unit = name in self._quantities
        return f"{name} = {format_quantity(value, declared.unit) if in_unit else str(value).lower()}"

    def after(self, skill: Skill, outcome: Outcome) -> OutcomeValues:
        """Find the values that variables may have after an outcome that does not state them.

        Args:
            skill: a skill of the loop, with the consequences of its outcomes.
            outcome: an outcome of it, or an end without a declared outcome.

        Returns:
            The values; several for each quantity that is open, and for each whole number that a halted run
            may have set.
        """
        opened = {
            name: values
            for name in self._quantities
            if (values := self._open_values(name, skill, outcome)) is not None
        }
        if outcome.id in (HOLD_LOST, STOPPED):
            halted = (
                name for name in self._counts if name not in outcome.effects and self._may_set(name, skill)
            )
            opened |= {name: self.values[name] for name in halted}
        return self.facts.after(outcome, opened, self.variables)

    def _defining_conditions(self) -> dict[str, t.Term]:
        """Return the definitions of variables that read other variables of the loop alone, on scalars."""
        found = {
            name: lower(expanded_definition(name, self._definitions))
            for name in self.variables
            if name in self._definitions
        }
        return {
            name: one for name, one in found.items() if t.variables_of(one).keys() <= self.variables.keys()
        }

    def _has_cells(self, condition: t.Term, quantities: Sequence[str]) -> bool:
        """Tell whether a condition has one value in each cell of its quantities."""
        try:
            for name in t.variables_of(condition).keys() & {*quantities}:
                breakpoints(condition, name, self.values, quantities)
        except NoCellsError:
            return False
        return True

    def _open_values(self, name: str, skill: Skill, outcome: Outcome) -> Values | None:
        declared = self.declared[name]
        for one in outcome.ranges:
            if one.name == name:
                return values_between(self.values[name], one.low, one.high)
        if declared.name in outcome.effects or is_parameter(declared):
            return None
        defined = (one for one in outcome.effects if one in self._definitions)
        is_open = (
            is_moved(declared.name, skill, self._site)
            or any(declared.name in readings_behind(one, self._definitions) for one in defined)
            or (outcome.id in (HOLD_LOST, STOPPED) and self._may_set(declared.name, skill))
        )
        return self.values[name] if is_open else None

    def _may_set(self, name: str, skill: Skill) -> bool:
        """Tell whether a run of a skill that is halted may have changed a number."""
        hold = skill.hold_condition
        ranges = (one.variable for outcome in skill.outcomes.values() for one in outcome.ranges)
        return (hold is not None and name in t.variables_of(hold.term)) or name in ranges

    def _cells(
        self, name: str, conditions: Iterable[t.Term], numbers: set[Fraction], quantities: Sequence[str]
    ) -> Values:
        bounds = self.declared[name].range
        if bounds is None:
            raise StateSpaceError(f"it depends on `{name}`, which has no range")
        found = set(numbers)
        for condition in conditions:
            try:
                found |= breakpoints(lower(condition), name, self.values, quantities)
            except NoCellsError as error:
                raise StateSpaceError(str(error)) from error
        values = cells(bounds, found)
        self.breakpoints[name] = frozenset(found)
        if len(values) > MAX_CELLS:
            raise StateSpaceError(f"`{name}` is compared with more than {MAX_CELLS // 2} numbers")
        return values


def is_quantity(variable: t.Variable) -> bool:
    """Tell if a variable is no predicate: a real number, of which measured values are never quite the same.

    Args:
        variable: a scalar state variable.

    Returns:
        False for truths, members of enums and whole numbers.
    """
    return isinstance(variable.type, RealType) and not isinstance(variable.type, IntegerType)


def _listed_values(declared: Declared, variable: t.Variable) -> Values:
    match variable.type:
        case BoolType():
            return (False, True)
        case EnumType(members=members):
            return members
        case _ if declared.range is not None:
            low, high = map(int, declared.range)
            if high - low >= MAX_NUMBERS:
                raise StateSpaceError(f"`{variable.name}` has more than {MAX_NUMBERS} values")
            return tuple(map(Fraction, range(low, high + 1)))
        case _:
            raise StateSpaceError(f"it depends on `{variable.name}`, which is a whole number without a range")


def _scalars(conditions: Iterable[t.Term], skills: Iterable[Skill], site: Site) -> dict[str, t.Variable]:
    """Collect the scalar state variables that conditions read or outcomes set, sorted by name."""
    read: dict[str, t.Variable] = {}
    for condition in conditions:
        for one in t.variables_of(condition).values():
            if one.role is t.VariableRole.STATE:
                is_compound = isinstance(one.type, VectorType | FamilyType)
                read |= t.variables_of(lower(condition)) if is_compound else {one.name: one}
    for skill in skills:
        for outcome in skill.outcomes.values():
            read |= {name: site.state[name].variable for name in outcome.effects}
    scalar = {n: one for n, one in read.items() if one.role is t.VariableRole.STATE}
    return dict(sorted(scalar.items()))


def _whole_name(scalar: t.Variable, site: Site) -> str:
    """Name the declared variable that a scalar is, or is a part of."""
    if scalar.name in site.state:
        return scalar.name
    without_member = scalar.name.partition("[")[0]
    return without_member if without_member in site.state else scalar.name.rpartition(".")[0]


def _compared_numbers(
    skills: Iterable[Skill], task: Task, variables: Mapping[str, t.Variable]
) -> dict[str, set[Fraction]]:
    """Collect the numbers that outcomes and the start of a task state of quantities, by name."""
    found: dict[str, set[Fraction]] = {}
    stated = [task.initial, *(one.effects for skill in skills for one in skill.outcomes.values())]
    for effects in stated:
        for name, value in effects.items():
            if isinstance(value, Fraction):
                found.setdefault(name, set()).add(value)
            elif isinstance(value, tuple) and name not in variables:
                for axis, part in zip("xyz", value, strict=False):
                    found.setdefault(f"{name}.{axis}", set()).add(Fraction(part))
    for skill in skills:
        for outcome in skill.outcomes.values():
            for one in outcome.ranges:
                found.setdefault(one.name, set()).update((one.low, one.high))
    return found


def conditions_of(ecm: Ecm, task: Task) -> Iterator[t.Term]:
    """List every condition that the loop on a task reads, with the constant inputs of each skill.

    Args:
        ecm: module that declares the task.
        task: the task.

    Yields:
        The goal, conditions of rules, invariants, conditions of compositions, and preconditions of skills.
    """
    yield task.goal
    yield from (rule.satisfied_condition for rule in task.rules)
    yield from (one.term for one in task.invariants)
    for rule in task.rules:
        for alternative in ecm.alternatives(rule.skill):
            if alternative.composition is not None:
                parts = list(walk_parts(alternative.composition.body))
                yield from (part.condition for part in parts if isinstance(part, If))
                yield from (predicates_of(part.condition) for part in parts if isinstance(part, HeldPart))
                yield alternative.composition.precondition
    for name, inputs in _runs_of(ecm, task):
        skill = ecm.callable_skills[name]
        if skill.precondition is not None:
            yield with_constants(skill.precondition.term, bound_inputs(skill, inputs))


def bound_inputs(skill: Skill, inputs: Mapping[str, Any]) -> dict[str, Any]:
    """Give each input of a skill its value.

    Args:
        skill: the skill.
        inputs: constant inputs by name; an input that is left out has its default value.

    Returns:
        The values by the names that conditions use, SI; without those that have no value.
    """
    values = {one.name: inputs.get(name, one.default_value) for name, one in skill.inputs.items()}
    return {name: value for name, value in values.items() if value is not None}


def _runs_of(ecm: Ecm, task: Task) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield each skill that the loop on a task may run, with the inputs that it has there."""
    for rule in task.rules:
        for one in ecm.alternatives(rule.skill):
            if one.composition is None:
                yield one.name, rule.inputs
            else:
                steps = (*steps_of(one.composition.body), *one.composition.handlers.values())
                yield from ((name, step.inputs) for step in steps for name in step.runs)
        for helper in recoveries_of(rule):
            yield from ((name, {}) for name in ecm.providers(helper))


def recoveries_of(rule: PlanningRule) -> tuple[str, ...]:
    """List the skills that a failure of a rule's step leads to.

    Args:
        rule: the rule.

    Returns:
        Names under `between_tries` and `on_failure`.
    """
    return tuple(name for name in (rule.between_tries, rule.on_failure) if name is not None)


def skills_of(ecm: Ecm, task: Task) -> list[Skill]:
    """List the skills that the loop on a task may submit.

    Args:
        ecm: module that declares the task.
        task: the task.

    Returns:
        Providers of the rules' skills and capabilities, and recoveries, sorted by name.
    """
    return [ecm.callable_skills[name] for name in sorted({name for name, _ in _runs_of(ecm, task)})]
