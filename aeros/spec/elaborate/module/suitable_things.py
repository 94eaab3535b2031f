"""The things of a site that suit a need of a module."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from aeros.spec.declared import configuration as declared
from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean
from aeros.spec.elaborate.expressions import elaborate_unit
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, RealType, Type, VectorType
from aeros.spec.model.configured import CAMERAS
from aeros.spec.model.site import Site

_ARTICLES: Final = {"action": "an action kind", "actuator": "an actuator"}
_FIELDS: Final = {
    "volume": {"offers"},
    "variable": {"type", "unit", "offers"},
    "constant": {"unit", "offers"},
    "camera": {"sees", "offers"},
    "action": {"parameters"},
    "tool": {"parameters"},
    "actuator": set[str](),
    "sensor": {"offers"},
    "resource": set[str](),
}
"""Fields that a need may have, by the sort of thing that it asks for."""


def wanted_thing(need: declared.Need) -> str:
    """Describe what a thing must be like.

    Args:
        need: the need.

    Returns:
        A noun phrase, such as ``a volume that offers `surface` ``.
    """
    parts = [_with_article(need)]
    if need.type is not None:
        parts.append(f"of type {need.type.value}" + (f" in {need.unit.value}" if need.unit else ""))
    elif need.unit is not None:
        parts.append(f"in {need.unit.value}")
    if need.offers is not None:
        parts.append(f"that offers `{need.offers.value}`")
    if need.sees is not None:
        parts.append(f"{'and' if need.offers else 'that'} sees `{need.sees.value}`")
    if need.parameters:
        parts.append("with " + ", ".join(f"`{one.value}`" for one in need.parameters))
    return " ".join(parts)


def things_of_sort(site: Site, sort: str) -> Mapping[str, object]:
    """List the things of a site of one sort.

    Args:
        site: the site.
        sort: `volume`, `variable` or another word of a need.

    Returns:
        The things by name.
    """
    match sort:
        case "volume":
            return site.volumes
        case "variable":
            return {name: one for name, one in site.state.items() if "." not in name}
        case "constant":
            return site.constants
        case "camera":
            return dict.fromkeys(site.enums[CAMERAS].members) if CAMERAS in site.enums else {}
        case "action":
            return {name: kind for name, kind in site.kinds.items() if kind.tool is None}
        case "tool":
            return {name: kind for name, kind in site.kinds.items() if kind.tool is not None}
        case "actuator":
            return dict.fromkeys(sorted(one for kind in site.kinds.values() for one in kind.actuators))
        case "sensor":
            return dict.fromkeys(site.sensor_names)
        case _:
            return site.resources


def suitable_things(site: Site, need: declared.Need, seen: str, diagnostics: Diagnostics) -> list[str] | None:
    """List the things of a site that suit a need.

    Args:
        site: the site.
        need: the need.
        seen: the volume that a camera must see, by the site's name; empty if any will do.
        diagnostics: receives the faults of the need.

    Returns:
        Their names in the order of the site file; None after a report.
    """
    has_type = _type_test(site, need, diagnostics)
    if has_type is None:
        return None
    sort = need.is_.value
    asked = {parameter.value for parameter in need.parameters}
    found = []
    for one in things_of_sort(site, sort):
        has_parameters = sort not in ("action", "tool") or asked <= site.kinds[one].parameters.keys()
        offers = need.offers is None or need.offers.value in site.offers.get(one, ())
        sees = not seen or (one in site.cameras and seen in site.cameras[one].sees)
        if has_parameters and offers and sees and has_type(_type_of(site, sort, one)):
            found.append(one)
    return found


def _with_article(need: declared.Need) -> str:
    return _ARTICLES.get(need.is_.value, f"a {need.is_.value}")


def _type_test(site: Site, need: declared.Need, diagnostics: Diagnostics) -> Callable[[Type], bool] | None:
    """Return the test of a thing's type; None after a report."""
    given = {
        "type": need.type,
        "unit": need.unit,
        "sees": need.sees,
        "offers": need.offers,
        "parameters": need.parameters[0] if need.parameters else None,
    }
    for word, field in given.items():
        if field is not None and word not in _FIELDS[need.is_.value]:
            diagnostics.error("AE112", f"{_with_article(need)} has no `{word}`", field.span)
            return None
    if need.type is None and need.unit is None:
        return lambda _: True
    unit = elaborate_unit(need.unit, diagnostics)
    if unit is None:
        return None
    word = "real" if need.type is None else need.type.value
    if word == "real":
        return lambda one: isinstance(one, RealType) and one.dimension == unit.dimension
    if word == "vec3":
        return lambda one: isinstance(one, VectorType) and one.dimension == unit.dimension
    if word not in ("bool", "int") and word not in site.enums:
        near = did_you_mean(word, ("bool", "int", "real", "vec3", *site.enums))
        help_ = f"did you mean `{near}`?" if near else "use `bool`, `int`, `real`, `vec3` or an enum"
        diagnostics.error("AE122", f"`{word}` is not a type", (need.type or need.is_).span, help=(help_,))
        return None
    return lambda one: str(one) == word


def _type_of(site: Site, sort: str, name: str) -> Type:
    """Return the type of a variable or constant; that of anything else counts for nothing."""
    if sort == "variable":
        return site.state[name].variable.type
    match site.constants.get(name):
        case t.Literal(type=type_) | t.ConstantTable(type=type_):
            return type_
        case t.Vector(x=t.Literal(type=RealType(dimension=dimension))):
            return VectorType(dimension)
    return BOOL
