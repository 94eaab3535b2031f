"""Any value as canonical JSON, total: what cannot be encoded is named, never raised over.

Records must hold what a skill asked for however strange it is, and a denied request may hold NaN,
a class of its own or a list that contains itself.  Only exact built-in types are read, so no code
of the value's runs while it is encoded.  A double keeps its shortest decimal, which reads back to
the same double.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from math import isfinite
from typing import Any, Final

MOST_SIZE: Final = 1_000_000
"""Characters and values in one encoding; more is not encoded.  A record is about 2,000."""

_DEEPEST: Final = 32
"""Nesting beyond which nothing is encoded; also what ends a list that contains itself."""

_MOST_BITS: Final = 256
"""Length of the longest integer that is encoded."""

_MARKS: Final = ("float", "unencodable", "dict")
"""Keys that, alone in a dict, say that it stands for something else."""


def canonical(value: Any) -> bytes:
    """`value` as JSON: ASCII, sorted keys, no spaces, no NaN; equal values give equal bytes.

    NaN and infinities become `{"float": "nan"}` (`"inf"`, `"-inf"`), and everything else that JSON
    lacks `{"unencodable": TYPE}`; a dict that looks like one of these is wrapped, `{"dict": DICT}`.
    Once `MOST_SIZE` is used up, all that follows is unencodable: what must not be lost comes before
    what a stranger supplied.
    """
    plain = _Encoder().encode(value, 0)
    text = json.dumps(plain, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return text.encode("ascii")


@dataclass(frozen=True, slots=True)
class Unencodable:
    """Stands for a value that JSON lacks, of the type or for the reason named."""

    what: str


def restored(plain: Any) -> Any:
    """The value whose encoding was read back as `plain`; tuples as lists, what was lost as `Unencodable`."""
    if type(plain) is list:
        return [restored(item) for item in plain]
    if type(plain) is not dict:
        return plain
    match plain:
        case {"float": "nan" | "inf" | "-inf" as text, **others} if not others:
            return float(text)
        case {"unencodable": str(what), **others} if not others:
            return Unencodable(what)
        case {"dict": dict(inner), **others} if not others:
            return {key: restored(item) for key, item in inner.items()}
    return {key: restored(item) for key, item in plain.items()}


def digest_of(value: Any) -> str:
    """The SHA-256 of `value`'s canonical encoding, in hexadecimal."""
    return hashlib.sha256(canonical(value)).hexdigest()


def type_name(value: Any) -> str:
    """The name of `value`'s type, read without asking its metaclass."""
    name: str = type.__dict__["__name__"].__get__(type(value))
    return str.__getitem__(name, slice(0, 100))


class _Encoder:
    def __init__(self) -> None:
        self._left = MOST_SIZE

    def encode(self, value: Any, depth: int) -> Any:
        kind = type(value)
        if kind is float and self._left > 0 and depth <= _DEEPEST:
            # Most of what is in a record.
            self._left -= 1
            return value if isfinite(value) else {"float": repr(value)}
        self._left -= 1 + (len(value) if kind in (str, list, tuple, dict) else 0)
        if self._left < 0 or depth > _DEEPEST:
            return _unencodable("too large")
        if value is None or kind is bool or kind is str:
            return value
        if kind is int and value.bit_length() <= _MOST_BITS:
            return value
        if kind is tuple or kind is list:
            return [self.encode(item, depth + 1) for item in tuple(value)]
        if kind is dict:
            return self._encode_dict(list(value.items()), depth)
        return _unencodable(type_name(value))

    def _encode_dict(self, items: list[tuple[Any, Any]], depth: int) -> Any:
        if not all(type(key) is str for key, _ in items):
            return _unencodable("dict with keys that are no text")
        self._left -= sum(len(key) for key, _ in items)
        if self._left < 0:
            return _unencodable("too large")
        plain = {key: self.encode(item, depth + 1) for key, item in items}
        return {"dict": plain} if len(plain) == 1 and items[0][0] in _MARKS else plain


def _unencodable(what: str) -> dict[str, str]:
    return {"unencodable": what}
