"""Plain values of what a perceiver yields: numbers and arrays of NumPy become Python's own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from aeros.perception.view import Estimate

MAX_VALUES: Final = 256
"""Limit on the variables of one answer; no module declares nearly as many."""

_MAX_PARTS: Final = 64
"""Limit on the numbers of one value."""


class NoValuesError(Exception):
    """The perceiver yielded something other than values by name; the message says what."""


def plain_values(yielded: object) -> Mapping[str, tuple[Any, Any, Any]]:
    """Copy what a perceiver yielded.

    Args:
        yielded: the object that it yielded: a dict of values by variable.

    Returns:
        Value, standard uncertainty and time of each variable that is not None; uncertainty and time are None
        if it gave none. Values are copied; those of foreign types are left as they are.

    Raises:
        NoValuesError: it is not a dict of at most `MAX_VALUES` values by name.
    """
    if type(yielded) is not dict:
        raise NoValuesError(f"the perceiver yielded a `{type(yielded).__name__}`, not a dict of values")
    if len(yielded) > MAX_VALUES:
        raise NoValuesError(f"the perceiver yielded {len(yielded)} values; at most {MAX_VALUES} are read")
    values: dict[str, tuple[Any, Any, Any]] = {}
    for name, value in yielded.items():
        if type(name) is not str:
            raise NoValuesError("the perceiver yielded a value whose name is not a string")
        if value is None:
            continue
        if type(value) is Estimate:
            values[name] = (_plain(value.value), _plain(value.uncertainty), _plain(value.time))
        else:
            values[name] = (_plain(value), None, None)
    return values


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        if value.size > _MAX_PARTS:
            raise NoValuesError(f"the perceiver yielded an array of {value.size} numbers as one value")
        return value.tolist()
    if type(value) in (list, tuple):
        if len(value) > _MAX_PARTS:
            raise NoValuesError(f"the perceiver yielded {len(value)} numbers as one value")
        return [part.item() if isinstance(part, np.generic) else part for part in value]
    return value
