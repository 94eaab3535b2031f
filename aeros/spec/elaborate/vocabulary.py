"""Elaboration of a site's vocabulary: enums, constants, volumes, state variables and action kinds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Final

from aeros.spec.declared import site as declared
from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean
from aeros.spec.elaborate.expressions import (
    elaborate_expression,
    elaborate_number,
    elaborate_quantity,
    elaborate_unit,
)
from aeros.spec.elaborate.names import check_name_is_free
from aeros.spec.elaborate.quantities import elaborate_state, elaborate_variable
from aeros.spec.elaborate.scopes import constant_scope, state_scope
from aeros.spec.elaborate.tools import elaborate_tool
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import AxisAlignedBox
from aeros.spec.expr.types import EnumType, FamilyType, RealType
from aeros.spec.expr.units import LENGTH
from aeros.spec.model.perception import Definition
from aeros.spec.model.rules import SIMULATED_ACTIONS, ActionKind, Risk, parameter_differences
from aeros.spec.model.task_parameters import OBJECTS
from aeros.spec.model.variables import Declared
from aeros.spec.text.fields import ExpressionField, TextField, undotted_names

_STILL: Final = frozenset({"stop", "wait", "look"})
"""Simulated actions that move nothing."""


@dataclass(frozen=True)
class SiteVocabulary:
    """Named things of a site, to which its rules and its policy refer.

    Attributes:
        enums: enumerations by name.
        constants: constants as terms, SI, by name.
        volumes: boxes in W, m, by name.
        state: state variables by name.
        definitions: conditions on the state that have a name.
        kinds: action kinds by name.
        used_names: meaning of each name in use, such as `a state variable`, by name.
    """

    enums: dict[str, EnumType] = field(default_factory=dict)
    constants: dict[str, t.Term] = field(default_factory=dict)
    volumes: dict[str, AxisAlignedBox] = field(default_factory=dict)
    state: dict[str, Declared] = field(default_factory=dict)
    definitions: dict[str, Definition] = field(default_factory=dict)
    kinds: dict[str, ActionKind] = field(default_factory=dict)
    used_names: dict[str, str] = field(default_factory=dict)


def elaborate_vocabulary(site: declared.Site, diagnostics: Diagnostics) -> SiteVocabulary:
    """Elaborate the vocabulary of a site.

    Args:
        site: the declared site.
        diagnostics: receives the faults.

    Returns:
        The vocabulary, without the declarations that have a fault.
    """
    elaborator = _VocabularyElaborator(diagnostics)
    for name, members in site.enums:
        elaborator.add_enum(name, members)
    if site.objects.items:
        (first, _), *_ = site.objects.items
        name = TextField(OBJECTS, first.span, first.node)
        elaborator.add_enum(name, tuple(one for one, _ in site.objects))
    for name, constant in site.constants:
        elaborator.add_constant(name, constant)
    for name, volume in site.volumes:
        elaborator.add_volume(name, volume)
    for name, variable in site.state:
        elaborator.add_state_variable(name, variable)
    for name, _ in site.definitions:  # before the actions: no parameter may have the name
        elaborator.claim_definition(name)
    for name, kind in site.actions:
        elaborator.add_kind(name, kind)
    return elaborator.vocabulary


def elaborate_site_definitions(
    site: declared.Site, vocabulary: SiteVocabulary, shared: Mapping[str, Declared], diagnostics: Diagnostics
) -> None:
    """Elaborate the conditions that a site gives names; each may use the names above it.

    Args:
        site: the declared site.
        vocabulary: its vocabulary, without faults; receives the conditions.
        shared: variables of modules that the site shares, by full name.
        diagnostics: receives the faults.
    """
    readable = replace(vocabulary, state={**vocabulary.state, **shared})
    names = [name.value for name, _ in site.definitions]
    for number, (name, condition) in enumerate(site.definitions):
        words = undotted_names(condition.value)
        if name.value in words:
            headline = f"`{name.value}` is defined by itself"
            diagnostics.error("AE202", headline, condition.span, help=("leave it out",))
            continue
        if below := [one for one in names[number + 1 :] if one in words]:
            headline = f"`{name.value}` uses `{below[0]}`, which is not defined above it"
            help_ = "a definition may use those above it"
            diagnostics.error("AE202", headline, condition.span, help=(help_,))
            continue
        if any(one in words for one in names[:number] if one not in vocabulary.definitions):
            continue  # its own faults show when that definition is right
        term = elaborate_expression(condition, state_scope(readable), diagnostics)
        if term is not None and not t.variables_of(term):
            headline = f"`{name.value}` reads no state variable, so it never changes"
            diagnostics.error("AE112", headline, condition.span, help=("remove it",))
        elif term is not None:
            vocabulary.definitions[name.value] = Definition(term, condition.value, name.span)


def check_protective_stop(site: declared.Site, vocabulary: SiteVocabulary, diagnostics: Diagnostics) -> None:
    """Check that a site has exactly one protective stop, of low risk and without parameters.

    Args:
        site: the declared site.
        vocabulary: its vocabulary.
        diagnostics: receives the faults.
    """
    stops = [kind for kind in vocabulary.kinds.values() if kind.protective]
    if len(stops) != 1:
        diagnostics.error(
            "AE607",
            f"a site has exactly one protective stop; {len(stops)} action kinds are `protective: true`",
            stops[1].span if stops else site.span,
            help=("declare an action kind `stop` without parameters and with `protective: true`",),
        )
    for stop in stops:
        if stop.risk is not Risk.LOW:
            diagnostics.error(
                "AE607", "the protective stop must have low risk, so that no ceiling denies it", stop.span
            )
        if stop.parameters:
            diagnostics.error("AE607", "the protective stop must not have parameters", stop.span)


class _VocabularyElaborator:
    """Collector of a vocabulary, in the order in which declarations may refer to each other."""

    def __init__(self, diagnostics: Diagnostics) -> None:
        self._diagnostics = diagnostics
        self.vocabulary = SiteVocabulary()

    def add_enum(self, name: TextField, members: tuple[TextField, ...]) -> None:
        if not self._claim(name, "enum", "an enum"):
            return
        for member in members:
            self._claim(member, "member", f"a member of `{name.value}`")
        if not members:
            self._diagnostics.error("AE112", f"the enum `{name.value}` has no member", name.span)
        self.vocabulary.enums[name.value] = EnumType(name.value, tuple(member.value for member in members))

    def add_constant(self, name: TextField, constant: declared.Constant) -> None:
        if not self._claim(name, "constant", "a constant"):
            return
        if (constant.value is None) == (constant.values is None):
            self._diagnostics.error(
                "AE102", "a constant has either `value` or `index`, `unit` and `values`", constant.span
            )
        elif constant.value is not None:
            self._add_number(name, constant.value)
        else:
            self._add_table(name, constant)

    def _add_number(self, name: TextField, value: ExpressionField) -> None:
        number = elaborate_number(value, constant_scope(self.vocabulary), self._diagnostics)
        if number is not None:
            self.vocabulary.constants[name.value] = number

    def _add_table(self, name: TextField, constant: declared.Constant) -> None:
        unit = elaborate_unit(constant.unit, self._diagnostics)
        index = None if constant.index is None else self.vocabulary.enums.get(constant.index.value)
        if index is None:
            span = constant.span if constant.index is None else constant.index.span
            self._diagnostics.error("AE122", "`values` need an `index` that is a declared enum", span)
            return
        values = constant.values or ()
        if len(values) != len(index.members):
            self._diagnostics.error(
                "AE112",
                f"{index.name} has {len(index.members)} members, but {len(values)} values are given",
                constant.span,
            )
        elif unit is not None:
            numbers = tuple(unit.to_si(number.value) for number in values)
            self.vocabulary.constants[name.value] = t.ConstantTable(
                name.value, FamilyType(index, RealType(unit.dimension)), numbers
            )

    def add_volume(self, name: TextField, volume: declared.Volume) -> None:
        if not self._claim(name, "volume", "a volume"):
            return
        lower, upper = (self._corner(corner, volume) for corner in (volume.lower, volume.upper))
        if lower is None or upper is None:
            return
        if any(low >= high for low, high in zip(lower, upper, strict=True)):
            self._diagnostics.error(
                "AE208",
                f"the volume `{name.value}` is empty",
                volume.span,
                help=("each coordinate of `lower` must be below that of `upper`",),
            )
            return
        self.vocabulary.volumes[name.value] = AxisAlignedBox(lower, upper)

    def _corner(
        self, corner: tuple[TextField, ...], volume: declared.Volume
    ) -> tuple[Fraction, Fraction, Fraction] | None:
        if len(corner) != 3:
            self._diagnostics.error(
                "AE112", f"a corner has three coordinates, not {len(corner)}", volume.span
            )
            return None
        x, y, z = (elaborate_quantity(coordinate, LENGTH, self._diagnostics) for coordinate in corner)
        return None if x is None or y is None or z is None else (x, y, z)

    def add_state_variable(self, name: TextField, variable: declared.StateVariable) -> None:
        elaborated = elaborate_state(name.value, variable, self.vocabulary.enums, self._diagnostics)
        is_free = check_name_is_free(name, self.vocabulary.used_names, "state variable", self._diagnostics)
        if is_free and elaborated is not None:
            self.vocabulary.used_names[name.value] = "a state variable"
            self.vocabulary.state[name.value] = elaborated

    def claim_definition(self, name: TextField) -> None:
        self._claim(name, "definition", "a definition")

    def add_kind(self, name: TextField, kind: declared.ActionKind) -> None:
        parameters: dict[str, Declared] = {}
        for parameter, quantity in kind.parameters:
            # Several kinds may have a parameter of one name, so the name is not taken.
            if not check_name_is_free(parameter, self.vocabulary.used_names, "parameter", self._diagnostics):
                continue
            elaborated = elaborate_variable(
                parameter.value,
                quantity,
                t.VariableRole.PARAMETER,
                self.vocabulary.enums,
                self._diagnostics,
            )
            if elaborated is not None:
                parameters[parameter.value] = elaborated
        elaborated_kind = ActionKind(
            name.value,
            frozenset(actuator.value for actuator in kind.actuators),
            Risk[kind.risk.value.upper()],
            kind.protective is not None and kind.protective.value,
            parameters,
            name.span,
            elaborate_tool(name, kind, self.vocabulary.state, self._diagnostics),
            None if kind.means is None else kind.means.value,
        )
        self.vocabulary.kinds[name.value] = elaborated_kind
        if kind.means is not None and len(parameters) == len(kind.parameters):
            self._check_meaning(elaborated_kind, kind.means, is_tool=kind.tool is not None)

    def _check_meaning(self, kind: ActionKind, means: TextField, *, is_tool: bool) -> None:
        """Check that an action kind is the simulated one that it is said to mean, parameters included."""
        if means.value not in SIMULATED_ACTIONS:
            near = did_you_mean(means.value, SIMULATED_ACTIONS)
            known = ", ".join(f"`{word}`" for word in SIMULATED_ACTIONS)
            self._diagnostics.error(
                "AE122",
                f"`{means.value}` is not an action of the simulators",
                means.span,
                help=(f"did you mean `{near}`?" if near else f"they know {known}",),
            )
            return
        differences = parameter_differences(kind, means.value)
        if means.value not in _STILL and not kind.actuators:
            differences.append("it moves the robot, and no actuator is named")
        if is_tool:
            differences.append("a tool carries it out, and not the robot")
        if differences:
            self._diagnostics.error(
                "AE138",
                f"`{kind.name}` cannot mean `{means.value}`: {'; '.join(differences)}",
                means.span,
                help=(f"declare the parameters of `{means.value}` and the actuators, or delete `means`",),
            )

    def _claim(self, name: TextField, what: str, meaning: str) -> bool:
        """Take a name, if it is free, and say if it was."""
        is_free = check_name_is_free(name, self.vocabulary.used_names, what, self._diagnostics)
        if is_free:
            self.vocabulary.used_names[name.value] = meaning
        return is_free
