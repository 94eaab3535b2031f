"""Predicates of modules that follow from what motions change and what is surveyed, as "at the dock"."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import Any, Final

from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import is_true
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site

_MOVED: Final = frozenset({"base_position"})
"""Variables that motions change and whose value is that of a robot with a body, too."""


class PlaceDefinitions:
    """Definitions that read the base's position, and else only what the site's own sensors measure.

    They hold as they would on a robot: one who drives away from a dock is not at it any more. The other
    definitions change by declared outcomes alone.

    Args:
        site: with the variables of the modules.
        modules: the modules, whose definitions these are.
    """

    def __init__(self, site: Site, modules: Iterable[Ecm]) -> None:
        self._terms: dict[str, t.Term] = {}
        for ecm in modules:
            for name, definition in ecm.definitions.items():
                read = t.variables_of(definition.term).keys()
                sensors = [site.state[one].sensor if one in site.state else None for one in read]
                if read & _MOVED and all(sensor is not None and "." not in sensor for sensor in sensors):
                    self._terms[name] = definition.term

    def update(self, values: dict[str, Any], changed: Iterable[str] | None = None) -> None:
        """Set the predicates that a change may have made true or false.

        Args:
            values: value of each state variable, SI; changed in place.
            changed: names of the variables that changed; None for all.
        """
        if changed is not None and _MOVED.isdisjoint(changed):
            return
        for name, term in self._terms.items():
            values[name] = is_true(term, {one: _exact(values[one]) for one in t.variables_of(term)})


def _exact(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(_exact(part) for part in value)
    return Fraction(value) if isinstance(value, float) else value
