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

    One that is false where the base is now no longer holds, as of a robot that drives away from a dock.
    Only a declared outcome makes one true, as a skill may fail with the base where it belongs. The other
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
        """Set the predicates to false that no longer hold.

        Args:
            values: value of each state variable, SI; changed in place.
            changed: names of the variables that changed; None for all.
        """
        if changed is not None and _MOVED.isdisjoint(changed):
            return
        for name, term in self._terms.items():
            read = t.variables_of(term)
            if values[name] and read.keys() <= values.keys():  # an unknown position refutes nothing
                values[name] = is_true(term, {one: _exact(values[one]) for one in read})


def _exact(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(_exact(part) for part in value)
    return Fraction(value) if isinstance(value, float) else value
