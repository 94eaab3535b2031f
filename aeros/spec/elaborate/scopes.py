"""What the names of a condition may mean, by where the condition stands."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Protocol

from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import AxisAlignedBox, Scope
from aeros.spec.expr.types import EnumType
from aeros.spec.model.model import ActionKind, Declared


class Vocabulary(Protocol):
    """The named things of a site, finished or still being elaborated."""

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


_NONE: Mapping[str, Declared] = {}


def constant_scope(site: Vocabulary) -> Scope:
    """For values that mention no variable: constants and enum members."""
    return Scope({}, {}, site.constants, site.enums)


def state_scope(site: Vocabulary, inputs: Mapping[str, Declared] = _NONE) -> Scope:
    """For conditions on states: the vocabulary, and a skill's inputs."""
    return Scope(_variables(site.state), _variables(inputs), site.constants, site.enums, site.volumes)


def action_scope(site: Vocabulary, kind: ActionKind, inputs: Mapping[str, Declared] = _NONE) -> Scope:
    """For conditions on actions of `kind`: state, its parameters, and a skill's inputs."""
    variables = _variables({**site.state, **kind.parameters})
    return Scope(variables, _variables(inputs), site.constants, site.enums, site.volumes)


def scope_over(site: Vocabulary, declared: Iterable[Declared]) -> Scope:
    """For conditions on just these variables: of a state, of a kind of action, or inputs of a skill."""
    inputs, others = {}, {}
    for one in declared:
        if one.variable.role is t.VariableRole.INPUT:
            inputs[one.name.removeprefix("inputs.")] = one.variable
        else:
            others[one.name] = one.variable
    return Scope(others, inputs, site.constants, site.enums, site.volumes)


def joint_scope(site: Vocabulary, roles: Mapping[str, ActionKind]) -> Scope:
    """For conditions on two simultaneous actions: state, and `ROLE.PARAMETER` of each."""
    parameters = {
        role: {name: replace(one.variable, name=f"{role}.{name}") for name, one in kind.parameters.items()}
        for role, kind in roles.items()
    }
    return replace(state_scope(site), roles=parameters)


def _variables(declared: Mapping[str, Declared]) -> dict[str, t.Variable]:
    return {name: one.variable for name, one in declared.items()}
