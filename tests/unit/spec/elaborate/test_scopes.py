"""Scopes of conditions: the names that each place may use, and what they mean."""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

from aeros.spec.elaborate.scopes import (
    action_scope,
    constant_scope,
    joint_scope,
    scope_over,
    state_scope,
    tick_scope,
)
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import AxisAlignedBox
from aeros.spec.expr.types import BOOL, EnumType, RealType, Type
from aeros.spec.expr.units import LENGTH, NUMBER
from aeros.spec.model.perception import Definition
from aeros.spec.model.rules import ActionKind, Risk
from aeros.spec.model.variables import Declared
from tests.unit.agent.dumplings import SPAN


def _declared(name: str, role: t.VariableRole, type_: Type = BOOL) -> Declared:
    return Declared(t.Variable(name, type_, role), SPAN)


class _Vocabulary(NamedTuple):
    enums: dict[str, EnumType]
    constants: dict[str, t.Term]
    volumes: dict[str, AxisAlignedBox]
    state: dict[str, Declared]
    definitions: dict[str, Definition]


TOOLS = EnumType("tools", ("sponge", "brush"))
SLOW = t.Literal(Fraction(1, 10), RealType(NUMBER))
BOX = AxisAlignedBox(*((Fraction(corner),) * 3 for corner in (0, 1)))
LOAD = _declared("load", t.VariableRole.STATE, RealType(NUMBER))
PACE = _declared("inputs.pace", t.VariableRole.INPUT, RealType(NUMBER))
SPEED = _declared("speed", t.VariableRole.PARAMETER, RealType(LENGTH))
MOVE = ActionKind("move", frozenset({"arm"}), Risk.LOW, False, {"speed": SPEED}, SPAN)
ROLL = ActionKind("roll", frozenset({"wheels"}), Risk.LOW, False, {}, SPAN)
LOADED = t.Compare("<", SLOW, LOAD.variable)
SITE = _Vocabulary(
    {"tools": TOOLS},
    {"slow": SLOW},
    {"box": BOX},
    {"load": LOAD},
    {"loaded": Definition(LOADED, "load > slow", SPAN)},
)


def test_a_constant_reads_no_variables() -> None:
    scope = constant_scope(SITE)
    assert (dict(scope.variables), dict(scope.inputs)) == ({}, {})
    assert (scope.constants, scope.enums, scope.volumes) == (SITE.constants, SITE.enums, SITE.volumes)


def test_a_condition_on_states_reads_the_vocabulary_and_the_inputs() -> None:
    scope = state_scope(SITE, {"pace": PACE})
    assert scope.variables == {"load": LOAD.variable}
    assert scope.inputs == {"pace": PACE.variable}
    assert (scope.constants, scope.enums, scope.volumes) == (SITE.constants, SITE.enums, SITE.volumes)
    assert dict(state_scope(SITE).inputs) == {}


def test_a_condition_on_actions_reads_the_parameters_too() -> None:
    scope = action_scope(SITE, MOVE, {"pace": PACE})
    assert scope.variables == {"load": LOAD.variable, "speed": SPEED.variable}
    assert scope.inputs == {"pace": PACE.variable}
    assert (scope.constants, scope.enums, scope.volumes) == (SITE.constants, SITE.enums, SITE.volumes)
    assert dict(action_scope(SITE, ROLL).variables) == {"load": LOAD.variable}


def test_where_every_tick_counts_a_definition_is_its_condition_and_no_predicate() -> None:
    loaded = _declared("carry.loaded", t.VariableRole.STATE)
    site = SITE._replace(state={"load": LOAD, "loaded": loaded})
    assert state_scope(site).variables.keys() == {"load", "loaded"}
    for scope in (tick_scope(site), action_scope(site, ROLL)):
        assert scope.variables == {"load": LOAD.variable}
        assert scope.definitions == {"loaded": LOADED}


def test_given_variables_are_distinguished_by_their_role() -> None:
    scope = scope_over(SITE, [LOAD, PACE, SPEED])
    assert scope.variables == {"load": LOAD.variable, "speed": SPEED.variable}
    assert scope.inputs == {"pace": PACE.variable}
    assert (scope.constants, scope.enums, scope.volumes) == (SITE.constants, SITE.enums, SITE.volumes)


def test_parameters_of_two_actions_are_named_after_their_role() -> None:
    scope = joint_scope(SITE, {"hand": MOVE, "base": ROLL})
    moved = t.Variable("hand.speed", RealType(LENGTH), t.VariableRole.PARAMETER)
    assert scope.roles == {"hand": {"speed": moved}, "base": {}}
    assert scope.variables == {"load": LOAD.variable}
    assert scope.volumes == SITE.volumes
