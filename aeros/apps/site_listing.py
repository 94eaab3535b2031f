"""Listing of a site for authors of modules: the names that it offers, their bounds, and who may use them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from aeros.spec.declared.objects import ObjectKind
from aeros.spec.declared.policy import Access
from aeros.spec.declared.quantity import Quantity
from aeros.spec.declared.site import ModuleSensor, Site
from aeros.spec.text.fields import MappingField


@dataclass(frozen=True)
class ListedNames:
    """Table of one kind of names.

    Attributes:
        title: kind of names.
        columns: headings; the first is that of the names.
        rows: texts by row, as many as there are columns.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def site_tables(site: Site) -> list[ListedNames]:
    """List the names of a site.

    Args:
        site: the site as declared, overlays included.

    Returns:
        A table for each kind of names that the site has, with numbers as the site file writes them.
    """
    tables = [
        ListedNames(
            "volumes",
            ("volume", "lower corner", "upper corner", "offers", "meaning"),
            tuple(
                (name.value, _list(one.lower), _list(one.upper), _list(one.offers), _text(one.description))
                for name, one in site.volumes
            ),
        ),
        ListedNames(
            "cameras",
            ("camera", "sees", "offers", "largest picture", "sensor"),
            tuple(
                (
                    name.value,
                    _list(one.sees),
                    _list(one.offers),
                    f"{one.width.value} x {one.height.value}",
                    one.sensor.value,
                )
                for name, one in site.cameras
            ),
        ),
        ListedNames(
            "state variables",
            ("variable", "type and bounds", "measured by", "at most as old as", "offers", "meaning"),
            tuple(
                (
                    name.value if one.index is None else f"{name.value}[{one.index.value}]",
                    _bounds(one),
                    one.sensor.value,
                    one.max_age.value,
                    _list(one.offers),
                    _text(one.description),
                )
                for name, one in site.state
            ),
        ),
        ListedNames(
            "sensors whose quantities modules declare",
            ("sensor", "offers", "meaning"),
            tuple(
                (name.value, _list(one.offers), one.description.value)
                if isinstance(one, ModuleSensor)
                else (name.value, "", one.value)
                for name, one in site.sensors
            ),
        ),
        ListedNames(
            "movers of sensors",
            ("sensor", "changed only by"),
            tuple((name.value, _list(movers) or "no actuator") for name, movers in site.moved_by),
        ),
        ListedNames(
            "actions",
            ("action", "parameters", "moves", "risk", "limited by", "action of the simulators", "meaning"),
            tuple(
                (
                    name.value,
                    "; ".join(f"{own.value}: {_bounds(one)}" for own, one in kind.parameters),
                    _list(kind.actuators),
                    str(kind.risk.value),
                    ", ".join(_rules_on(site, name.value)),
                    _text(kind.means),
                    kind.description.value,
                )
                for name, kind in site.actions
            ),
        ),
        ListedNames(
            "invariants",
            ("invariant", "of", "condition"),
            tuple(
                (
                    rule.id.value,
                    "all actions" if rule.on is None else _list(rule.on),
                    _line(rule.require.value),
                )
                for rule in site.invariants
            ),
        ),
        ListedNames(
            "definitions",
            ("definition", "condition"),
            tuple((name.value, _line(condition.value)) for name, condition in site.definitions),
        ),
        ListedNames("constants", ("constant", "value", "offers", "source"), tuple(_constants(site))),
        ListedNames(
            "enums",
            ("enum", "members"),
            tuple((name.value, _list(members)) for name, members in site.enums),
        ),
        ListedNames("objects", ("object", "words", "shape"), tuple(map(_object, site.objects))),
        ListedNames(
            "resources",
            ("resource", "number"),
            tuple((name.value, str(number.value)) for name, number in site.resources),
        ),
        ListedNames(
            "access",
            ("module", "actuators", "sensors", "channels", "computing devices"),
            (("all modules", *_access(site.policy.access)), *_grants(site.policy.grants)),
        ),
    ]
    return [table for table in tables if table.rows]


def as_markdown(tables: Iterable[ListedNames]) -> str:
    """Write tables as Markdown.

    Args:
        tables: tables of names.

    Returns:
        A section for each.
    """
    parts = []
    for table in tables:
        lines = [table.columns, ("---",) * len(table.columns)]
        lines += [(f"`{first}`", *map(_cell, others)) for first, *others in table.rows]
        rows = "\n".join(f"| {' | '.join(line)} |" for line in lines)
        parts.append(f"## {table.title.capitalize()}\n\n{rows}\n")
    return "\n".join(parts)


def as_text(tables: Iterable[ListedNames]) -> str:
    """Write tables for a terminal.

    Args:
        tables: tables of names.

    Returns:
        A paragraph for each name, with its columns named, below the title of its table.
    """
    parts = []
    for table in tables:
        lines = [table.title]
        for first, *others in table.rows:
            lines.append(f"  {first}")
            named = zip(table.columns[1:], others, strict=True)
            lines += [f"      {column}: {value}" for column, value in named if value]
        parts.append("\n".join(lines))
    return "\n\n".join(parts)


def as_json(tables: Iterable[ListedNames]) -> dict[str, Any]:
    """Convert tables for `json.dumps`.

    Args:
        tables: tables of names.

    Returns:
        The values by column, by name, by title.
    """
    return {
        table.title: {row[0]: dict(zip(table.columns[1:], row[1:], strict=True)) for row in table.rows}
        for table in tables
    }


def _rules_on(site: Site, kind: str) -> Iterator[str]:
    """Yield the invariants that name an action kind; those of all actions are not repeated at each."""
    for rule in site.invariants:
        if rule.on is not None and kind in {one.value for one in rule.on}:
            yield rule.id.value


def _constants(site: Site) -> Iterator[tuple[str, ...]]:
    for name, one in site.constants:
        unit = "" if one.unit is None else f" {one.unit.value}"
        values = None if one.values is None else ", ".join(number.node.text for number in one.values)
        value = f"{values}{unit}" if one.value is None else _line(one.value.value)
        shown = name.value if one.index is None else f"{name.value}[{one.index.value}]"
        yield shown, value, _list(one.offers), _line(_text(one.source))


def _object(entry: tuple[Any, ObjectKind]) -> tuple[str, ...]:
    name, one = entry
    shapes = {"box": one.box, "cylinder": one.cylinder}
    shape = "; ".join(f"{kind} {_list(size)}" for kind, size in shapes.items() if size is not None)
    return name.value, _list(one.words), shape


def _grants(grants: MappingField[Access]) -> tuple[tuple[str, ...], ...]:
    return tuple((name.value, *_access(one)) for name, one in grants)


def _access(access: Access) -> tuple[str, ...]:
    return tuple(map(_list, (access.actuators, access.sensors, access.channels, access.compute)))


def _bounds(one: Quantity) -> str:
    unit = "" if one.unit is None else f" {one.unit.value}"
    if one.range is None:
        return f"{one.type.value}{unit and f' in{unit}'}"
    return f"{one.type.value}, {' to '.join(number.node.text for number in one.range)}{unit}"


def _list(names: Iterable[Any]) -> str:
    return ", ".join(one.value for one in names)


def _text(field: Any) -> str:
    return "" if field is None else str(field.value)


def _line(text: str) -> str:
    return " ".join(text.split())


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
