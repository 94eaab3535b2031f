"""Checks of a request at the gate: its structure, and each value against its declaration.

Nothing is trusted: a mapping must be a `dict` and a name a `str`, no subclass of them, so no code of the
caller runs while the gate decides.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Any, cast

from aeros.runtime.gate.decision import Caller, Reason
from aeros.runtime.gate.value_check import Scalars, ValueChecker, check_freshness, is_reading
from aeros.runtime.ports import ColumnNames, Reading, Readings, Snapshot
from aeros.skill import Action
from aeros.spec.expr.doubles import nearest_double_in_range
from aeros.spec.model.variables import Declared

_MISSING = object()


def request_fault(caller: Any, readings: Any, action: Any, usage: Any) -> Reason | None:
    """Check the structure of a request, before any of its values are read.

    Args:
        caller: any object; well-formed if it is a `Caller`.
        readings: any object; well-formed if it is a dict of readings by name.
        action: any object; well-formed if it is an `Action`.
        usage: any object; well-formed if it is a dict of counts by quota id.

    Returns:
        The first fault, or None if the request is well-formed.
    """
    if type(caller) is not Caller or not _has_valid_names(caller, "module", "skill"):
        return Reason("AE701", "caller", "the caller is not a module's skill")
    if type(action) is not Action or len(action) != len(Action._fields) or type(action.kind) is not str:
        return Reason("AE701", "action", "the action is not an action of some kind")
    for name, mapping in (
        ("inputs", getattr(caller, "inputs", None)),
        ("parameters", action.parameters),
        ("state", readings),
        ("usage", usage),
    ):
        if type(mapping) is not dict or not all(type(key) is str for key in mapping):
            return Reason("AE701", name, f"`{name}` is not a mapping by name")
    return None


def _has_valid_names(caller: Caller, *fields: str) -> bool:
    """Return True if these fields are set, and are exactly `str`."""
    return all(type(getattr(caller, field, None)) is str for field in fields)


def unpack_arguments(
    checkers: Mapping[str, ValueChecker], given: Mapping[str, Any], whose: str, values: Scalars
) -> Iterator[Reason]:
    """Unpack every parameter or input into scalars.

    Args:
        checkers: the declared parameters or inputs, by name.
        given: the values, by name; a missing one takes its declared default.
        whose: ends the objections' text, such as ``of `grip` ``.
        values: receives each well-formed scalar, by scalar variable.

    Yields:
        An objection for each value that is missing, unknown or malformed.
    """
    for name in given:
        if name not in checkers:
            yield Reason("AE702", name, f"`{name}` is not declared {whose}")
    for name, form in checkers.items():
        value = given.get(name, _MISSING)
        if value is _MISSING and form.declared.default_value is not None:
            value = _default(form.declared)
        if value is _MISSING:
            yield Reason("AE703", name, f"`{name}` {whose} is missing")
            continue
        fault = form.unpack(value, values)
        if fault is not None:
            yield fault


def unpack_readings(
    checkers: Mapping[str, ValueChecker],
    readings: Readings,
    now: float,
    required: frozenset[str],
    values: Scalars,
    module_variables: frozenset[str] = frozenset(),
) -> Iterator[Reason]:
    """Unpack every reading into scalars.

    A reading of a module's variable counts only where it is required, so that nothing that a module measures
    can lead to an objection to another's action.

    Args:
        checkers: the site's state variables, by name.
        readings: the readings, by name.
        now: time of the decision, s.
        required: the variables that must be present and fresh; others that are present must be well-formed.
        values: receives each well-formed scalar, by scalar variable.
        module_variables: the state variables of modules.

    Yields:
        An objection for each reading that is missing, unknown, malformed or stale.
    """
    for name, reading in readings.items():
        if name in module_variables and name not in required:
            continue
        form = checkers.get(name)
        if form is None and is_module_variable(name):
            continue  # of a module that is not active
        if form is None:
            yield Reason("AE702", name, f"`{name}` is not a state variable of this site")
            continue
        fault = unpack_reading(form, reading, now, name in required, values)
        if fault is not None:
            yield fault
    for name in sorted(required - readings.keys()):
        yield Reason("AE703", name, f"`{name}` is not measured")


def is_module_variable(name: Any) -> bool:
    """Tell if a name is the full name of a module's variable, as `kettle.water_hot`, of whatever module.

    Args:
        name: any object; of a state variable, its name.

    Returns:
        True if it is two identifiers with a `.` between them; a site's variable has none.
    """
    if type(name) is not str:
        return False
    module, dot, variable = name.partition(".")
    return dot == "." and module.isidentifier() and variable.isidentifier()


def unpack_reading(
    checker: ValueChecker, reading: Any, now: float, required: bool, values: Scalars
) -> Reason | None:
    """Unpack one reading into scalars.

    Args:
        checker: the declared state variable.
        reading: any object; well-formed if it is a `Reading`.
        now: time of the decision, s.
        required: True if the reading must be fresh.
        values: receives its scalars; of a faulty reading perhaps some, never all.

    Returns:
        The objection, or None.
    """
    if not is_reading(reading):
        name = checker.declared.name
        return Reason("AE701", name, f"`{name}` is not a value with a time")
    return check_freshness(checker, reading.time, now, required) or checker.unpack(reading.value, values)


def snapshot_columns(snapshot: Snapshot) -> tuple[ColumnNames, tuple[Any, ...]] | None:
    """Return the names and values of a snapshot after a check of its structure.

    A snapshot may never have been initialized, or its attributes may have been replaced.

    Args:
        snapshot: an object whose type is `Snapshot`.

    Returns:
        The names and as many values; None if the snapshot is malformed.
    """
    try:
        order, column = snapshot.order, snapshot.column
        if type(order) is not ColumnNames or type(order.names) is not tuple or type(column) is not tuple:
            return None
        return (order, column) if len(order.names) == len(column) else None
    except AttributeError:
        return None


def individual_readings(snapshot: Snapshot) -> dict[str, Reading] | None:
    """Return a snapshot's readings one by one.

    Args:
        snapshot: an object whose type is `Snapshot`.

    Returns:
        The readings by name; None if the snapshot is malformed.
    """
    columns, time = snapshot_columns(snapshot), cast("float", getattr(snapshot, "time", None))
    if columns is None or not all(type(name) is str for name in columns[0].names):
        return None
    return {name: Reading(value, time) for name, value in zip(columns[0].names, columns[1], strict=True)}


def to_plant_parameters(
    checkers: Mapping[str, ValueChecker], parameters: Mapping[str, Any]
) -> dict[str, Any]:
    """Convert checked parameters to the form that plants expect.

    Args:
        checkers: the declared parameters, by name.
        parameters: a well-formed value of each.

    Returns:
        The parameters in the declared order, whole numbers as floats, lists as tuples.
    """
    return {name: _to_plant_value(parameters[name]) for name in checkers}


def _to_plant_value(value: Any) -> Any:
    if type(value) is int:
        return float(value)
    return tuple(_to_plant_value(part) for part in value) if type(value) in (list, tuple) else value


def _default(declared: Declared) -> Any:
    """Return the declared default as a skill would give it; rationals become doubles within the range."""

    def given(part: Any) -> Any:
        return nearest_double_in_range(part, declared.range) if isinstance(part, Fraction) else part

    value = declared.default_value
    return tuple(map(given, value)) if isinstance(value, tuple) else given(value)
