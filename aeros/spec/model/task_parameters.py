"""Parameters of tasks, which instructions set, and the objects of a site that they may name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Literal, Protocol

from aeros.spec.expr import terms as t
from aeros.spec.expr.types import EnumType
from aeros.spec.model.perception import Definition, Perceiver
from aeros.spec.model.variables import Declared

OBJECTS: Final = "objects"
"""Name of the enum of a site's objects, and of the table of them that perceivers may read."""

_INSTRUCTION: Final = "the instruction"
"""What measures a parameter, after the name of its module; no perceiver can have this name."""


def instruction_of(module: str) -> str:
    """Name what measures the parameters of a module's tasks.

    Args:
        module: id of the module.

    Returns:
        The name, in the place of a sensor.
    """
    return f"{module}.{_INSTRUCTION}"


def is_parameter(declared: Declared) -> bool:
    """Say if a state variable is a parameter of a task.

    Args:
        declared: the variable.

    Returns:
        True if an instruction sets it.
    """
    return declared.sensor is not None and is_instruction(declared.sensor)


def is_instruction(source: str) -> bool:
    """Say if the source of a value is an instruction.

    Args:
        source: sensor, module or perceiver that measured it.

    Returns:
        True if it is what `instruction_of` names.
    """
    return source.endswith(f".{_INSTRUCTION}")


@dataclass(frozen=True)
class TaskParameter:
    """Parameter of a task: a state variable of its module that no skill changes.

    Attributes:
        name: its name in the module.
        declared: the variable, under its full name.
        default: value (SI) if an instruction says none; None if it must say one.
        phrases: phrases for each member, if it is of an enum, in lower case and in the singular.
        description: its meaning, for people.
    """

    name: str
    declared: Declared
    default: Any = None
    phrases: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    description: str = ""

    @property
    def note(self) -> str:
        """Its description in brackets, to follow its range in a message; empty if it has none."""
        return f" ({self.description})" if self.description else ""

    @property
    def full_name(self) -> str:
        """Name outside its module, as in `fetch_object.object`."""
        return self.declared.name

    @property
    def values(self) -> tuple[str, ...]:
        """Members that it may have, if it is of an enum."""
        type_ = self.declared.variable.type
        return type_.members if isinstance(type_, EnumType) else ()


class _Module(Protocol):
    """The part of a module that this file reads."""

    @property
    def perceivers(self) -> Mapping[str, Perceiver]:
        """Perceivers by id."""

    @property
    def definitions(self) -> Mapping[str, Definition]:
        """Conditions of its predicates that have one, by full name."""

    @property
    def task_parameters(self) -> Mapping[str, TaskParameter]:
        """Parameters of all its tasks, by full name."""


def arguments_in_force(modules: Iterable[_Module], stated: Mapping[str, Any]) -> dict[str, Any]:
    """Add the defaults of all tasks to what an instruction states.

    Args:
        modules: all modules.
        stated: values (SI) of some parameters, by full name.

    Returns:
        Value of each parameter that has one, by full name.
    """
    parameters = {name: one for module in modules for name, one in module.task_parameters.items()}
    defaults = {name: one.default for name, one in parameters.items() if one.default is not None}
    return {**defaults, **stated}


def parameters_behind_variables(modules: Iterable[_Module]) -> dict[str, frozenset[str]]:
    """Collect the parameters on which the values of variables depend.

    A perceiver that reads a parameter, or a variable that depends on one, makes all that it provides depend
    on it; so does a definition.

    Args:
        modules: all modules.

    Returns:
        Full names of parameters, by the full name of each variable that depends on any; a parameter depends
        on itself.
    """
    listed = list(modules)
    found = {name: frozenset({name}) for one in listed for name in one.task_parameters}
    if not found:
        return {}
    reads = [(one.readings, one.provides) for module in listed for one in module.perceivers.values()]
    reads += [
        (tuple(t.variables_of(one.term)), (name,))
        for module in listed
        for name, one in module.definitions.items()
    ]
    is_new = True
    while is_new:
        is_new = False
        for readings, provided in reads:
            behind = frozenset[str]().union(*(found.get(name, frozenset()) for name in readings))
            for name in provided:
                known = found.get(name, frozenset())
                if not behind <= known:
                    found[name], is_new = known | behind, True
    return found


@dataclass(frozen=True)
class ObjectKind:
    """One kind of object.

    Attributes:
        phrases: phrases for it, in lower case and in the singular.
        shape: shape as it stands; empty if the site does not say.
        size: for a `box` its size along x, y and z, for a `cylinder` its radius and height, m.
        colour: red, green and blue, from 0 to 1; None if the site does not say.
    """

    phrases: tuple[str, ...]
    shape: Literal["box", "cylinder", ""] = ""
    size: tuple[float, ...] = ()
    colour: tuple[float, float, float] | None = None

    def for_perceivers(self) -> dict[str, Any]:
        """Encode it for the code of perceivers.

        Returns:
            Plain values: `shape`, `size` and `colour`.
        """
        return {"shape": self.shape, "size": self.size, "colour": self.colour}
