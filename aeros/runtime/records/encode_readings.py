"""Encode sensor readings as canonical JSON, incrementally.

From one decision to the next most values stay the same objects, and all readings of a snapshot share its
time.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import compress, count, repeat
from json.encoder import encode_basestring_ascii
from math import isfinite
from operator import is_, is_not, itemgetter
from typing import Any, Final

from aeros.runtime.canonical_json import MAX_SIZE, Encoded, Encoder, encode_with_size
from aeros.runtime.ports import ColumnNames, Reading, Readings, Snapshot

_IMMUTABLE_TYPES: Final = (float, bool, int, str, type(None))
"""Types of immutable values."""

_DOUBLE: Final = {float}

_NOT_CACHED: Final = object()
"""Stands for a value that is not cached: not encoded yet, or mutable."""


def encode_readings(readings: Readings) -> Encoded:
    """Encode value and time of each reading, by name. This is the definition of the encoding.

    Args:
        readings: value (SI) and plant time (s) of each state variable, by name.

    Returns:
        Canonical JSON with its size.
    """
    return encode_with_size({name: [reading.value, reading.time] for name, reading in readings.items()})


class IncrementalReadingsEncoder:
    """Encoder that agrees with `encode_readings` and reuses the text of values unchanged since the last call.

    Works on columns in the order of the names, because decisions wait for it and most of a column is
    unchanged. Not thread-safe.
    """

    def __init__(self) -> None:
        self._order: ColumnNames | None = (
            None  # of the latest snapshot, if the columns below are in its order
        )
        self._names: dict[str, None] = {}  # sorted
        self._quoted: list[str] = []
        self._lengths: list[int] = []
        self._pick: Callable[[Readings], tuple[Reading, ...]]
        self._values: list[Any] = []  # that were encoded last
        self._texts: list[str] = []  # of each: name and value, up to the time
        self._sizes: list[int] = []  # size of each in an encoding
        self._size = 0  # sum of `_sizes`

    def encode(self, readings: Readings) -> Encoded:
        """Encode `readings` as `encode_readings` does.

        Args:
            readings: value (SI) and plant time (s) of each state variable, by name.

        Returns:
            Canonical JSON, byte for byte what `encode_readings(readings)` returns.
        """
        if type(readings) is Snapshot and len(readings) > 1:
            return self._encode_snapshot(readings)
        # A single reading could look like an escape; names that are not texts are left to the definition.
        if readings.keys() != self._names.keys():
            if len(readings) < 2 or not all(type(name) is str for name in readings):
                return encode_readings(readings)
            self._reset_columns(sorted(readings))
        values, times = zip(*self._pick(readings), strict=True)
        for place in compress(count(), map(is_not, values, self._values)):
            if not self._cache_value(place, values[place]):
                return encode_readings(readings)
        endings = _time_suffixes(times)
        size = 1 + len(readings) + self._size
        if endings is None or size > MAX_SIZE:
            return encode_readings(readings)
        if isinstance(endings, str):
            return Encoded(f"{{{f'{endings},'.join(self._texts)}{endings}}}", size)
        return Encoded(f"{{{','.join(map(str.__add__, self._texts, endings))}}}", size)

    def _encode_snapshot(self, snapshot: Snapshot) -> Encoded:
        """Encode readings that come in columns and share one time."""
        if snapshot.order is not self._order:
            self._reset_columns(list(snapshot.order.names))
            self._order = snapshot.order
        for place in compress(count(), map(is_not, snapshot.column, self._values)):
            if not self._cache_value(place, snapshot.column[place]):
                return encode_readings(snapshot)
        size = 1 + len(self._names) + self._size
        if type(snapshot.time) is not float or not isfinite(snapshot.time) or size > MAX_SIZE:
            return encode_readings(snapshot)
        ending = f"{snapshot.time!r}]"
        return Encoded(f"{{{f'{ending},'.join(self._texts)}{ending}}}", size)

    def _reset_columns(self, names: list[str]) -> None:
        self._order = None
        self._names = dict.fromkeys(names)
        self._quoted = [*map(encode_basestring_ascii, names)]
        self._lengths = [*map(len, names)]
        self._pick = itemgetter(*names)
        self._values = [_NOT_CACHED] * len(names)
        self._texts = [""] * len(names)
        self._sizes = [0] * len(names)
        self._size = 0

    def _cache_value(self, place: int, value: Any) -> bool:
        """Cache the text of one value; return False if it cannot be cached because it may change."""
        self._values[place] = _NOT_CACHED
        kind = type(value)
        if kind is float and isfinite(value):
            text, used = repr(value), 1
        elif kind is tuple and set(map(type, value)) == _DOUBLE and all(map(isfinite, value)):
            text, used = f"[{','.join(map(repr, value))}]", 1 + 2 * len(value)
        elif not _is_immutable(value):
            return False
        else:
            encoder = Encoder()
            text, used = encoder.encode(value, 2), encoder.used_size
        self._texts[place] = f"{self._quoted[place]}:[{text},"
        # The name, a list of two, the value and its time.
        size = self._lengths[place] + 3 + used + 1
        self._size += size - self._sizes[place]
        self._sizes[place] = size
        self._values[place] = value
        return True


def _time_suffixes(times: tuple[Any, ...]) -> str | list[str] | None:
    """Return the text after each value: one text if all times are equal, None if any is not finite."""
    first = times[0]
    if all(map(is_, times, repeat(first))):
        return f"{first!r}]" if type(first) is float and isfinite(first) else None
    if not all(type(time) is float and isfinite(time) for time in times):
        return None
    return [f"{time!r}]" for time in times]


def _is_immutable(value: Any) -> bool:
    """Return True if the value cannot change while it stays the same object."""
    return type(value) in _IMMUTABLE_TYPES or (
        type(value) is tuple and all(type(part) in _IMMUTABLE_TYPES for part in value)
    )
