"""Goals and values given as arguments: expressions over the site's vocabulary, with errors underlined."""

from __future__ import annotations

from typing import Any

from aeros.exit_codes import UsageError
from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.elaborate.expressions import elaborate_condition, elaborate_constant, expression_of_argument
from aeros.spec.elaborate.scopes import argument_scope, constant_scope
from aeros.spec.model.ecm import ActionCondition
from aeros.spec.model.site import Site


def parse_goal(text: str, site: Site) -> ActionCondition:
    """Parse a goal condition.

    Args:
        text: The condition, in the expression language.
        site: The site whose state variables it may name, and those of its modules; one whose own name is
            that of no other needs no module.

    Returns:
        The condition, with `--goal` as its source.

    Raises:
        UserError: The text is not a condition; the diagnostics underline the error.
        InternalError: A fault of AEROS: a condition was refused without a diagnostic.
    """
    sink = Diagnostics()
    expression = expression_of_argument("--goal", text)
    found = elaborate_condition(expression, argument_scope(site), sink)
    sink.raise_if_errors()
    if found is None:
        raise InternalError("a goal that was not understood was not reported")
    return ActionCondition(found.term, text, expression.span, found.conjuncts)


def parse_value(name: str, text: str, site: Site) -> tuple[str, Any]:
    """Parse the value of a state variable.

    Args:
        name: The state variable.
        text: Its value as a constant expression, or `unknown`.
        site: The site that declares the variable.

    Returns:
        The full name of the variable, and the exact value; None for `unknown`.

    Raises:
        UserError: The text is not a value of the variable; the diagnostics underline the error.
        UsageError: The site has no such variable.
    """
    full = site.short_names.get(name, name)
    declared = site.state.get(full)
    if declared is None:
        near = did_you_mean(name, [*site.state, *site.short_names])
        hint = f"; did you mean `{near}`?" if near else ""
        raise UsageError(f"`{site.id}` has no state variable `{escape_invisible(name)}`{hint}")
    if text == "unknown":
        return full, None
    sink = Diagnostics()
    expression = expression_of_argument(f"--initial {name}", text)
    value = elaborate_constant(expression, constant_scope(site), sink, declared.variable.type)
    sink.raise_if_errors()
    return full, value
