"""Lookup of the names that a manifest refers to, and range checks of its values.

A fault suggests the name that was probably intended.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean
from aeros.spec.model.variables import Declared
from aeros.spec.text.fields import ExpressionField, TextField

_T = TypeVar("_T")


def resolve_name(name: TextField, among: Mapping[str, _T], what: str, diagnostics: Diagnostics) -> _T | None:
    """Look up a name; report an unknown one with a suggestion.

    Args:
        name: the name, with its position in the file.
        among: known things by name.
        what: noun phrase of what the name should be, such as `an action kind`; it completes “… is not”.
        diagnostics: receives the faults.

    Returns:
        The thing of that name, or None after reporting that there is none.
    """
    if name.value not in among:
        near = did_you_mean(name.value, among)
        listed = ", ".join(f"`{one}`" for one in list(among)[:12]) or "none"
        help_ = f"did you mean `{near}`?" if near else f"declared here: {listed}"
        diagnostics.error("AE122", f"`{name.value}` is not {what}", name.span, help=(help_,))
    return among.get(name.value)


def check_in_range(variable: Declared, value: Any, at: ExpressionField, diagnostics: Diagnostics) -> None:
    """Report a value outside the declared range of its variable; no value or no range is no fault.

    Args:
        variable: declaration of the variable, with its range in SI units.
        value: number or vector in SI units, or None.
        at: field that gives the value, underlined in the report.
        diagnostics: receives the faults.
    """
    if value is None or variable.range is None:
        return
    low, high = variable.range
    components = value if isinstance(value, tuple) else (value,)
    if not all(low <= component <= high for component in components):
        diagnostics.error("AE111", "this value is outside the declared range", at.span)
