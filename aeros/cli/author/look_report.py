"""Report of one look of a module's perceivers, as text and as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any, Final

from aeros.agent.world.values import to_json_value
from aeros.apps.look.looking import DefinedValue, Look, PerceiverLook, SeenValue
from aeros.cli.terminal.rendering import table_lines
from aeros.runtime.ports import Reading
from aeros.spec.expr.units import Unit, to_unit
from aeros.spec.model.site import Site

SCHEMA: Final = "aeros/look/1"


def text_lines(found: Look) -> Iterator[str]:
    """Describe a look.

    Args:
        found: the look.

    Yields:
        Lines of text.
    """
    for one in found.perceivers:
        yield from _perceiver_lines(one, found)
    if found.definitions:
        yield "definitions"
        lines = table_lines([_value_row(one.seen) for one in found.definitions], width=None, indent=2)
        for defined, line in zip(found.definitions, lines, strict=True):
            yield line
            yield f"    {' '.join(defined.text.split())}{_parts_text(defined, found.site)}"


def as_json(found: Look, module: str, scene: str, saved: Sequence[str]) -> str:
    """Encode a look.

    Args:
        found: the look.
        module: id of the module.
        scene: name of the scene.
        saved: a line for each saved file.

    Returns:
        The text; values are in SI.
    """
    data = {
        "schema": SCHEMA,
        "module": module,
        "scene": scene,
        "time": found.time,
        "is_right": found.is_right,
        "pictures": {name: {"time": picture.time} for name, picture in found.pictures.items()},
        "perceivers": [
            {
                "perceiver": one.perceiver.id,
                "fault": one.fault or None,
                "seconds": round(one.seconds, 3),
                "values": [_record(value) for value in one.values],
            }
            for one in found.perceivers
        ],
        "definitions": [
            {
                **_record(one.seen),
                "definition": one.text,
                "reads": {name: to_json_value(part.value) for name, part in one.parts.items()},
                "unknown": list(one.missing),
            }
            for one in found.definitions
        ],
        "saved": list(saved),
    }
    return json.dumps(data, indent=1)


def _record(one: SeenValue) -> dict[str, Any]:
    return {
        "variable": one.declared.name,
        "value": None if one.value is None else to_json_value(one.value),
        "unit": one.declared.unit.text,
        "uncertainty": one.uncertainty if isinstance(one.uncertainty, int | float) else None,
        "time": one.time,
        "reason": one.reason or None,
        "truth": one.truth,
        "is_false": one.is_false,
    }


def _perceiver_lines(one: PerceiverLook, found: Look) -> Iterator[str]:
    asked = [(one.camera, one.name) for one in one.perceiver.pictures if one.camera in found.pictures]
    shown = ", ".join(
        f"{name}{'' if name == camera else f' ({camera})'} at {found.pictures[camera].time:.2f} s"
        for camera, name in asked
    )
    seen = f"  pictures: {shown}" if shown else ""
    yield f"{one.perceiver.id}{seen}{f'  ({one.seconds * 1000.0:.0f} ms)' if one.seconds else ''}"
    if one.fault:
        yield f"  gave no values: {one.fault}"
    yield from table_lines(map(_value_row, one.values), width=None, indent=2)


def _short(one: SeenValue) -> str:
    return one.declared.name.partition(".")[2]


def _value_row(one: SeenValue) -> tuple[str, str]:
    unit = one.declared.unit
    parts = [_quantity(one.value, unit) if one.value is not None else "unknown"]
    if isinstance(one.uncertainty, int | float):
        parts.append(f"± {_quantity(one.uncertainty, unit)}")
        if one.declared.uncertainty is not None:
            parts.append(f"(at most {_quantity(float(one.declared.uncertainty), unit)})")
    if one.reason:
        parts.append(f"({one.reason})")
    if one.truth is not None:
        parts.append(f" truth {_truth_text(one)}{', DIFFERS' if one.is_false else ''}")
    return _short(one), " ".join(parts)


def _truth_text(one: SeenValue) -> str:
    return str(one.truth).lower() if isinstance(one.truth, bool) else _quantity(one.truth, one.declared.unit)


def _parts_text(defined: DefinedValue, site: Site) -> str:
    parts = [f"{name} = {_reading_text(name, part, site)}" for name, part in defined.parts.items()]
    parts += [f"{name} is unknown" for name in defined.missing]
    return f"  [{', '.join(parts)}]" if parts else ""


def _reading_text(name: str, reading: Reading, site: Site) -> str:
    declared = site.state.get(name)
    return str(reading.value) if declared is None else _quantity(reading.value, declared.unit)


def _quantity(value: Any, unit: Unit) -> str:
    """Write a value (SI) in a unit, with four digits."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple | list):
        return f"({', '.join(_number(one, unit) for one in value)}){_suffix(unit)}"
    if isinstance(value, int | float):
        return f"{_number(value, unit)}{_suffix(unit)}"
    return str(value)


def _number(value: Any, unit: Unit) -> str:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value).lower()
    # A nanometre is no finding, and 2e-19 hard to read.
    return f"{round(float(to_unit(Fraction(value), unit)), 9):.4g}"


def _suffix(unit: Unit) -> str:
    return "" if unit.text == "1" else f" {unit.text}"
