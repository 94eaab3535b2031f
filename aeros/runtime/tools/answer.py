"""Answers of tools: only values that the site declares, of their types and in their ranges."""

from __future__ import annotations

from typing import Any

from aeros.runtime.gate.value_check import Scalars, ValueChecker
from aeros.runtime.tools.exchange import ToolError
from aeros.spec.model.site import Site
from aeros.spec.model.tools import Tool


def check_answer(answer: Any, tool: Tool, site: Site) -> dict[str, Any]:
    """Check an answer as a whole.

    Args:
        answer: parsed JSON.
        tool: the tool.
        site: declares the state variables that it may set.

    Returns:
        Values (SI) by state variable, in the types of readings. A variable that is absent, or null, is
        unknown.

    Raises:
        ToolError: it is no object, or a name, type or range is not as declared, so that nothing of it can be
            relied on.
    """
    if not isinstance(answer, dict):
        raise ToolError("its answer is not an object of values by name")
    values: dict[str, Any] = {}
    for name, value in answer.items():
        if name not in tool.answers:
            raise ToolError(f"it answered {name[:60]!r}, which it does not declare")
        if value is None:
            continue
        checker = ValueChecker(site.state[name])
        scalars: Scalars = {}
        fault = checker.unpack(value, scalars)
        if fault is not None:
            raise ToolError(f"it answered {repr(value)[:40]} in SI units: {fault.text}")
        parts = tuple(scalars[scalar] for scalar in checker.names)
        values[name] = parts if isinstance(value, list) else parts[0]
    return values
