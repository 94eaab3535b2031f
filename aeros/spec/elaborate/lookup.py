"""Names and values that a manifest refers to: found, or a fault with what was perhaps meant."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean
from aeros.spec.model.model import Declared
from aeros.spec.text.fields import ExpressionField, TextField

_T = TypeVar("_T")


def resolve_name(name: TextField, among: Mapping[str, _T], what: str, sink: Diagnostics) -> _T | None:
    """What `name` refers to, or None after reporting that it is not `what`."""
    if name.value not in among:
        near = did_you_mean(name.value, among)
        listed = ", ".join(f"`{one}`" for one in list(among)[:12]) or "none"
        help_ = f"did you mean `{near}`?" if near else f"declared here: {listed}"
        sink.error("AE122", f"`{name.value}` is not {what}", name.span, help=(help_,))
    return among.get(name.value)


def check_in_range(variable: Declared, value: Any, at: ExpressionField, sink: Diagnostics) -> None:
    """Report a value outside the declared range of its variable."""
    if value is None or variable.range is None:
        return
    low, high = variable.range
    components = value if isinstance(value, tuple) else (value,)
    if not all(low <= component <= high for component in components):
        sink.error("AE111", "this value is outside the declared range", at.span)
