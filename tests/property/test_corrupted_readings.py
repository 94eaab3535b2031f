"""Readings of a wrong shape: every mode of the gate denies them, and all modes decide the same."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.gate.decision import Caller, DecisionKind
from aeros.runtime.gate.gate import GateMode
from aeros.runtime.ports import ColumnNames, Reading, Snapshot
from aeros.skill import Action
from tests.unit.runtime.bench import ALLOWED, NOW, STATE, Request, gate, request

_PARTS = st.sampled_from([*STATE.values(), NOW, NOW - 1.0, 0, None, "", (), float("nan"), Reading(0.5, NOW)])
_NAMES = st.sampled_from([*STATE, "mood", "", 0, None])


class OtherReading(Reading):
    """A subclass, whose fields could be properties."""


@st.composite
def _readings_of_any_shape(draw: st.DrawFn) -> Any:
    """A reading, with any number of fields, of the class or of another."""
    fields = tuple(draw(st.lists(_PARTS, max_size=4)))
    make = draw(st.sampled_from((Reading, Reading, OtherReading, Action, tuple, list)))
    return list(fields) if make is list else tuple.__new__(make, fields)


@st.composite
def _snapshots_of_any_shape(draw: st.DrawFn) -> Any:
    """A snapshot with attributes that were left out or replaced after it was made."""
    made = object.__new__(Snapshot)
    order = ColumnNames(STATE)
    values = tuple(STATE[name] for name in order.names)
    for attribute, sound in (("order", order), ("column", values), ("time", NOW)):
        form = draw(st.sampled_from(("sound", "sound", "sound", "replaced", "missing")))
        if form == "missing":
            continue
        if form == "replaced" and attribute == "order":
            sound = ColumnNames(())
            sound.names = draw(st.sampled_from([(), list(order.names), (*order.names[1:], 3), None]))
        elif form == "replaced":
            sound = draw(st.sampled_from([values[1:], (*values, 0.0), list(values), None, NOW, NOW + 1.0]))
        setattr(made, attribute, sound)
    return made


def _is_well_formed(given: Any) -> bool:
    return type(given) is Reading and len(given) == 2


def _decided(asked: Request) -> DecisionKind:
    decisions = [asked.decided_by(gate(mode)) for mode in GateMode]
    assert decisions.count(decisions[0]) == len(decisions)
    return decisions[0].kind


@given(_readings_of_any_shape(), st.sampled_from(sorted(STATE)), st.sampled_from(ALLOWED))
def test_every_mode_denies_a_reading_of_another_shape(
    reading: Any, name: str, asking: tuple[str, str]
) -> None:
    asked = request(*asking)
    kind = _decided(replace(asked, readings={**asked.readings, name: reading}))
    assert kind is DecisionKind.DENY or _is_well_formed(reading)


@given(_snapshots_of_any_shape(), st.sampled_from(ALLOWED))
def test_all_modes_decide_the_same_on_a_snapshot_of_any_shape(snapshot: Any, asking: tuple[str, str]) -> None:
    kind = _decided(replace(request(*asking), readings=snapshot))
    is_sound = (
        type(getattr(snapshot, "column", None)) is tuple
        and getattr(getattr(snapshot, "order", None), "names", None) == tuple(sorted(STATE))
        and len(snapshot.column) == len(STATE)
    )
    assert kind is DecisionKind.DENY or is_sound


@pytest.mark.parametrize(("skill", "kind"), ALLOWED)
@pytest.mark.parametrize("name", sorted(STATE))
def test_a_reading_of_three_fields_is_denied(name: str, skill: str, kind: str) -> None:
    asked = request(skill, kind)
    reading = tuple.__new__(Reading, (STATE[name], NOW, 0))
    assert _decided(replace(asked, readings={**asked.readings, name: reading})) is DecisionKind.DENY


@given(_NAMES, _PARTS)
def test_all_modes_decide_the_same_on_inputs_and_parameters_of_any_shape(name: Any, value: Any) -> None:
    asked = request()
    _decided(replace(asked, action=Action("move", {**asked.action.parameters, name: value})))
    _decided(replace(asked, caller=Caller("handling", "quickly", {name: value})))
    _decided(replace(asked, action=tuple.__new__(Action, ("move", asked.action.parameters, value))))
