"""What is measured as a record holds it, encoded anew only as far as it is not what was measured before.

From one decision to the next most values stay the same objects, and all readings of a moment share its time.
"""

from __future__ import annotations

from json.encoder import encode_basestring_ascii
from math import isfinite
from typing import Any, Final, NamedTuple

from aeros.runtime.canonical import MOST_SIZE, Encoded, Encoder, encoded
from aeros.runtime.ports import Readings

_CONSTANT: Final = (float, bool, int, str, type(None))
"""Types of values that never change."""

_MOST_KEPT: Final = 10_000


class _Told(NamedTuple):
    """A value by name; its text up to the time, and what both take of an encoding's size."""

    value: Any
    text: str
    size: int


def told_readings(readings: Readings) -> Encoded:
    """Value and time of each reading, by name."""
    return encoded({name: [one.value, one.time] for name, one in readings.items()})


class ReadingsTeller:
    """Says what `told_readings` says of one moment after another."""

    def __init__(self) -> None:
        self._kept: dict[str, _Told] = {}
        self._names: dict[str, None] = {}  # sorted

    def tell(self, readings: Readings) -> Encoded:
        """The readings with their canonical text."""
        # A single one could look like what stands for something else; what has no name is not told.
        if readings.keys() != self._names.keys():
            if len(readings) < 2 or not all(type(name) is str for name in readings):
                return told_readings(readings)
            self._names = dict.fromkeys(sorted(readings))
        texts, size = [], 1 + len(readings)
        time, ending = None, ""
        for name in self._names:
            reading = readings[name]
            value = reading.value
            if reading.time is not time:
                time = reading.time
                if type(time) is not float or not isfinite(time):
                    return told_readings(readings)
                ending = f"{time!r}]"
            one = self._kept.get(name)
            if one is None or one.value is not value:
                if not _is_constant(value):
                    return told_readings(readings)
                one = self._keep(name, value)
            texts.append(one.text + ending)
            size += one.size
        return told_readings(readings) if size > MOST_SIZE else Encoded("{" + ",".join(texts) + "}", size)

    def _keep(self, name: str, value: Any) -> _Told:
        if len(self._kept) == _MOST_KEPT:
            self._kept.clear()
        encoder = Encoder()
        text = f"{encode_basestring_ascii(name)}:[{encoder.text(value, 2)},"
        # The name, a list of two, the value and its time.
        self._kept[name] = one = _Told(value, text, len(name) + 3 + encoder.used + 1)
        return one


def _is_constant(value: Any) -> bool:
    """Whether the value can never be another one while it is the same object."""
    return type(value) in _CONSTANT or (
        type(value) is tuple and all(type(part) in _CONSTANT for part in value)
    )
