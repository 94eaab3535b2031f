"""Fields of data classes compared with the types that they declare, which nothing checks at run time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import is_dataclass
from functools import cache
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints


@cache
def _types_of(kind: Any) -> dict[str, Any]:
    return get_type_hints(kind)


def mistyped_fields(value: Any) -> Iterator[str]:
    """Name the fields of a data class, and of those in it, that are not of their declared types.

    Args:
        value: the object.

    Yields:
        The field with its value.
    """
    kind: Any = type(value)
    for name, declared in _types_of(kind).items():
        if not _has_type(getattr(value, name), declared):
            yield f"{type(value).__name__}.{name} is {getattr(value, name)!r}"


def _has_type(value: Any, declared: Any) -> bool:
    origin, arguments = get_origin(declared), get_args(declared)
    if origin in (Union, UnionType):
        return any(_has_type(value, one) for one in arguments)
    if origin is tuple and arguments[1:] == (...,):
        return isinstance(value, tuple) and all(_has_type(one, arguments[0]) for one in value)
    if not isinstance(value, origin or declared):
        return False
    is_label = is_dataclass(value) and type(value).__module__.endswith((".codes", ".obligation"))
    return not is_label or not any(mistyped_fields(value))
