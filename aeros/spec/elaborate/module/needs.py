"""Elaboration of a module's needs and parameters: what each is bound to, and the site as the module sees it.

A need is bound to what the operator says, or else the site file; or else to the thing of the same name, if it
suits; or else to the only thing that suits.  Otherwise it is open, and the module cannot be proved.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any, Literal

from aeros.spec.declared import configuration as declared
from aeros.spec.declared import ecm as declared_ecm
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics, SpanLabel, did_you_mean
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.elaborate.expressions import expression_of_argument
from aeros.spec.elaborate.module.settings import Setting
from aeros.spec.elaborate.module.suitable_things import suitable_things, things_of_sort, wanted_thing
from aeros.spec.elaborate.names import check_name_is_free, meanings_of_names
from aeros.spec.elaborate.quantities import elaborate_variable
from aeros.spec.elaborate.values import elaborate_value
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term
from aeros.spec.expr.types import (
    IntegerType,
    RealType,
)
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.configured import CAMERAS, BoundNames, ModuleConfiguration
from aeros.spec.model.site import Site
from aeros.spec.text.fields import ExpressionField, TextField
from aeros.spec.text.nodes import ScalarNode


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
        self._settings: dict[str, Setting] = {}
        self.site = site
        configuration = site.configurations.get(self._module, ModuleConfiguration())
        self._of_operator = site.operator_configurations.get(self._module, ModuleConfiguration())
        self._check_settings(configuration)
        bound: dict[str, str] = {}
        # A camera's choices depend on the volume that it must see, which may be declared after it.
        for name, need in sorted(ecm.needs, key=lambda one: one[1].sees is not None):
            bound[name.value] = self._bind(name, need, configuration, bound)
        bindings = {name.value: bound[name.value] for name, _ in ecm.needs if bound[name.value]}
        values: dict[str, t.Term] = {}
        texts: dict[str, str] = {}
        meanings = meanings_of_names(site) | {name.value: "a need of this module" for name, _ in ecm.needs}
        for name, parameter in ecm.parameters:
            if check_name_is_free(name, meanings, "parameter", diagnostics):
                meanings[name.value] = "a parameter of this module"
                texts[name.value], term = self._value(name, parameter, configuration)
                values |= {} if term is None else {name.value: term}
        named = (name.value for name, _ in (*ecm.needs, *ecm.parameters))
        self.settings = tuple(self._settings[name] for name in named if name in self._settings)
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
                    at = self._place_in_site("bind" if what == "need" else "set", name)
                    self._diagnostics.error("AE122", headline, at or self._ecm.id.span, help=(help_,))

    def _place_in_site(self, kind: Literal["bind", "set"], name: str) -> SourceSpan | None:
        """Return the place of a value in the site file or overlay; None if the operator gave it."""
        of_operator = self._of_operator.bindings if kind == "bind" else self._of_operator.parameters
        place = self._given.policy_spans.get(f"modules/{self._module}/{kind}/{name}")
        return None if name in of_operator else place

    def _written_value(self, name: str, text: str) -> ExpressionField:
        """Return the value of a parameter as an expression, at its place in a file or as an option."""
        place = self._place_in_site("set", name)
        if place is None:
            return expression_of_argument(f"--set {name}", text)
        if place.text != text:  # in quotes
            return expression_of_argument(f"{place.source.path}:{place.line}", text)
        return ExpressionField(text, place, ScalarNode(text, place))

    def _bind(
        self,
        name: TextField,
        need: declared.Need,
        configuration: ModuleConfiguration,
        bound: Mapping[str, str],
    ) -> str:
        """Return the site's name for a need; nothing if it is open or the choice does not suit."""
        same_sort = things_of_sort(self._given, need.is_.value)
        meanings = {one: what for one, what in meanings_of_names(self._given).items() if one not in same_sort}
        if not check_name_is_free(name, meanings, "need", self._diagnostics):
            return ""
        if need.sees is not None and need.sees.value not in {*bound, *self._given.volumes}:
            near = did_you_mean(need.sees.value, [*bound, *self._given.volumes])
            headline = f"`{need.sees.value}` is neither a need of this module nor a volume of the site"
            cures = (f"did you mean `{near}`?",) if near else ()
            self._diagnostics.error("AE122", headline, need.sees.span, help=cures)
            return ""
        # Any volume will do while the need for it is not bound: its own report says so.
        seen = "" if need.sees is None else bound.get(need.sees.value, need.sees.value)
        choices = suitable_things(self._given, need, seen, self._diagnostics)
        if choices is None:
            return ""
        chosen = configuration.bindings.get(name.value, "")
        source = "set" if name.value in self._of_operator.bindings else "site file"
        if not chosen:
            same, only = name.value in choices, len(choices) == 1
            chosen = name.value if same else choices[0] if only else ""
            source = "same name" if same else "only choice" if only else ""
        self._settings[name.value] = Setting(
            name.value,
            chosen,
            tuple(choices),
            False,
            source,
            need.description.value if need.description else wanted_thing(need),
        )
        if chosen in choices:
            return chosen
        is_undecided = need.sees is not None and not seen and bool(choices)
        if chosen or not is_undecided:
            self._report_open(name, need, chosen, choices)
        return ""

    def _report_open(self, name: TextField, need: declared.Need, chosen: str, choices: list[str]) -> None:
        """Report a need that is bound to something that does not suit, or to nothing."""
        wanted = wanted_thing(need)
        listed = ", ".join(f"`{one}`" for one in choices)
        if chosen:
            headline = f"`{self._module}` needs `{name.value}`, {wanted}, and `{chosen}` is not one"
            help_ = f"these suit: {listed}" if choices else "nothing at this site suits"
        elif choices:
            headline = f"`{self._module}` needs `{name.value}`, {wanted}, and several suit: {listed}"
            help_ = _choose_help(self._module, "bind", f"{name.value}={choices[0]}")
        else:
            headline = f"`{self._module}` needs `{name.value}`, {wanted}, and this site has none"
            help_ = "declare it at the site" + (
                f", with `offers: [{need.offers.value}]`" if need.offers else ""
            )
            if need.is_.value == "tool":
                help_ += ", or as the operator in an overlay on it (docs/tools.md)"
        at = self._place_in_site("bind", name.value) if chosen else None
        if at is None:
            self._diagnostics.error("AE136", headline, name.span, "needed here", help=(help_,))
        else:
            needed = (SpanLabel(name.span, "needed here"),)
            self._diagnostics.report(Diagnostic("AE136", headline, SpanLabel(at), needed, help=(help_,)))

    def _value(
        self, name: TextField, parameter: declared.Parameter, configuration: ModuleConfiguration
    ) -> tuple[str, t.Term | None]:
        """Elaborate the value of a parameter; return its text and its term, None after a report."""
        quantity = elaborate_variable(
            name.value, parameter, t.VariableRole.PARAMETER, self._given.enums, self._diagnostics
        )
        text = configuration.parameters.get(name.value)
        written = parameter.default if text is None else self._written_value(name.value, text)
        given = "set" if name.value in self._of_operator.parameters else "site file"
        source = "default" if text is None else given
        self._settings[name.value] = Setting(
            name.value,
            "" if written is None else written.value,
            (),
            True,
            source,
            parameter.description.value if parameter.description else "",
            _range_text(parameter),
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
    unit = None if parameter.unit is None else parameter.unit.value
    return f"{low} to {high}" + ("" if unit in (None, "1") else f" {unit}")


def module_settings(ecm: declared_ecm.Ecm, site: Site) -> tuple[Setting, ...]:
    """List the needs and parameters of a module, with what each is bound or set to.

    Args:
        ecm: the declared module.
        site: the site, with the settings of its modules.

    Returns:
        The settings in the order of the manifest.
    """
    if not ecm.needs.items and not ecm.parameters.items:
        return ()
    return _settings_at(_SameModule(ecm), site)


class _SameModule:
    """A declared module that equals only itself: to compare all that it declares would take longer."""

    def __init__(self, ecm: declared_ecm.Ecm) -> None:
        self.ecm = ecm

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _SameModule) and other.ecm is self.ecm

    def __hash__(self) -> int:
        return id(self.ecm)


@lru_cache(maxsize=512)
def _settings_at(module: _SameModule, site: Site) -> tuple[Setting, ...]:
    return ModuleNeeds(module.ecm, site, Diagnostics()).settings
