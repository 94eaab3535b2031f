"""Elaboration of a module's conditions: on states, and on the actions of its envelopes and permissions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.expressions import elaborate_condition
from aeros.spec.elaborate.names import resolve_need
from aeros.spec.elaborate.scopes import action_scope, tick_scope
from aeros.spec.expr.scope import Scope
from aeros.spec.model.ecm import ActionCondition
from aeros.spec.model.hold_conditions import MAX_COMBINATIONS, count_combinations
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


def elaborate_hold(
    expression: ExpressionField | None, site: Site, diagnostics: Diagnostics, inputs: Mapping[str, Declared]
) -> ActionCondition | None:
    """Elaborate the condition under which a skill or a part of a composition keeps running.

    Args:
        expression: condition, with its position in the file; None if there is none.
        site: site under which the module is elaborated.
        diagnostics: receives the faults.
        inputs: inputs of the skill by name; empty for a part.

    Returns:
        The condition. None if there is none, and after reporting the fault of one that cannot be elaborated.
    """
    if expression is None:
        return None
    hold = elaborate_action_condition(expression, tick_scope(site, inputs), diagnostics)
    if hold is not None and count_combinations(hold) > MAX_COMBINATIONS:
        headline = f"`hold` reads predicates with more than {MAX_COMBINATIONS} combinations of values"
        diagnostics.error("AE111", headline, hold.span, help=("use fewer predicates in `hold`",))
    return hold


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
