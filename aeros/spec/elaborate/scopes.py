"""Scopes of conditions: the names that a condition may use, by the place where it is written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Protocol

from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import AxisAlignedBox, Scope
from aeros.spec.expr.types import EnumType
from aeros.spec.model.perception import Definition
from aeros.spec.model.rules import ActionKind
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared


class Vocabulary(Protocol):
    """The named things of a site that conditions may use, elaborated completely or in part."""

    @property
    def enums(self) -> Mapping[str, EnumType]:
        """Closed enumerations by name."""

    @property
    def constants(self) -> Mapping[str, t.Term]:
        """Named constants."""

    @property
    def volumes(self) -> Mapping[str, AxisAlignedBox]:
        """Named boxes."""

    @property
    def state(self) -> Mapping[str, Declared]:
        """Measured quantities by name."""

    @property
    def definitions(self) -> Mapping[str, Definition]:
        """Conditions on measured quantities that have a name."""


_NONE: Mapping[str, Declared] = {}


def constant_scope(site: Vocabulary) -> Scope:
    """Make the scope of values without variables: constants, enum members, and corners of volumes.

    Args:
        site: vocabulary of the site.

    Returns:
        The scope.
    """
    return Scope({}, {}, site.constants, site.enums, site.volumes)


def argument_scope(site: Site) -> Scope:
    """Make the scope of a condition that a person gives.

    A module's variable may stand without its module, where no other has the same name.

    Args:
        site: the site, with the variables of the modules.

    Returns:
        The scope.
    """
    short = {name: site.state[full] for name, full in site.short_names.items()}
    return state_scope(replace(site, state={**site.state, **short}))


def tick_scope(site: Vocabulary, inputs: Mapping[str, Declared] = _NONE) -> Scope:
    """Make the scope of conditions that are checked at every control tick, such as `hold`.

    A definition of the site stands for its condition there, on readings of that tick; in other conditions of
    a module it is a predicate that is evaluated at each observation.

    Args:
        site: vocabulary of the site.
        inputs: inputs of a skill by name, without the prefix `inputs.`.

    Returns:
        The scope.
    """
    scope = state_scope(site, inputs)
    variables = {name: one for name, one in scope.variables.items() if name not in site.definitions}
    return replace(scope, variables=variables)


def state_scope(site: Vocabulary, inputs: Mapping[str, Declared] = _NONE) -> Scope:
    """Make the scope of conditions on states: the vocabulary, and a skill's inputs.

    Args:
        site: vocabulary of the site.
        inputs: inputs of a skill by name, without the prefix `inputs.`.

    Returns:
        The scope.
    """
    return Scope(
        _variables(site.state),
        _variables(inputs),
        site.constants,
        site.enums,
        site.volumes,
        recalled=_recalled(site),
        definitions=_conditions(site),
    )


def action_scope(site: Vocabulary, kind: ActionKind, inputs: Mapping[str, Declared] = _NONE) -> Scope:
    """Make the scope of conditions on actions of a kind: state, the kind's parameters, and a skill's inputs.

    Args:
        site: vocabulary of the site.
        kind: action kind whose parameters may be used.
        inputs: inputs of a skill by name, without the prefix `inputs.`.

    Returns:
        The scope.
    """
    scope = tick_scope(site, inputs)
    return replace(scope, variables={**scope.variables, **_variables(kind.parameters)})


def scope_over(site: Vocabulary, declared: Iterable[Declared]) -> Scope:
    """Make the scope of conditions on the given variables only.

    Args:
        site: vocabulary of the site, for constants, enums and volumes.
        declared: state variables, parameters of an action kind and inputs of a skill.

    Returns:
        The scope.
    """
    inputs, others = {}, {}
    for one in declared:
        if one.variable.role is t.VariableRole.INPUT:
            inputs[one.name.removeprefix("inputs.")] = one.variable
        else:
            others[one.name] = one.variable
    return Scope(others, inputs, site.constants, site.enums, site.volumes, definitions=_conditions(site))


def joint_scope(site: Vocabulary, roles: Mapping[str, ActionKind]) -> Scope:
    """Make the scope of conditions on two simultaneous actions: state, and `ROLE.PARAMETER` of each action.

    Args:
        site: vocabulary of the site.
        roles: action kind of each role, by the role's name.

    Returns:
        The scope.
    """
    parameters = {
        role: {name: replace(one.variable, name=f"{role}.{name}") for name, one in kind.parameters.items()}
        for role, kind in roles.items()
    }
    return replace(state_scope(site), roles=parameters)


def _conditions(site: Vocabulary) -> dict[str, t.Term]:
    return {name: one.term for name, one in site.definitions.items()}


def _recalled(site: Vocabulary) -> frozenset[str]:
    in_state = frozenset(name for name, one in site.state.items() if one.is_recalled)
    return in_state | (site.recalled_names if isinstance(site, Site) else frozenset())


def _variables(declared: Mapping[str, Declared]) -> dict[str, t.Variable]:
    return {name: one.variable for name, one in declared.items() if not one.is_recalled}
