"""Elaboration of a module's conditions: on states, and on the actions of its envelopes and permissions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.expressions import elaborate_condition
from aeros.spec.elaborate.names import resolve_need
from aeros.spec.elaborate.scopes import action_scope
from aeros.spec.expr.scope import Scope
from aeros.spec.model.ecm import ActionCondition
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from aeros.spec.text.fields import ExpressionField, MappingField


def elaborate_action_condition(
    expression: ExpressionField, scope: Scope, diagnostics: Diagnostics
) -> ActionCondition | None:
    """Elaborate one condition with its text and its conjuncts.

    Args:
        expression: condition, with its position in the file.
        scope: names that it may use.
        diagnostics: receives the faults.

    Returns:
        The condition, or None after reporting the fault.
    """
    condition = elaborate_condition(expression, scope, diagnostics)
    if condition is None:
        return None
    return ActionCondition(condition.term, expression.value, expression.span, condition.conjuncts)


def elaborate_action_conditions(
    entries: MappingField[ExpressionField],
    inputs: Mapping[str, Declared],
    site: Site,
    diagnostics: Diagnostics,
) -> dict[str, ActionCondition]:
    """Elaborate the conditions on actions of an envelope or of permissions.

    Args:
        entries: conditions by action kind.
        inputs: inputs of the skill by name; empty for permissions.
        site: site that declares the action kinds.
        diagnostics: receives the faults.

    Returns:
        The conditions without faults, by action kind.
    """
    conditions: dict[str, ActionCondition] = {}
    for name, expression in entries:
        kind = resolve_need(name, site.kinds, "action", diagnostics)
        if kind is None:
            continue
        if kind.name in conditions:  # by its own name, and by the module's name for it
            diagnostics.error("AE120", f"there are two conditions on `{kind.name}`", name.span)
            continue
        condition = elaborate_action_condition(expression, action_scope(site, kind, inputs), diagnostics)
        if condition is not None:
            conditions[kind.name] = replace(condition, kind_name=name.value)
    return conditions
