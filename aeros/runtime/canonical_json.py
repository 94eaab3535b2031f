"""Any value as canonical JSON, total: what cannot be encoded is named, never raised over.

Records must hold what a skill asked for however strange it is, and a denied request may hold NaN,
a class of its own or a list that contains itself.  Only exact built-in types are read, so no code
of the value's runs while it is encoded.  A double keeps its shortest decimal, which reads back to
the same double.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection
from dataclasses import dataclass
from json.encoder import encode_basestring_ascii
from math import isfinite
from typing import Any, Final, NamedTuple

from aeros.descriptions import type_name

MAX_SIZE: Final = 1_000_000
"""Characters and values in one encoding; more is not encoded.  A record is about 2,000."""

_MAX_DEPTH: Final = 32
"""Nesting beyond which nothing is encoded; also what ends a list that contains itself."""

_MAX_INTEGER_BITS: Final = 256
"""Length of the longest integer that is encoded."""

_DETAIL: Final = 2
"""How deep the details of a record are in it."""

ESCAPE_MARKS: Final = ("float", "unencodable", "dict")
"""Keys that, alone in a dict, say that it stands for something else."""


class Encoded(NamedTuple):
    """The canonical text of a value: what is put into a record after it was encoded for its digest.

    size: what it takes of `MAX_SIZE`.
    """

    text: str
    size: int

    @property
    def digest(self) -> str:
        """`digest_of` the value."""
        return hashlib.sha256(self.text.encode("ascii")).hexdigest()


def to_canonical_json(value: Any, known: Collection[str] = ()) -> bytes:
    """`value` as JSON: ASCII, sorted keys, no spaces, no NaN; equal values give equal bytes.

    NaN and infinities become `{"float": "nan"}` (`"inf"`, `"-inf"`), and everything else that JSON
    lacks `{"unencodable": TYPE}`; a dict that looks like one of these is wrapped, `{"dict": DICT}`.
    Once `MAX_SIZE` is used up, all that follows is unencodable: what must not be lost comes before
    what a stranger supplied.
    known: names of details of a record; an `Encoded` there, and nowhere else, stands for its value.
        A stranger must have no say about what is there.
    """
    return Encoder(known).encode(value, 0).encode("ascii")


def encode_with_size(value: Any) -> Encoded:
    """The canonical text of `value`, and its size."""
    encoder = Encoder()
    return Encoded(encoder.encode(value, 0), encoder.used_size)


@dataclass(frozen=True, slots=True)
class UnencodableValue:
    """Stands for a value that JSON lacks, of the type or for the reason named."""

    reason: str


def decode_value(plain: Any) -> Any:
    """The value whose encoding was read back as `plain`; tuples as lists, what was lost as `UnencodableValue`."""
    if type(plain) is list:
        return [decode_value(item) for item in plain]
    if type(plain) is not dict:
        return plain
    match plain:
        case {"float": "nan" | "inf" | "-inf" as text, **others} if not others:
            return float(text)
        case {"unencodable": str(what), **others} if not others:
            return UnencodableValue(what)
        case {"dict": dict(inner), **others} if not others:
            return {key: decode_value(item) for key, item in inner.items()}
    return {key: decode_value(item) for key, item in plain.items()}


def digest_of(value: Any) -> str:
    """The SHA-256 of `value`'s canonical encoding, in hexadecimal."""
    return hashlib.sha256(to_canonical_json(value)).hexdigest()


class Encoder:
    """Writes the canonical texts of values that share one `MAX_SIZE`."""

    def __init__(self, known: Collection[str] = ()) -> None:
        self._left = MAX_SIZE
        self._known = known

    @property
    def used_size(self) -> int:
        """How much of `MAX_SIZE` is used up."""
        return MAX_SIZE - self._left

    def encode(self, value: Any, depth: int) -> str:
        """Of a value at this depth of what is encoded."""
        kind = type(value)
        if kind is float and self._left > 0 and depth <= _MAX_DEPTH:
            # Most of what is in a record.
            self._left -= 1
            return repr(value) if isfinite(value) else f'{{"float":"{value!r}"}}'
        self._left -= 1 + (len(value) if kind in (str, list, tuple, dict) else 0)
        if self._left < 0 or depth > _MAX_DEPTH:
            return _unencodable("too large")
        if kind is str:
            return encode_basestring_ascii(value)
        if kind is bool:
            return "true" if value else "false"
        if value is None:
            return "null"
        if kind is int and value.bit_length() <= _MAX_INTEGER_BITS:
            return repr(value)
        if kind is tuple or kind is list:
            return f"[{','.join([self.encode(item, depth + 1) for item in tuple(value)])}]"
        if kind is dict:
            return self._of_dict(value, depth)
        return _unencodable(type_name(value))

    def _of_dict(self, value: dict[Any, Any], depth: int) -> str:
        for key in value:
            if type(key) is not str:
                return _unencodable("dict with keys that are no text")
            self._left -= len(key)
        if self._left < 0:
            return _unencodable("too large")
        # In the order given, in which `MAX_SIZE` is used up; then sorted.
        texts = {}
        for key, item in value.items():
            kind = type(item)
            if kind is str and len(item) < self._left and depth < _MAX_DEPTH:
                # As `text` has it, in place: most of what is in a dict.
                self._left -= 1 + len(item)
                texts[key] = encode_basestring_ascii(item)
            elif kind is Encoded and depth + 1 == _DETAIL and key in self._known:
                texts[key] = self._encode_item(item)
            else:
                texts[key] = self.encode(item, depth + 1)
        text = ",".join([f"{encode_basestring_ascii(key)}:{texts[key]}" for key in sorted(texts)])
        return f'{{"dict":{{{text}}}}}' if len(texts) == 1 and key in ESCAPE_MARKS else f"{{{text}}}"

    def _encode_item(self, item: Encoded) -> str:
        self._left -= item.size
        return item.text if self._left >= 0 else _unencodable("too large")


def _unencodable(what: str) -> str:
    return f'{{"unencodable":{encode_basestring_ascii(what)}}}'
