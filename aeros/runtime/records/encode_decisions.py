"""Encode decision records as canonical JSON, incrementally.

Most decisions are plain: allowed unchanged, with no concurrent motions. Their text is assembled from parts
that are cached between calls. All other decisions are encoded by `decision_details`, which is the
definition of the encoding.
"""

from __future__ import annotations

from collections.abc import Mapping
from json.encoder import encode_basestring_ascii
from math import isfinite
from operator import is_
from typing import Any, Final

from aeros.runtime.canonical_json import ESCAPE_MARKS, MAX_SIZE, Encoded, encode_with_size
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind
from aeros.runtime.ports import NoMotion, PlannedMotion
from aeros.runtime.records.encode_readings import IncrementalReadingsEncoder
from aeros.runtime.records.records import (
    DecisionRecord,
    caller_details,
    decision_details,
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
            plan: what the plant planned for the action.
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
