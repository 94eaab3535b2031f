"""Decisions as their records hold them, encoded anew only as far as they are not what was told before.

Most decisions are plain: allowed as asked, with nothing beside.  Their text is put together of parts; of all
others `decision_details` is encoded like anything else.
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
"""Size of a plain decision's readings, and of its motion, at most: then all of it fits into a record."""

_MAX_TEXT: Final = 1000
"""Characters of a text that a skill asks for, and of its inputs, in a plain decision."""

_TEXT: Final = frozenset({str})
_DOUBLE: Final = frozenset({float})

_MISSING: Final = object()
"""In place of a parameter that is not there."""

_NO_CALLER: Final = Caller("", "", {})


class IncrementalDecisionEncoder:
    """Says what `decision_details` says of one decision after another, of plain ones as canonical text."""

    def __init__(self) -> None:
        self._readings = IncrementalReadingsEncoder()
        self._caller = _NO_CALLER
        self._who: tuple[str, str] | None = None  # inputs and module, and skill, of that caller
        self._usage: tuple[Mapping[str, int], str] = ({}, "{}")
        self._motionless: tuple[PlannedMotion, Mapping[str, Any]] | None = None

    def encode_motion(
        self, plan: PlannedMotion, body: str, gated: Decision, decision: Decision
    ) -> Mapping[str, Any]:
        """`motion_details` of what a plant said; `body` as in `motion_to_json`."""
        if type(plan) is not NoMotion or type(plan.reason) is not str or decision is not gated:
            return motion_details(gated, decision, motion_to_json(plan, body))
        # It never changes, and a plant without a body says nothing else.
        if self._motionless is None or plan is not self._motionless[0]:
            self._motionless = plan, motion_details(gated, decision, motion_to_json(plan, body))
        return self._motionless[1]

    def encode(self, record: DecisionRecord) -> Mapping[str, Any] | Encoded:
        """The details of the decision's record; see `decision_details`."""
        text = self._encode_plain(record)
        return decision_details(record, self._readings.encode) if text is None else text

    def _encode_plain(self, record: DecisionRecord) -> Encoded | None:
        """The text of a plain decision; None of another."""
        decision, configuration, now, readings, caller, asked, usage, beside, halting, motion, causes = record
        if decision.kind is not DecisionKind.ALLOW or decision.reasons or beside or halting or causes:
            return None
        if usage is None or type(now) is not float or not isfinite(now) or decision.action is None:
            return None
        if caller is not self._caller:
            self._caller, self._who = caller, _encode_caller(caller)
        wanted = _encode_action(asked)
        if self._who is None or wanted is None:
            return None
        decided = wanted if _is_unchanged(decision.action, asked) else _encode_action(decision.action)
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
            f'{{"asked":{wanted},"configuration":"{configuration}","decided":{decided},{who}{moved}'
            f',"reasons":[],{skill},"state":{state.text},"state_digest":"{state.digest}","time":{now!r}'
            f',"usage":{self._encode_usage(usage)},"verdict":"ALLOW"}}'
        )
        # Whatever it is, an encoding has at least as many characters as it takes of `MAX_SIZE`.
        return Encoded(text, len(text))

    def _encode_usage(self, usage: Mapping[str, int]) -> str:
        if usage != self._usage[0]:
            kept = dict(usage)
            self._usage = kept, encode_with_size(kept).text
        return self._usage[1]


def _encode_caller(caller: Caller) -> tuple[str, str] | None:
    """A caller's inputs and module, and its skill, as items of a record, where they are no more than flat."""
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
    """A dict of doubles, truths, short texts and tuples of doubles as canonical text; None of others."""
    if type(values) is not dict or not set(map(type, values)) <= _TEXT:
        return None
    if len(values) == 1 and not values.keys().isdisjoint(ESCAPE_MARKS):
        return None
    told = []
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
        told.append(f"{encode_basestring_ascii(name)}:{text}")
    return f"{{{','.join(told)}}}"


def _is_unchanged(decided: Action, requested_action: Action) -> bool:
    """Whether what was decided are the very values that were asked for, so that both have one text."""
    if decided.kind != requested_action.kind or len(decided.parameters) != len(requested_action.parameters):
        return False
    for name, value in decided.parameters.items():
        other = requested_action.parameters.get(name, _MISSING)
        if value is not other and not (
            type(value) is tuple is type(other) and len(value) == len(other) and all(map(is_, value, other))
        ):
            return False
    return True
