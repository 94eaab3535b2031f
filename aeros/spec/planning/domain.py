"""Planning domain made from the declarations of skills: states over the variables that outcomes set.

A state has a value for each variable that some outcome sets and that is relevant to the goal. None means
unknown; a condition over anything unknown is unknown, and an unknown condition satisfies nothing. Variables
that no outcome sets (most measured numbers) keep their measured values. Quantities that an outcome leaves in
a range (`aeros.spec.expr.effects`) are unknown: plans count on predicates that are defined by them. So is a
predicate with a definition that an outcome leaves at either value (`aeros.spec.consequences`).

The domain has the skills of all modules with their default inputs; an input without default takes each of its
values if its type is boolean or an enum. Skills are excluded, with the reason, if the operator blocks them,
in whole or in part, or if an input has no value. A choice cannot start in a state where Φ and the permission
are proved to allow no action of some action kind of its envelope, for all values of the variables that no
skill sets. There the gate would deny every action of that kind.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import islice, product
from typing import Any, Final

from aeros.spec.backends.oracle import Oracle
from aeros.spec.closed_loop.invocation import Invocation, State
from aeros.spec.consequences.consequences import modules_with_consequences
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import equality_condition
from aeros.spec.expr.effects import values_reached
from aeros.spec.expr.semantics import Environment, Value, is_true
from aeros.spec.expr.types import BoolType, EnumType
from aeros.spec.model.ecm import ActionCondition, Ecm, Outcome, Skill, TaskInvariant
from aeros.spec.model.hold_conditions import hold_loss_outcomes
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.verification.queries import are_unsatisfiable

MAX_COMBINATIONS: Final = 256
"""Maximum number of values of a skill's inputs, or of the variables its actions depend on, to enumerate."""


class PartialCondition:
    """A term over a state and constants; its value is None if anything in it is unknown.

    Attributes:
        term: the condition.
        reads: state variables that it reads.
        constants: values of the other variables that it reads.
        missing: variables that it reads and that have no value in any state.
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
        """Evaluate the condition in `state`; None if it is unknown."""
        values = tuple([state[place] for place in self._places])
        if values not in self._decided:
            self._decided[values] = self.evaluate_on(values)
        return self._decided[values]

    def evaluate_on(self, values: tuple[Any, ...]) -> bool | None:
        """Evaluate the condition on values of `reads`.

        Args:
            values: exact values in the order of `reads`, None if unknown.

        Returns:
            The truth value; None if it is unknown.
        """
        if self.missing or None in values:
            return None
        return is_true(self.term, {**self.constants, **dict(zip(self.reads, values, strict=True))})


@dataclass(frozen=True, eq=False)
class GroundSkill:
    """A skill with its inputs, as one choice of a planner.

    Attributes:
        module: id of the module.
        skill: the skill.
        inputs: values of the inputs without default, by name.
        denied_reason: pairs of an action kind and a situation in which every such action of the skill is
            denied.
        condition: its precondition, and none of those situations.
        invocation: its outcomes on states.
    """

    module: str
    skill: Skill
    inputs: Mapping[str, Any]
    denied_reason: tuple[tuple[str, t.Term], ...]
    condition: PartialCondition
    invocation: Invocation

    @property
    def name(self) -> str:
        """Name in reports, MODULE.SKILL."""
        return f"{self.module}.{self.skill.id}"

    @property
    def label(self) -> str:
        """Text of a plan step: `MODULE.SKILL input=value ...`."""
        return " ".join([self.name, *(f"{key}={_format_value(value)}" for key, value in self.inputs.items())])


@dataclass(frozen=True, eq=False)
class PlanningDomain:
    """A planning problem without its start state.

    Attributes:
        names: names of the variables of a state, sorted.
        variables: the same with their types.
        settings: by name, every value that some outcome sets, or that an outcome or a broken hold-condition
            may leave.
        choices: skills with inputs that a plan may use.
        goal: the goal.
        invariants: conditions of the task that must hold in every state, by id.
        excluded_skills: reason for each skill that is not used, by name.
        ranged: a skill that leaves it in a range, for each such quantity, by its name.
        unsettled: predicates that some outcome leaves at either value.
    """

    names: tuple[str, ...]
    variables: Mapping[str, t.Variable]
    settings: Mapping[str, tuple[Any, ...]]
    choices: tuple[GroundSkill, ...]
    goal: PartialCondition
    invariants: Mapping[str, PartialCondition]
    excluded_skills: Mapping[str, str]
    ranged: Mapping[str, str] = field(default_factory=dict)
    unsettled: frozenset[str] = frozenset()
    _after: dict[tuple[int, State], list[tuple[State, Outcome, Fraction]]] = field(default_factory=dict)

    def state(self, known: Environment) -> State:
        """Make a state from measured values.

        Args:
            known: exact values by name.

        Returns:
            The values of `names`, None if unknown.
        """
        return tuple(known.get(name) for name in self.names)

    def can_start(self, choice: GroundSkill, state: State) -> bool:
        """Evaluate the condition of a choice in a state.

        Args:
            choice: skill with inputs.
            state: a state.

        Returns:
            True if it holds.
        """
        return choice.condition(state) is True

    def after(self, choice: GroundSkill, state: State) -> list[tuple[State, Outcome, Fraction]]:
        """Compute the states that a choice may end in.

        Args:
            choice: skill with inputs.
            state: state in which it starts.

        Returns:
            Each possible state, the outcome that is measured there, and its probability.
        """
        key = (id(choice), state)
        if key not in self._after:
            self._after[key] = choice.invocation.after(state)
        return self._after[key]

    def condition(self, term: t.Term, choice: GroundSkill) -> PartialCondition:
        """Make a condition on states from a term, with the inputs of a choice as constants.

        Args:
            term: boolean term.
            choice: skill with inputs.

        Returns:
            The condition.
        """
        return PartialCondition(term, self.names, choice.condition.constants)

    def violated_invariant(self, state: State) -> str | None:
        """Find the first invariant that is false in a state, or unknown after an outcome that leaves it so.

        Args:
            state: a state.

        Returns:
            Its id; None if there is none.
        """
        return next((id_ for id_, holds in self.invariants.items() if self._may_violate(holds, state)), None)

    def _may_violate(self, invariant: PartialCondition, state: State) -> bool:
        holds = invariant(state)
        return holds is False or (holds is None and not self.unsettled.isdisjoint(invariant.reads))

    def format_state(self, state: State) -> str:
        """Format a state as manifests write values.

        Args:
            state: a state.

        Returns:
            One line of text.
        """
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
    """Make the domain of every skill that is relevant to the goal or to invariants.

    Args:
        modules: active modules by id.
        site: site whose rules and blocks apply.
        known: measured values by name, exact.
        goal: condition to reach.
        invariants: conditions that must hold in every state.
        oracle: solver for the situations in which actions are denied; by default a new one.
        extra_variables: case-folded names MODULE.SKILL of skills to include though they are not relevant.

    Returns:
        The domain.
    """
    left_out: dict[str, str] = {}
    modules = modules_with_consequences(modules, site)
    candidates = list(_candidates(modules, site, left_out))
    settings = _settings((skill for _, skill, _ in candidates), site, site.state)
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
    settings = _settings((skill for _, skill, _ in chosen.values()), site, wanted)
    names = tuple(sorted(settings))
    unsettled = {name for _, skill, _ in chosen.values() for name in skill.unsettled} & settings.keys()
    # Their measured values do not outlive the outcomes, so conditions on them are unknown.
    ranged = {
        one.variable: f"{module}.{skill.id}"
        for module, skill, _ in chosen.values()
        for outcome in skill.outcomes.values()
        for one in outcome.ranges
    }
    known = {name: value for name, value in known.items() if name not in ranged}
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
        ranged,
        frozenset(unsettled),
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
                left_out[name] = f"the operator's block `{block.id}` denies its actions"
                continue
            needed = {key: _values(one) for key, one in skill.inputs.items() if one.default_value is None}
            unsettled = next((key for key, values in needed.items() if not values), None)
            if unsettled is not None:
                left_out[name] = f"its input `{unsettled}` has no value"
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
    possible = [one for one in skill.outcomes.values() if one.probability != 0]
    ranged = {each.variable for one in possible for each in one.ranges}
    return ranged.union(*(one.effects for one in possible))


def _settings(skills: Iterator[Skill], site: Site, read: Collection[str]) -> dict[str, tuple[Any, ...]]:
    """Collect what outcomes leave; of predicates that they only disturb, those that are read."""
    found: dict[str, list[Any]] = {}
    every = list(skills)
    for skill in every:
        for outcome in skill.outcomes.values():
            for name, effect in outcome.effects.items():
                found.setdefault(name, []).append(effect)
    for skill in every:
        for outcome in hold_loss_outcomes(skill, found.keys()):
            for name, effect in outcome.effects.items():
                found[name].append(effect)
        for name in skill.disturbed:
            if name in read:
                found.setdefault(name, []).extend((False, True))
    return {name: values_reached(effects, site.state[name].range) for name, effects in found.items()}


def _invocation(skill: Skill, inputs: Mapping[str, Any], names: tuple[str, ...]) -> Invocation:
    leading_on = replace(skill, precondition=None, outcomes=_leading_on(skill))
    return Invocation(leading_on, inputs, names, names, has_unknown=True)


def _leading_on(skill: Skill) -> dict[str, Outcome]:
    """Return the outcomes after which the task goes on, with the probabilities that they have then.

    An outcome with a verdict ends the task with its reason, so no plan has to lead on from it.
    """
    ended = sum(one.probability or Fraction(0) for one in skill.outcomes.values() if one.verdict)
    return {
        one.id: one if one.probability is None else replace(one, probability=one.probability / (1 - ended))
        for one in skill.outcomes.values()
        if not one.verdict
    }


@dataclass(frozen=True)
class _RelevanceFilter:
    """Conditions under which a skill may be planned: its precondition, and what the gate can allow.

    `possible` holds every value that each variable set by skills may have.
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
        """Yield the situations in which no action of `kind` that the skill may request is allowed."""
        permission = self.modules[module].permitted_actions.get(kind)
        terms = [clause.term, *(rule.terms[kind] for rule in self.site.rules_for_kind(kind))]
        terms += [] if permission is None else [permission.term]
        spoken = {name: one for term in terms for name, one in t.variables_of(term).items()}
        free = {name: self.possible[name] for name in spoken if name in self.possible}
        if not free:
            return  # `aeros verify` proves that some action of the kind is allowed
        parameters = self.site.kinds[kind].parameters.values()
        declared = (*self.site.observed_variables.values(), *skill.inputs.values(), *parameters)
        situations = [
            t.And(
                tuple(equality_condition(spoken[name], one) for name, one in zip(free, values, strict=True))
            )
            for values in islice(product(*free.values()), MAX_COMBINATIONS)
        ]
        asked = [((situation, *terms), declared) for situation in situations]
        denied = are_unsatisfiable(asked, self.oracle)
        yield from (situation for situation, is_denied in zip(situations, denied, strict=True) if is_denied)


def _format_value(value: Any) -> str:
    if value is None:
        return "unknown"
    return str(value).lower() if isinstance(value, bool) else str(value)
