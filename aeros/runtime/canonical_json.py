"""Canonical JSON of arbitrary values: never raises; values that JSON lacks are replaced by a marker.

Records must hold what a skill asked for, however odd it is: a denied request may hold NaN, an instance of an
unknown class, or a list that contains itself. Only exact built-in types are read, so no code of the value
runs while it is encoded. A double is written as its shortest decimal, which reads back as the same double.
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
"""Budget of one encoding, in characters and values; the rest is not encoded. A record takes about 2,000."""

_MAX_DEPTH: Final = 32
"""Greatest depth of nesting that is encoded; this also ends a list that contains itself."""

_MAX_INTEGER_BITS: Final = 256
"""Length of the longest integer that is encoded."""

_DETAIL: Final = 2
"""Depth at which the details of a record lie in it."""

ESCAPE_MARKS: Final = ("float", "unencodable", "dict")
"""Keys that, as the only key of a dict, mark an escaped value."""


_HASH_FIELD: Final = b',"hash":"'
_HASH_END: Final = b'"}\n'

HASH_SUFFIX_LENGTH: Final = len(_HASH_FIELD) + 64 + len(_HASH_END)
"""Number of bytes that `seal_record` puts in place of the closing brace."""


class Encoded(NamedTuple):
    """Canonical text of a value, kept so that a record can reuse what was encoded for a digest.

    Attributes:
        text: the canonical JSON, ASCII.
        size: the share of `MAX_SIZE` that encoding the value used up.
    """

    text: str
    size: int

    @property
    def digest(self) -> str:
        """SHA-256 of the text in hexadecimal, equal to `digest_of` the value."""
        return hashlib.sha256(self.text.encode("ascii")).hexdigest()


def to_canonical_json(value: Any, known: Collection[str] = ()) -> bytes:
    """Encode a value as canonical JSON: ASCII, sorted keys, no spaces, no NaN; equal values give equal bytes.

    NaN and infinities become `{"float": "nan"}` (`"inf"`, `"-inf"`), and everything else that JSON lacks
    `{"unencodable": TYPE}`. A dict that looks like one of these is wrapped: `{"dict": DICT}`.
    Once `MAX_SIZE` is used up, everything that follows is unencodable; so data that must not be lost has to
    come before data from untrusted code.

    Args:
        value: any object.
        known: names of a record's details in which an `Encoded` stands for its value; elsewhere an `Encoded`
            is unencodable. Untrusted code must not control what is stored under these names.

    Returns:
        The canonical JSON in ASCII.
    """
    return Encoder(known).encode(value, 0).encode("ascii")


def encode_with_size(value: Any) -> Encoded:
    """Encode a value as `to_canonical_json` does, and report the share of `MAX_SIZE` it used.

    Args:
        value: any object.

    Returns:
        The canonical text and its size.
    """
    encoder = Encoder()
    return Encoded(encoder.encode(value, 0), encoder.used_size)


@dataclass(frozen=True, slots=True)
class UnencodableValue:
    """Placeholder for a value that JSON lacks.

    Attributes:
        reason: the name of the value's type, or why it was not encoded, such as `too large`.
    """

    reason: str


def decode_value(plain: Any) -> Any:
    """Rebuild a value from its parsed canonical JSON.

    Args:
        plain: result of `json.loads` for the canonical text.

    Returns:
        The value, with tuples as lists and values that were not encoded as `UnencodableValue`.
    """
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
    """Compute the SHA-256 of a value's canonical encoding.

    Args:
        value: any object.

    Returns:
        The digest in hexadecimal.
    """
    return hashlib.sha256(to_canonical_json(value)).hexdigest()


def seal_record(body: bytes) -> tuple[bytes, str]:
    """Append the hash to a record.

    Args:
        body: canonical JSON of the record without hash.

    Returns:
        The line of the record, and the hash in hexadecimal.
    """
    own = hashlib.sha256(body).hexdigest()
    return body[:-1] + _HASH_FIELD + own.encode("ascii") + _HASH_END, own


class Encoder:
    """Encoder of several values that share one `MAX_SIZE`."""

    def __init__(self, known: Collection[str] = ()) -> None:
        self._left = MAX_SIZE
        self._known = known

    @property
    def used_size(self) -> int:
        """Share of `MAX_SIZE` that is used up so far."""
        return MAX_SIZE - self._left

    def encode(self, value: Any, depth: int) -> str:
        """Encode one value.

        Args:
            value: any object.
            depth: its depth of nesting in the whole that is encoded; 0 for the outermost value.

        Returns:
            The canonical text.
        """
        kind = type(value)
        if kind is float and self._left > 0 and depth <= _MAX_DEPTH:
            # The fast path for most values of a record.
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
        # Items use up `MAX_SIZE` in the order given, and are sorted afterwards.
        texts = {}
        for key, item in value.items():
            kind = type(item)
            if kind is str and len(item) < self._left and depth < _MAX_DEPTH:
                # What `encode` would do, inlined: most items of a dict are short strings.
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
