"""What skills declare, as a planning domain: states over what outcomes set, and what may come after each.

A state has a value for each quantity that some outcome sets and that bears on the goal; None is unknown,
and a condition over anything unknown is unknown, which satisfies nothing.  Whatever no outcome sets (most
measured numbers) stays as it is measured.

Which skills are there for planning: those of all modules, with their default inputs; an input without
default has each of its values where they are finitely many.  Left out, with the reason, is a skill that
the operator blocks, in whole or in part, and one with an input that nothing gives a value.  And no
choice can start where, of an action kind of its envelope, Φ and the permission are proved to allow no
action at all, whatever is measured of what no skill sets: there the gate could only deny.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import islice, product
from typing import Any, Final

from aeros.spec.backends.oracle import Oracle
from aeros.spec.closed_loop.invocation import Invocation, State
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Environment, Value, is_true
from aeros.spec.expr.types import BoolType, EnumType, RealType
from aeros.spec.model.hold_conditions import hold_loss_outcomes
from aeros.spec.model.model import ActionCondition, Declared, Ecm, Outcome, Site, Skill, TaskInvariant
from aeros.spec.verification.queries import is_unsatisfiable

MAX_COMBINATIONS: Final = 256
"""Values of a skill's inputs, or of what its actions depend on, that are gone through at most."""


class PartialCondition:
    """A term over a state and constants; None where anything in it is unknown.

    missing: what it reads that has no value in any state.
    """

    def __init__(self, term: t.Term, names: Sequence[str], constants: Environment) -> None:
        read = t.variables_of(term)
        self.term = term
        self.reads = tuple(name for name in read if name in names)
        self.constants = {name: constants[name] for name in read if name in constants and name not in names}
        self.missing = tuple(name for name in read if name not in names and name not in constants)
        self._places = [names.index(name) for name in self.reads]
        self._decided: dict[tuple[Any, ...], bool | None] = {}

    def __call__(self, state: State) -> bool | None:
        """Whether it holds in `state`."""
        values = tuple([state[place] for place in self._places])
        if values not in self._decided:
            self._decided[values] = self.evaluate_on(values)
        return self._decided[values]

    def evaluate_on(self, values: tuple[Any, ...]) -> bool | None:
        """Whether it holds where `reads` have these values."""
        if self.missing or None in values:
            return None
        return is_true(self.term, {**self.constants, **dict(zip(self.reads, values, strict=True))})


@dataclass(frozen=True, eq=False)
class GroundSkill:
    """A skill with its inputs.

    inputs: those without default, by name.
    denied: an action kind, and a situation in which every such action of the skill is denied.
    condition: its precondition, and none of those situations.
    """

    module: str
    skill: Skill
    inputs: Mapping[str, Any]
    denied_reason: tuple[tuple[str, t.Term], ...]
    condition: PartialCondition
    invocation: Invocation

    @property
    def name(self) -> str:
        """As in reports."""
        return f"{self.module}.{self.skill.id}"

    @property
    def label(self) -> str:
        """As a step of a plan, with its inputs."""
        return " ".join([self.name, *(f"{key}={_format_value(value)}" for key, value in self.inputs.items())])


@dataclass(frozen=True, eq=False)
class PlanningDomain:
    """A planning problem without its start.

    names: what a state has values of; variables: the same, typed.
    settings: by name, every value that some outcome sets, or that may be left where a hold-condition broke.
    left_out: why skills are not there for planning, by name.
    """

    names: tuple[str, ...]
    variables: Mapping[str, t.Variable]
    settings: Mapping[str, tuple[Any, ...]]
    choices: tuple[GroundSkill, ...]
    goal: PartialCondition
    invariants: Mapping[str, PartialCondition]
    excluded_skills: Mapping[str, str]
    _after: dict[tuple[int, State], list[tuple[State, Outcome, Fraction]]] = field(default_factory=dict)

    def state(self, known: Environment) -> State:
        """The state in which these values are measured."""
        return tuple(known.get(name) for name in self.names)

    def can_start(self, choice: GroundSkill, state: State) -> bool:
        """Whether its condition is measured as true."""
        return choice.condition(state) is True

    def after(self, choice: GroundSkill, state: State) -> list[tuple[State, Outcome, Fraction]]:
        """Each state that `choice` may end in, the outcome that is measured there, and how likely it is."""
        key = (id(choice), state)
        if key not in self._after:
            self._after[key] = choice.invocation.after(state)
        return self._after[key]

    def condition(self, term: t.Term, choice: GroundSkill) -> PartialCondition:
        """`term` as a condition on states where `choice` has its inputs."""
        return PartialCondition(term, self.names, choice.condition.constants)

    def violated_invariant(self, state: State) -> str | None:
        """The first invariant that does not hold in `state`."""
        return next((id_ for id_, holds_in in self.invariants.items() if holds_in(state) is False), None)

    def format_state(self, state: State) -> str:
        """The values of `state` as a manifest writes them."""
        pairs = zip(self.names, state, strict=True)
        return ", ".join(f"{name} = {_format_value(value)}" for name, value in pairs)


def domain_for(
    modules: Mapping[str, Ecm],
    site: Site,
    known: Environment,
    goal: t.Term,
    invariants: Sequence[TaskInvariant] = (),
    oracle: Oracle | None = None,
    extra_variables: Collection[str] = (),
) -> PlanningDomain:
    """The domain of every skill of `modules` that can bear on `goal` or on `invariants`.

    also: names, case folded, of skills that are in it whether they bear on anything or not.
    """
    left_out: dict[str, str] = {}
    candidates = list(_candidates(modules, site, left_out))
    settings = _settings(skill for _, skill, _ in candidates)
    possible = {
        name: values if known.get(name) in (None, *values) else (*values, known[name])
        for name, values in settings.items()
    }
    bearing = _RelevanceFilter(site, modules, possible, oracle or Oracle())
    wanted = set(t.variables_of(goal)).union(*(t.variables_of(one.term) for one in invariants))
    kept: dict[int, tuple[t.Term, tuple[tuple[str, t.Term], ...]]] = {}
    grows = True
    while grows:
        grows = False
        for number, (module, skill, _) in enumerate(candidates):
            bears = wanted & _effects(skill) or f"{module}.{skill.id}".casefold() in extra_variables
            if number not in kept and bears:
                kept[number] = bearing.condition(module, skill)
                wanted |= t.variables_of(kept[number][0]).keys()
                # Which outcome is measured depends on all that is declared, also of one that never happens.
                wanted |= {name for one in skill.outcomes.values() for name in one.effects}
                grows = True
    chosen = {number: candidates[number] for number in sorted(kept)}
    settings = _settings(skill for _, skill, _ in chosen.values())
    names = tuple(sorted(settings))
    choices = []
    for number, (module, skill, inputs) in chosen.items():
        bound: dict[str, Value] = {
            one.name: inputs.get(key, one.default_value) for key, one in skill.inputs.items()
        }
        term, denied = kept[number]
        condition = PartialCondition(term, names, {**known, **bound})
        invocation = _invocation(skill, inputs, names)
        choices.append(GroundSkill(module, skill, inputs, denied, condition, invocation))
    return PlanningDomain(
        names,
        {name: site.state[name].variable for name in names},
        settings,
        tuple(choices),
        PartialCondition(goal, names, known),
        {one.id: PartialCondition(one.term, names, known) for one in invariants},
        left_out,
    )


def _candidates(
    modules: Mapping[str, Ecm], site: Site, left_out: dict[str, str]
) -> Iterator[tuple[str, Skill, dict[str, Any]]]:
    for module, ecm in sorted(modules.items()):
        for skill in ecm.skills.values():
            name = f"{module}.{skill.id}"
            kinds = skill.envelope
            block = next((b for b in site.blocks for k in kinds if b.matches(module, skill.id, k)), None)
            if block is not None:
                left_out[name] = f"the operator's block `{block.id}` denies what it may ask for"
                continue
            needed = {key: _values(one) for key, one in skill.inputs.items() if one.default_value is None}
            unsettled = next((key for key, values in needed.items() if not values), None)
            if unsettled is not None:
                left_out[name] = f"nothing gives its input `{unsettled}` a value"
                continue
            for chosen in islice(product(*needed.values()), MAX_COMBINATIONS):
                yield module, skill, dict(zip(needed, chosen, strict=True))


def _values(declared: Declared) -> tuple[Any, ...]:
    match declared.variable.type:
        case BoolType():
            return (False, True)
        case EnumType(members=members):
            return members
        case _:
            return ()


def _effects(skill: Skill) -> set[str]:
    return {name for one in skill.outcomes.values() if one.probability != 0 for name in one.effects}


def _settings(skills: Iterator[Skill]) -> dict[str, tuple[Any, ...]]:
    found: dict[str, dict[Any, None]] = {}
    every = list(skills)
    for skill in every:
        for outcome in skill.outcomes.values():
            for name, value in outcome.effects.items():
                found.setdefault(name, {})[value] = None
    for skill in every:
        for outcome in hold_loss_outcomes(skill, found.keys()):
            for name, value in outcome.effects.items():
                found[name][value] = None
    return {name: tuple(values) for name, values in found.items()}


def _invocation(skill: Skill, inputs: Mapping[str, Any], names: tuple[str, ...]) -> Invocation:
    return Invocation(replace(skill, precondition=None), inputs, names, names)


@dataclass(frozen=True)
class _RelevanceFilter:
    """Where a skill may be planned, by its precondition and by what the gate could ever allow.

    possible: every value that what skills set may have.
    """

    site: Site
    modules: Mapping[str, Ecm]
    possible: Mapping[str, tuple[Any, ...]]
    oracle: Oracle

    def condition(self, module: str, skill: Skill) -> tuple[t.Term, tuple[tuple[str, t.Term], ...]]:
        precondition = t.TRUE if skill.precondition is None else skill.precondition.term
        denied = tuple(
            (kind, situation)
            for kind, clause in skill.envelope.items()
            for situation in self._denied(module, skill, kind, clause)
        )
        return t.conjunction(precondition, *(t.Not(situation) for _, situation in denied)), denied

    def _denied(self, module: str, skill: Skill, kind: str, clause: ActionCondition) -> Iterator[t.Term]:
        """Situations in which no action of `kind` that the skill may ask for is allowed."""
        permission = self.modules[module].permitted_actions.get(kind)
        terms = [clause.term, *(rule.terms[kind] for rule in self.site.rules_for_kind(kind))]
        terms += [] if permission is None else [permission.term]
        spoken = {name: one for term in terms for name, one in t.variables_of(term).items()}
        free = {name: self.possible[name] for name in spoken if name in self.possible}
        if not free:
            return  # `aeros verify` proves that some action of the kind is allowed
        parameters = self.site.kinds[kind].parameters.values()
        declared = (*self.site.observed_variables.values(), *skill.inputs.values(), *parameters)
        for values in islice(product(*free.values()), MAX_COMBINATIONS):
            pairs = zip(free, values, strict=True)
            situation = t.And(tuple(equality_condition(spoken[name], value) for name, value in pairs))
            if is_unsatisfiable((situation, *terms), declared, self.oracle):
                yield situation


def equality_condition(variable: t.Variable, value: Value) -> t.Term:
    """The condition that a scalar variable has this value."""
    if isinstance(value, bool):
        return variable if value else t.Not(variable)
    return t.Compare("==", variable, literal_term(variable, value))


def literal_term(variable: t.Variable, value: Value) -> t.Literal:
    """The constant that a scalar variable with this value is."""
    if isinstance(value, tuple) or not isinstance(variable.type, BoolType | RealType | EnumType):
        raise MisuseError(f"`{variable.name}` is no scalar")
    return t.Literal(value, variable.type)


def _format_value(value: Any) -> str:
    if value is None:
        return "unknown"
    return str(value).lower() if isinstance(value, bool) else str(value)
