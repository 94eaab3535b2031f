"""Malformed requests are refused with the right code, and checked values are unpacked."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from types import MappingProxyType
from typing import Any

import pytest

from aeros.runtime.gate.decision import Caller, Reason
from aeros.runtime.gate.request_check import (
    individual_readings,
    is_module_variable,
    request_fault,
    snapshot_columns,
    to_plant_parameters,
    unpack_arguments,
    unpack_readings,
)
from aeros.runtime.gate.value_check import ValueChecker
from aeros.runtime.ports import ColumnNames, Reading, Snapshot
from aeros.skill import Action
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, VectorType
from aeros.spec.expr.units import LENGTH
from tests.unit.runtime.conftest import METRES, declare

CALLER = Caller("m", "s", {})
ACTION = Action("move", {})


class Name(str):
    __slots__ = ()


class Sly(dict[str, Any]):
    """A mapping that could run code of the caller."""


class SlyCaller(Caller):
    """A name that could run code of the caller."""


def forms(**more: Any) -> dict[str, ValueChecker]:
    found = {
        "speed": declare("speed", METRES, t.VariableRole.PARAMETER, range=(Fraction(0), Fraction(1)), **more),
        "gently": declare("gently", BOOL, t.VariableRole.PARAMETER),
        "target": declare(
            "target", VectorType(LENGTH), t.VariableRole.PARAMETER, range=(Fraction(-1), Fraction(1))
        ),
    }
    return {name: ValueChecker(one) for name, one in found.items()}


def test_a_request_of_the_right_form_has_no_fault() -> None:
    assert request_fault(CALLER, {}, ACTION, {}) is None


@pytest.mark.parametrize(
    ("caller", "readings", "action", "usage", "what"),
    [
        (None, {}, ACTION, {}, "caller"),
        (SlyCaller("m", "s", {}), {}, ACTION, {}, "caller"),
        (Caller(3, "s", {}), {}, ACTION, {}, "caller"),  # type: ignore[arg-type]
        (Caller("m", Name("s"), {}), {}, ACTION, {}, "caller"),
        (Caller("m", "s", Sly()), {}, ACTION, {}, "inputs"),
        (CALLER, {}, ("move", {}), {}, "action"),
        (CALLER, {}, Action(Name("move"), {}), {}, "action"),
        (CALLER, {}, Action("move", MappingProxyType({})), {}, "parameters"),
        (CALLER, {}, Action("move", {Name("speed"): 1.0}), {}, "parameters"),
        (CALLER, [], ACTION, {}, "state"),
        (CALLER, {1: 2}, ACTION, {}, "state"),
        (CALLER, {}, ACTION, None, "usage"),
    ],
)
def test_a_malformed_request_is_refused(
    caller: Any, readings: Any, action: Any, usage: Any, what: str
) -> None:
    fault = request_fault(caller, readings, action, usage)
    assert fault is not None
    assert (fault.code, fault.rule) == ("AE701", what)


def test_a_caller_whose_inputs_were_never_set_is_refused_in_words() -> None:
    caller = object.__new__(Caller)
    for name in ("module", "skill"):
        object.__setattr__(caller, name, "m")
    assert request_fault(caller, {}, ACTION, {}) == Reason(
        "AE701", "inputs", "`inputs` is not a mapping by name"
    )


def test_given_values_are_unpacked_into_scalars() -> None:
    values: dict[str, Any] = {}
    given = {"speed": 0.5, "gently": True, "target": (0.1, 0.2, 0.3)}
    assert list(unpack_arguments(forms(), given, "of `move`", values)) == []
    assert values == {"speed": 0.5, "gently": True, "target.x": 0.1, "target.y": 0.2, "target.z": 0.3}


def test_every_value_that_is_missing_unknown_or_malformed_is_an_objection() -> None:
    given = {"speed": 2.0, "pace": 1.0, "target": (0.1, 0.2)}
    found = [(one.code, one.rule) for one in unpack_arguments(forms(), given, "of `move`", {})]
    assert found == [("AE702", "pace"), ("AE705", "speed"), ("AE703", "gently"), ("AE704", "target")]


def test_a_missing_value_takes_its_default_as_a_double_in_range() -> None:
    values: dict[str, Any] = {}
    third = Fraction(1, 3)
    declared = {"speed": forms(default_value=third)["speed"]}
    assert list(unpack_arguments(declared, {}, "of `move`", values)) == []
    assert values == {"speed": float(third)}
    assert list(unpack_arguments(declared, {"speed": 0.25}, "of `move`", values)) == []
    assert values == {"speed": 0.25}


@pytest.mark.parametrize(
    ("name", "default", "scalars"),
    [
        ("gently", True, {"gently": True}),
        (
            "target",
            (Fraction(1, 3), Fraction(0), Fraction(-1)),
            {"target.x": 1 / 3, "target.y": 0.0, "target.z": -1.0},
        ),
    ],
)
def test_a_default_of_any_type_stands_for_a_missing_value(
    name: str, default: Any, scalars: dict[str, Any]
) -> None:
    declared = replace(forms()[name].declared, default_value=default)
    values: dict[str, Any] = {}
    assert list(unpack_arguments({name: ValueChecker(declared)}, {}, "of `move`", values)) == []
    assert values == scalars


AGED = {
    name: ValueChecker(
        declare(name, METRES, t.VariableRole.STATE, range=(Fraction(0), Fraction(1)), max_age=Fraction(1, 2))
    )
    for name in ("near", "far")
}


@pytest.mark.parametrize(
    ("readings", "codes"),
    [
        ({"near": Reading(0.5, 9.75)}, []),
        ({"near": Reading(0.5, 9.75), "far": Reading(0.5, 1.0)}, []),  # not required, so it may be old
        ({"near": Reading(0.5, 9.0)}, [("AE706", "near")]),
        ({"far": Reading(0.5, 9.75)}, [("AE703", "near")]),
        ({"near": Reading(0.5, 9.75), "new": Reading(1.0, 1.0)}, [("AE702", "new")]),
        ({"near": (0.5, 9.75)}, [("AE701", "near")]),
        ({"near": Reading(1.5, 9.75)}, [("AE705", "near")]),
        ({"near": Reading(0.5, 10.5)}, [("AE707", "near")]),
        ({"near": Reading(0.5, 9.75), "far": Reading(7.0, 9.75)}, [("AE705", "far")]),
    ],
)
def test_readings_must_be_well_formed_and_required_ones_fresh(
    readings: dict[str, Any], codes: list[tuple[str, str]]
) -> None:
    values: dict[str, Any] = {}
    found = unpack_readings(AGED, readings, 10.0, frozenset({"near"}), values)
    assert [(one.code, one.rule) for one in found] == codes
    if not codes:
        assert values["near"] == 0.5


def test_the_plant_gets_doubles_and_tuples_in_the_declared_order() -> None:
    made = to_plant_parameters(forms(), {"target": [0, 1.5, [2]], "gently": True, "speed": 1})
    assert made == {"speed": 1.0, "gently": True, "target": (0.0, 1.5, (2.0,))}
    assert list(made) == ["speed", "gently", "target"]
    assert (type(made["speed"]), made["gently"]) == (float, True)


@pytest.mark.parametrize(
    ("name", "is_one"),
    [
        ("kettle.water_hot", True),
        ("water_hot", False),
        ("kettle.", False),
        (".water_hot", False),
        ("kettle.water.hot", False),
        ("kettle.water hot", False),
        ("my kettle.water_hot", False),
        ("kettle,water_hot", False),
        ("", False),
        (None, False),
        (b"kettle.water_hot", False),
    ],
)
def test_a_variable_of_a_module_has_two_names_with_a_dot(name: Any, is_one: bool) -> None:
    assert is_module_variable(name) is is_one


def test_a_reading_of_a_module_that_is_not_active_is_no_objection() -> None:
    readings: Any = {
        "kettle.water_hot": None,
        "kettle.on.fire": Reading(True, 9.75),
        "near": Reading(0.5, 9.75),
    }
    found = list(unpack_readings(AGED, readings, 10.0, frozenset({"near"}), {}))
    assert [(one.code, one.rule) for one in found] == [("AE702", "kettle.on.fire")]


def test_every_unknown_reading_is_an_objection() -> None:
    readings: Any = {"new": Reading(1.0, 1.0), "near": (0.5, 9.75), "newer": 1.0}
    found = unpack_readings(AGED, readings, 10.0, frozenset({"near"}), {})
    assert [(one.code, one.rule) for one in found] == [
        ("AE702", "new"),
        ("AE701", "near"),
        ("AE702", "newer"),
    ]


_NAMES = ColumnNames(["far", "near"])


class _OtherNames(ColumnNames):
    __slots__ = ()


def _names(names: Any) -> ColumnNames:
    order = ColumnNames([])
    order.names = names
    return order


@pytest.mark.parametrize(
    "changed",
    [
        {"order": _OtherNames(["far", "near"])},
        {"order": _names(["far", "near"])},
        {"order": ("far", "near")},
        {"column": [0.25, 0.5]},
        {"column": (0.25,)},
        {"column": (0.25, 0.5, 0.75)},
        {"column": None},
    ],
)
def test_a_snapshot_whose_parts_were_replaced_is_malformed(changed: dict[str, Any]) -> None:
    snapshot = Snapshot(_NAMES, (0.25, 0.5), 9.75)
    assert snapshot_columns(snapshot) == (_NAMES, (0.25, 0.5))
    assert individual_readings(snapshot) == {"far": Reading(0.25, 9.75), "near": Reading(0.5, 9.75)}
    for name, value in changed.items():
        setattr(snapshot, name, value)
    assert snapshot_columns(snapshot) is None
    assert individual_readings(snapshot) is None


def test_a_snapshot_that_was_never_initialized_is_malformed() -> None:
    assert snapshot_columns(object.__new__(Snapshot)) is None
    assert individual_readings(object.__new__(Snapshot)) is None


def test_a_name_in_a_snapshot_that_is_no_str_is_malformed() -> None:
    snapshot = Snapshot(_NAMES, (0.25, 0.5), 9.75)
    snapshot.order = _names(("far", Name("near")))
    assert individual_readings(snapshot) is None
