"""Encode decision records, and the readings in them, as canonical JSON, incrementally.

Most decisions are plain: allowed unchanged, with no concurrent motions. Their text is assembled from parts
that are cached between calls. From one decision to the next most readings stay the same objects, and all
readings of a snapshot share its time. All else is encoded by `decision_details` and `encode_readings`, which
are the definition of the encoding.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import compress, count, repeat
from json.encoder import encode_basestring_ascii
from math import isfinite
from operator import is_, is_not, itemgetter
from typing import Any, Final

from aeros.runtime.canonical_json import ESCAPE_MARKS, MAX_SIZE, Encoded, Encoder, encode_with_size
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind
from aeros.runtime.ports import ColumnNames, NoMotion, PlannedMotion, Reading, Readings, Snapshot
from aeros.runtime.records.records import (
    DecisionRecord,
    caller_details,
    decision_details,
    encode_readings,
    motion_details,
    motion_to_json,
)
from aeros.skill import Action

_MAX_PLAIN_SIZE: Final = MAX_SIZE // 4
"""Limit on the size of a plain decision's readings and motion, each: then a record has room for all of it."""

_MAX_TEXT: Final = 1000
"""Limit on the characters of one text among the parameters or inputs of a plain decision."""

_TEXT: Final = frozenset({str})
_DOUBLE: Final = frozenset({float})

_MISSING: Final = object()
"""Stands for a missing parameter."""

_NO_CALLER: Final = Caller("", "", {})

_IMMUTABLE_TYPES: Final = (float, bool, int, str, type(None))
"""Types of immutable values."""

_NOT_CACHED: Final = object()
"""Stands for a value that is not cached: not encoded yet, or mutable."""


class IncrementalDecisionEncoder:
    """Encoder that agrees with `decision_details` and reuses the text of unchanged parts. Not thread-safe."""

    def __init__(self) -> None:
        self._readings = IncrementalReadingsEncoder()
        self._caller = _NO_CALLER
        self._who: tuple[str, str] | None = None  # its text: inputs and module, and skill
        self._usage: tuple[Mapping[str, int], str] = ({}, "{}")
        self._motionless: tuple[PlannedMotion, Mapping[str, Any]] | None = None

    def encode_motion(
        self, plan: PlannedMotion, body: str, gated: Decision, decision: Decision
    ) -> Mapping[str, Any]:
        """Encode a planned motion and the decision on it, as `motion_details` does.

        Args:
            plan: motion that the plant planned for the action.
            body: digest of the body of a trajectory; see `motion_to_json`.
            gated: the gate's decision, before the check of the motion.
            decision: the final decision; the same object if the motion changed nothing.

        Returns:
            Details for the record of the decision.
        """
        if type(plan) is not NoMotion or type(plan.reason) is not str or decision is not gated:
            return motion_details(gated, decision, motion_to_json(plan, body))
        # Cached, because a plant without a body returns the same object every time.
        if self._motionless is None or plan is not self._motionless[0]:
            self._motionless = plan, motion_details(gated, decision, motion_to_json(plan, body))
        return self._motionless[1]

    def encode(self, record: DecisionRecord) -> Mapping[str, Any] | Encoded:
        """Encode the details of a decision's record.

        Args:
            record: the decision and everything it was based on.

        Returns:
            Canonical text of a plain decision; of any other what `decision_details` returns.
        """
        text = self._encode_plain(record)
        return decision_details(record, self._readings.encode) if text is None else text

    def _encode_plain(self, record: DecisionRecord) -> Encoded | None:
        """Return the text of a plain decision; None if it is not plain."""
        decision, configuration, now, readings, caller, action, usage, concurrent, halting, motion, causes = (
            record
        )
        if decision.kind is not DecisionKind.ALLOW or decision.reasons or concurrent or halting or causes:
            return None
        if usage is None or type(now) is not float or not isfinite(now) or decision.action is None:
            return None
        if caller is not self._caller:
            self._caller, self._who = caller, _encode_caller(caller)
        requested = _encode_action(action)
        if self._who is None or requested is None:
            return None
        decided = requested if _is_unchanged(decision.action, action) else _encode_action(decision.action)
        state = self._readings.encode(readings)
        moved, size = "", 0
        if motion:
            of_motion = motion.get("motion")
            if len(motion) != 2 or type(of_motion) is not Encoded:
                return None
            moved = f',"motion":{of_motion.text},"motion_digest":"{motion["motion_digest"]}"'
            size = of_motion.size
        if decided is None or state.size > _MAX_PLAIN_SIZE or size > _MAX_PLAIN_SIZE:
            return None
        who, skill = self._who
        text = (
            f'{{"asked":{requested},"configuration":"{configuration}","decided":{decided},{who}{moved}'
            f',"reasons":[],{skill},"state":{state.text},"state_digest":"{state.digest}","time":{now!r}'
            f',"usage":{self._encode_usage(usage)},"verdict":"ALLOW"}}'
        )
        # An encoding has at least as many characters as its size counts, so this is an upper bound.
        return Encoded(text, len(text))

    def _encode_usage(self, usage: Mapping[str, int]) -> str:
        if usage != self._usage[0]:
            kept = dict(usage)
            self._usage = kept, encode_with_size(kept).text
        return self._usage[1]


def _encode_caller(caller: Caller) -> tuple[str, str] | None:
    """Return a caller's inputs with its module, and its skill, as items of a record; None if not flat."""
    details = caller_details(caller)
    inputs = _encode_flat(details["inputs"])
    if inputs is None:
        return None
    module, skill = (encode_basestring_ascii(details[name]) for name in ("module", "skill"))
    return f'"inputs":{inputs},"module":{module}', f'"skill":{skill}'


def _encode_action(action: Action) -> str | None:
    parameters = _encode_flat(action.parameters)
    if parameters is None:
        return None
    return f'{{"kind":{encode_basestring_ascii(action.kind)},"parameters":{parameters}}}'


def _encode_flat(values: Any) -> str | None:
    """Return a dict of doubles, bools, short texts and tuples of doubles as canonical text, else None."""
    if type(values) is not dict or not set(map(type, values)) <= _TEXT:
        return None
    if len(values) == 1 and not values.keys().isdisjoint(ESCAPE_MARKS):
        return None
    items = []
    for name in sorted(values):
        value = values[name]
        kind = type(value)
        if kind is float:
            if not isfinite(value):
                return None
            text = repr(value)
        elif kind is tuple:
            if not (set(map(type, value)) <= _DOUBLE and all(map(isfinite, value))):
                return None
            text = f"[{','.join(map(repr, value))}]"
        elif kind is str and len(value) <= _MAX_TEXT:
            text = encode_basestring_ascii(value)
        elif kind is bool:
            text = "true" if value else "false"
        else:
            return None
        items.append(f"{encode_basestring_ascii(name)}:{text}")
    return f"{{{','.join(items)}}}"


def _is_unchanged(decided: Action, requested_action: Action) -> bool:
    """Return True if the decided values are the very objects that were requested, so both have one text."""
    if decided.kind != requested_action.kind or len(decided.parameters) != len(requested_action.parameters):
        return False
    for name, value in decided.parameters.items():
        other = requested_action.parameters.get(name, _MISSING)
        if value is not other and not (
            type(value) is tuple is type(other) and len(value) == len(other) and all(map(is_, value, other))
        ):
            return False
    return True


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
