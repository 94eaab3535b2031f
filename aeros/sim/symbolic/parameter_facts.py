"""Predicates on the symbolic plant that depend on parameters of tasks: another fact for each value."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.spec.expr.doubles import to_doubles
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.task_parameters import arguments_in_force, parameters_behind_variables


class ParameterFacts:
    """Values of the parameters, and of the predicates that depend on them, as they were left.

    Args:
        modules: modules by name.

    Attributes:
        defaults: default of each parameter that has one, by full name.
    """

    def __init__(self, modules: Mapping[str, Ecm]) -> None:
        parameters = {name for ecm in modules.values() for name in ecm.task_parameters}
        self.defaults: Mapping[str, Any] = to_doubles(arguments_in_force(modules.values(), {}))
        behind = parameters_behind_variables(modules.values())
        self._depending = {name: sorted(one) for name, one in behind.items() if name not in parameters}
        self.restart()

    def restart(self) -> None:
        """Forget every value, as for a new run."""
        self._stated: Mapping[str, Any] = self.defaults
        self._left: dict[tuple[str, tuple[Any, ...]], Any] = {}

    def change(
        self, values: Mapping[str, Any], now: Mapping[str, Any], initial: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Set the parameters.

        Args:
            values: values (SI) of parameters, by full name; the others have their defaults.
            now: values of all state variables.
            initial: values of all state variables at the start.

        Returns:
            New values of the parameters, and of all that depends on one that changes: first as at the start,
            and later as it was left.
        """
        stated = {**self.defaults, **to_doubles(dict(values))}
        if stated == self._stated:
            return {}
        changes = dict(stated)
        for name, behind in self._depending.items():
            before, after = (tuple(map(one.get, behind)) for one in (self._stated, stated))
            if before != after and name in now:
                self._left[name, before] = now[name]
                changes[name] = self._left.get((name, after), initial[name])
        self._stated = stated
        return changes
