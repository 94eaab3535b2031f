"""Elaboration of a module's needs and parameters: what each is bound to, and the site as the module sees it.

A need is bound to what the operator says, or else the site file; or else to the thing of the same name, if it
suits; or else to the only thing that suits.  Otherwise it is open, and the module cannot be proved.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from aeros.spec.declared import configuration as declared
from aeros.spec.declared import ecm as declared_ecm
from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean
from aeros.spec.elaborate.expressions import expression_of_argument
from aeros.spec.elaborate.module.suitable_things import suitable_things, things_of_sort, wanted_thing
from aeros.spec.elaborate.names import check_name_is_free, meanings_of_names
from aeros.spec.elaborate.quantities import elaborate_variable
from aeros.spec.elaborate.values import elaborate_value
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import (
    IntegerType,
    RealType,
)
from aeros.spec.expr.units import NUMBER
from aeros.spec.flow.arguments import constant_term
from aeros.spec.model.configured import CAMERAS, BoundNames, ModuleConfiguration
from aeros.spec.model.site import Site
from aeros.spec.text.fields import TextField


@dataclass(frozen=True)
class Setting:
    """One need or parameter of a module, with what it is bound or set to.

    Attributes:
        name: the module's name for it.
        value: name of a thing of the site, or value of a parameter; empty if it is open.
        choices: names of the things of the site that suit; empty for a parameter.
        is_parameter: True for a parameter.
        source: the reason for the value: `set`, `same name`, `only choice` or `default`.
        description: its meaning, in the words of the manifest; empty if a parameter has none.
        allowed: the values that a parameter may have; empty for a need.
    """

    name: str
    value: str
    choices: tuple[str, ...]
    is_parameter: bool
    source: str
    description: str
    allowed: str = ""

    @property
    def is_open(self) -> bool:
        """True if the operator must set it before the module can be proved."""
        return not self.value


class ModuleNeeds:
    """Needs and parameters of one module at a site.

    Args:
        ecm: the declared module.
        site: the site, with the settings of its modules.
        diagnostics: receives the faults, among them everything that is open.

    Attributes:
        settings: every need and parameter.
        names: the site's names for the needs, and the values of the parameters.
        site: the site, with the needs and parameters under the names that the module uses.
    """

    def __init__(self, ecm: declared_ecm.Ecm, site: Site, diagnostics: Diagnostics) -> None:
        self._ecm, self._given, self._diagnostics = ecm, site, diagnostics
        self._module = ecm.id.value
        self._settings: list[Setting] = []
        self.site = site
        configuration = site.configurations.get(self._module, ModuleConfiguration())
        self._check_settings(configuration)
        bound = {name.value: self._bind(name, need, configuration) for name, need in ecm.needs}
        bindings = {name: found for name, found in bound.items() if found}
        values: dict[str, t.Term] = {}
        texts: dict[str, str] = {}
        meanings = meanings_of_names(site) | {name.value: "a need of this module" for name, _ in ecm.needs}
        for name, parameter in ecm.parameters:
            if check_name_is_free(name, meanings, "parameter", diagnostics):
                meanings[name.value] = "a parameter of this module"
                texts[name.value], term = self._value(name, parameter, configuration)
                values |= {} if term is None else {name.value: term}
        self.settings = tuple(self._settings)

        self.names = self._bound_names(bindings, texts)
        if bindings or values:
            self.site = self._site_as_seen(bindings, values)

    def _of_sort(self, bindings: Mapping[str, str], *sorts: str) -> dict[str, str]:
        chosen = {name.value for name, need in self._ecm.needs if need.is_.value in sorts}
        return {name: found for name, found in bindings.items() if name in chosen}

    def _bound_names(self, bindings: Mapping[str, str], texts: Mapping[str, str]) -> BoundNames:
        site = self._given
        variables, cameras = (self._of_sort(bindings, sort) for sort in ("variable", "camera"))
        kinds = self._of_sort(bindings, "action", "tool")
        sensors: dict[str, tuple[str, ...]] = {
            name: (one,) for name, one in self._of_sort(bindings, "sensor").items()
        }
        sensors |= {name: (site.state[one].sensor or "",) for name, one in variables.items()}
        sensors |= {name: (site.cameras[one].sensor,) for name, one in cameras.items() if one in site.cameras}
        # What a tool answers is measured by its action.
        sensors |= {name: (one,) for name, one in self._of_sort(bindings, "tool").items()}
        actuators: dict[str, tuple[str, ...]] = {
            name: (one,) for name, one in self._of_sort(bindings, "actuator").items()
        }
        actuators |= {name: tuple(sorted(site.kinds[one].actuators)) for name, one in kinds.items()}
        channels = {name: tuple(sorted(site.kinds[one].channels)) for name, one in kinds.items()}
        resources: dict[str, tuple[str, ...]] = {
            name: (one,) for name, one in self._of_sort(bindings, "resource").items()
        }
        for name, needed in (*actuators.items(), *sensors.items()):
            resources.setdefault(name, tuple(one for one in needed if one in site.resources))
        return BoundNames(bindings, variables, cameras, kinds, sensors, actuators, resources, texts, channels)

    def _site_as_seen(self, bindings: Mapping[str, str], values: Mapping[str, t.Term]) -> Site:
        site, names = self._given, self.names
        members = {name: t.Literal(one, site.enums[CAMERAS]) for name, one in names.cameras.items()}
        constants = {name: site.constants[one] for name, one in self._of_sort(bindings, "constant").items()}
        return replace(
            site,
            constants={**site.constants, **members, **constants, **values},
            volumes=_with_names(site.volumes, self._of_sort(bindings, "volume")),
            state=_with_names(site.state, names.variables),
            kinds=_with_names(site.kinds, names.kinds),
            cameras=_with_names(site.cameras, names.cameras),
        )

    def _check_settings(self, configuration: ModuleConfiguration) -> None:
        """Report settings of a name that the module does not declare."""
        needs = [name.value for name, _ in self._ecm.needs]
        parameters = [name.value for name, _ in self._ecm.parameters]
        for given, known, what in (
            (configuration.bindings, needs, "need"),
            (configuration.parameters, parameters, "parameter"),
        ):
            for name in given:
                if name not in known:
                    near = did_you_mean(name, known)
                    listed = ", ".join(f"`{one}`" for one in known) or "none"
                    help_ = f"did you mean `{near}`?" if near else f"it declares {listed}"
                    headline = f"`{self._module}` has no {what} `{name}`"
                    self._diagnostics.error("AE122", headline, self._ecm.id.span, help=(help_,))

    def _bind(self, name: TextField, need: declared.Need, configuration: ModuleConfiguration) -> str:
        """Return the site's name for a need; nothing if it is open or the choice does not suit."""
        same_sort = things_of_sort(self._given, need.is_.value)
        meanings = {one: what for one, what in meanings_of_names(self._given).items() if one not in same_sort}
        if not check_name_is_free(name, meanings, "need", self._diagnostics):
            return ""
        choices = suitable_things(self._given, need, self._bound_to(need.sees), self._diagnostics)
        if choices is None:
            return ""
        wanted = wanted_thing(need)
        chosen = configuration.bindings.get(name.value, "")
        source = "set"
        if not chosen:
            same, only = name.value in choices, len(choices) == 1
            chosen = name.value if same else choices[0] if only else ""
            source = "same name" if same else "only choice" if only else ""
        self._settings.append(
            Setting(
                name.value,
                chosen,
                tuple(choices),
                False,
                source,
                need.description.value if need.description else wanted,
            )
        )
        if chosen in choices:
            return chosen
        listed = ", ".join(f"`{one}`" for one in choices)
        if chosen:
            headline = f"`{self._module}` needs `{name.value}`, {wanted}, and `{chosen}` is not one"
            help_ = f"these suit: {listed}" if choices else "nothing at this site suits"
        elif choices:
            headline = f"`{self._module}` needs `{name.value}`, {wanted}, and several suit: {listed}"
            help_ = _choose_help(self._module, "bind", f"{name.value}={choices[0]}")
        elif need.sees is not None and self._is_open(need.sees.value):
            headline = f"`{self._module}` needs `{name.value}`, {wanted}, which is not bound"
            help_ = f"bind `{need.sees.value}` first"
        else:
            headline = f"`{self._module}` needs `{name.value}`, {wanted}, and this site has none"
            help_ = "declare it at the site" + (
                f", with `offers: [{need.offers.value}]`" if need.offers else ""
            )
        self._diagnostics.error("AE136", headline, name.span, "needed here", help=(help_,))
        return ""

    def _is_open(self, name: str) -> bool:
        return any(one.name == name and one.is_open for one in self._settings)

    def _bound_to(self, name: TextField | None) -> str:
        """Return the site's name for an earlier need, or the name itself if it is none."""
        if name is None:
            return ""
        return next((one.value for one in self._settings if one.name == name.value), name.value)

    def _value(
        self, name: TextField, parameter: declared.Parameter, configuration: ModuleConfiguration
    ) -> tuple[str, t.Term | None]:
        """Elaborate the value of a parameter; return its text and its term, None after a report."""
        quantity = elaborate_variable(
            name.value, parameter, t.VariableRole.PARAMETER, self._given.enums, self._diagnostics
        )
        text = configuration.parameters.get(name.value)
        written = parameter.default if text is None else expression_of_argument(f"--set {name.value}", text)
        source = "default" if text is None else "set"
        self._settings.append(
            Setting(
                name.value,
                "" if written is None else written.value,
                (),
                True,
                source,
                parameter.description.value if parameter.description else "",
                _range_text(parameter),
            )
        )
        if quantity is None:
            return "", None
        if written is None:
            help_ = _choose_help(self._module, "set", f"{name.value}=…")
            headline = f"the parameter `{name.value}` of `{self._module}` has no value"
            self._diagnostics.error("AE136", headline, name.span, "it has no default", help=(help_,))
            return "", None
        before = len(self._diagnostics)
        value = elaborate_value(written, quantity, self._given, self._diagnostics)
        if value is None or len(self._diagnostics) > before:
            return written.value, None
        type_ = quantity.variable.type
        # Expressions read whole numbers as dimensionless reals.
        return written.value, constant_term(
            value, RealType(NUMBER) if isinstance(type_, IntegerType) else type_
        )


def _with_names(things: Mapping[str, Any], bound: Mapping[str, str]) -> dict[str, Any]:
    """Return things of a site with those that are bound under the module's names, too."""
    return {**things, **{name: things[one] for name, one in bound.items() if one in things}}


def _choose_help(module: str, option: str, setting: str) -> str:
    on_robot = f"on a robot, `aeros configure {module} --{option} {setting}`"
    return f"{on_robot}; otherwise `--{option} {module}.{setting}`"


def _range_text(parameter: declared.Parameter) -> str:
    """Describe the values that a parameter may have."""
    if parameter.range is None or len(parameter.range) != 2:
        return parameter.type.value
    low, high = (one.span.text for one in parameter.range)
    return f"{low} to {high}" + ("" if parameter.unit is None else f" {parameter.unit.value}")


def open_settings(ecm: declared_ecm.Ecm, site: Site) -> tuple[Setting, ...]:
    """List the needs and parameters that the operator has to set before a module can be proved.

    Args:
        ecm: the declared module.
        site: the site, with the settings of its modules.

    Returns:
        Those that are open and have a choice; a need that nothing suits is a fault, and not listed.
    """
    if not ecm.needs.items and not ecm.parameters.items:
        return ()
    settings: Iterable[Setting] = ModuleNeeds(ecm, site, Diagnostics()).settings
    return tuple(one for one in settings if one.is_open and (one.choices or one.is_parameter))
