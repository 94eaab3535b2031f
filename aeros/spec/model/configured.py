"""Configuration of modules: the settings that sites and operators give, and the names that follow."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from aeros.spec.model.variables import Declared


@dataclass(frozen=True)
class ModuleConfiguration:
    """Settings of one module, as text.

    Attributes:
        bindings: the site's name for what the module needs, by the module's name for it.
        parameters: values of its parameters, as an expression, by name.
    """

    bindings: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, str] = field(default_factory=dict)

    def __bool__(self) -> bool:
        """Return True if anything is set."""
        return bool(self.bindings or self.parameters)

    def updated(self, other: ModuleConfiguration) -> ModuleConfiguration:
        """Return these settings, with those of another in their place where it has any.

        Args:
            other: settings that come first.

        Returns:
            Both together.
        """
        return ModuleConfiguration(
            {**self.bindings, **other.bindings}, {**self.parameters, **other.parameters}
        )

    def to_json(self) -> dict[str, Any]:
        """Write the settings as plain data.

        Returns:
            Data for `json.dumps`; empty if nothing is set.
        """
        parts = {"bind": dict(sorted(self.bindings.items())), "set": dict(sorted(self.parameters.items()))}
        return {name: part for name, part in parts.items() if part}

    @classmethod
    def from_json(cls, data: Any) -> ModuleConfiguration:
        """Read settings that `to_json` wrote.

        Args:
            data: the plain data.

        Returns:
            The settings.

        Raises:
            ValueError: the data have another form.
        """
        if not isinstance(data, dict) or not data.keys() <= {"bind", "set"}:
            raise ValueError("settings of a module are `bind` and `set`")
        for part in data.values():
            if not isinstance(part, dict) or not all(isinstance(one, str) for one in part.values()):
                raise ValueError("a setting of a module is text")
        return cls(data.get("bind", {}), data.get("set", {}))

    def __str__(self) -> str:
        settings = {**self.bindings, **self.parameters}
        return ", ".join(f"{name}={value}" for name, value in sorted(settings.items()))


UNCONFIGURED: Final = ModuleConfiguration()
"""No setting."""

_NAME: Final = re.compile(r"[a-z][a-z0-9_]*")
_DOTTED: Final = re.compile(r"[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)?")
_MAX_VALUE: Final = 200  # characters; no quantity needs more


def setting_fault(name: str, value: str, *, is_binding: bool) -> str | None:
    """Describe the fault in the form of a setting that an operator or a program gives.

    Args:
        name: name of a need or parameter, with or without its module before it.
        value: the site's name for a need, or the value of a parameter.
        is_binding: True for a need.

    Returns:
        The fault as a sentence; None if there is none.
    """
    if not _DOTTED.fullmatch(name) or not value.strip() or (is_binding and not _NAME.fullmatch(value)):
        example = "surface=bench" if is_binding else "force=6 N"
        return f"`{name}={value}` is not a setting, as in `{example}`"
    if len(value) > _MAX_VALUE or not value.isprintable():
        return f"the value of `{name}` is not one line of at most {_MAX_VALUE} characters"
    return None


def settings_by_module(settings: Mapping[str, str]) -> dict[str, dict[str, str]]:
    """Sort settings by the module before the dot of each name.

    Args:
        settings: values by `MODULE.NAME`.

    Returns:
        Values by name, by module.

    Raises:
        ValueError: a name does not begin with a module; the text shows the setting and the cure.
    """
    found: dict[str, dict[str, str]] = {}
    for full_name, value in settings.items():
        module, dot, name = full_name.partition(".")
        if not dot:
            given = f"{full_name}={value}"
            raise ValueError(f"{given}: begin with the module, as in `clean_pot.{given}`")
        found.setdefault(module, {})[name] = value
    return found


def join_settings(
    bindings: Mapping[str, Mapping[str, str]], parameters: Mapping[str, Mapping[str, str]]
) -> dict[str, ModuleConfiguration]:
    """Join the bindings and the parameters of each module.

    Args:
        bindings: bindings by module.
        parameters: values of parameters by module.

    Returns:
        Settings by module.
    """
    return {
        name: ModuleConfiguration(bindings.get(name, {}), parameters.get(name, {}))
        for name in dict.fromkeys([*bindings, *parameters])
    }


def setting_options(configurations: Mapping[str, ModuleConfiguration]) -> str:
    """Write settings of modules as options of a command, to be pasted into a shell.

    Args:
        configurations: settings by module.

    Returns:
        The options with a blank before each, such as `` --bind polish.surface=bench``; empty if none is set.
    """
    return "".join(
        f" {option} {shlex.quote(f'{module}.{name}={value}')}"
        for module, one in configurations.items()
        for option, settings in (("--bind", one.bindings), ("--set", one.parameters))
        for name, value in settings.items()
    )


@dataclass(frozen=True)
class BoundNames:
    """The site's names for what a module needs, by the module's names for it; and values of its parameters.

    Attributes:
        bindings: the site's name of everything that it needs.
        variables: those that are state variables.
        cameras: those that are cameras.
        kinds: those that are action kinds.
        sensors: sensors by the name of a sensor, of a variable that they measure, or of a camera.
        actuators: actuators by the name of an actuator, or of an action that moves them.
        resources: resources by the name of a resource, or of what occupies them by having their names.
        parameters: value of each parameter, as an expression.
        channels: channels by the name of an action whose tool uses them.
    """

    bindings: Mapping[str, str] = field(default_factory=dict)
    variables: Mapping[str, str] = field(default_factory=dict)
    cameras: Mapping[str, str] = field(default_factory=dict)
    kinds: Mapping[str, str] = field(default_factory=dict)
    sensors: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    actuators: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    resources: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    parameters: Mapping[str, str] = field(default_factory=dict)
    channels: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def site_name(self, name: str) -> str:
        """Return the site's name for something.

        Args:
            name: the module's name for it.

        Returns:
            The name that it is bound to; the same name if the module does not list it as a need.
        """
        return self.bindings.get(name, name)

    def site_values(self, parameters: Mapping[str, Any], declared: Mapping[str, Declared]) -> dict[str, Any]:
        """Replace the module's names of cameras in the parameters of an action.

        Args:
            parameters: values by parameter, as skill code gives them.
            declared: parameters of the action kind by name.

        Returns:
            The parameters with the site's names.
        """
        return {
            name: self.cameras[value]
            if type(value) is str
            and value in self.cameras
            and name in declared
            and str(declared[name].variable.type) == CAMERAS
            else value
            for name, value in parameters.items()
        }


def site_names(names: Iterable[str], bound: Mapping[str, tuple[str, ...]]) -> frozenset[str]:
    """Replace a module's names of sensors, actuators or resources by the site's.

    Args:
        names: names in the manifest.
        bound: the site's names for those that are needs.

    Returns:
        The site's names.
    """
    return frozenset(one for name in names for one in bound.get(name, (name,)))


def module_names(names: Iterable[str], bound: Mapping[str, tuple[str, ...]]) -> tuple[str, ...]:
    """Replace the site's names of sensors, actuators or resources by those that a manifest uses.

    Args:
        names: the site's names.
        bound: the site's names for those that are needs.

    Returns:
        The module's name for each that a need is bound to, and the site's name for any other; each once.
    """
    return tuple(
        dict.fromkeys(next((own for own, things in bound.items() if one in things), one) for one in names)
    )


CAMERAS: Final = "cameras"
"""Enum of a site whose members are its cameras."""
