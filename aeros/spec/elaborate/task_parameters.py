"""Elaboration of the parameters of tasks, each to a state variable of its module, and of a site's objects.

Tasks of one module may share a parameter, if they declare it alike.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any, Final, Literal

from aeros.spec.declared import ecm as declared_ecm
from aeros.spec.declared import objects as declared_objects
from aeros.spec.declared import site as declared_site
from aeros.spec.declared import task_parameters as declared
from aeros.spec.declared.quantity import Quantity
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.words import MAX_PHRASES, expanded, normalized_words
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.elaborate.names import check_name_is_free
from aeros.spec.elaborate.quantities import elaborate_variable
from aeros.spec.elaborate.values import elaborate_value
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import EnumType, FamilyType, VectorType
from aeros.spec.expr.units import LENGTH
from aeros.spec.model.site import Site
from aeros.spec.model.task_parameters import OBJECTS, ObjectKind, TaskParameter, instruction_of
from aeros.spec.model.variables import Declared
from aeros.spec.text.fields import TextField

_MAX_AGE: Final = Fraction(1)
"""Greatest age of its value, s: the runtime states it anew with every observation."""


class TaskParameters:
    """Parameters of the tasks of one module.

    Args:
        ecm: the declared module.
        site: site under which it is elaborated.
        used: meaning of each name in use, by name; receives the parameters.
        diagnostics: receives the faults.

    Attributes:
        by_task: parameters of each task by name, by the task's name.
        variables: the variable of each parameter, by short name.
        enums: enums that parameters declare by their values, by full name.
    """

    def __init__(
        self, ecm: declared_ecm.Ecm, site: Site, used: dict[str, str], diagnostics: Diagnostics
    ) -> None:
        self._module, self._site, self._used, self._diagnostics = ecm.id.value, site, used, diagnostics
        self.by_task: dict[str, dict[str, TaskParameter]] = {}
        self.variables: dict[str, Declared] = {}
        self.enums: dict[str, EnumType] = {}
        self._known: dict[str, TaskParameter] = {}
        for task_name, task in ecm.tasks:
            found = (self._parameter(name, one) for name, one in task.parameters)
            self.by_task[task_name.value] = {one.name: one for one in found if one is not None}

    def _parameter(self, name: TextField, one: declared.TaskParameter) -> TaskParameter | None:
        known = self._known.get(name.value)
        if known is None and not check_name_is_free(name, self._used, "parameter", self._diagnostics):
            return None
        full = f"{self._module}.{name.value}"
        variable = self._by_values(full, name, one) if one.values.items else self._by_type(full, name, one)
        if variable is None:
            return None
        variable = replace(variable, span=name.span, sensor=instruction_of(self._module), max_age=_MAX_AGE)
        description = "" if one.description is None else one.description.value
        parameter = TaskParameter(
            name.value, variable, self._default(one, variable), self._phrases(one), description
        )
        if known is None:
            self._used[name.value] = "a parameter of a task of this module"
            self._known[name.value], self.variables[name.value] = parameter, variable
            return parameter
        if not _is_alike(known, parameter):
            self._diagnostics.error(
                "AE120",
                f"`{name.value}` is declared otherwise by another task of this module",
                name.span,
                help=("declare it alike, or choose another name",),
            )
        return replace(parameter, declared=known.declared)

    def _by_values(self, full: str, name: TextField, one: declared.TaskParameter) -> Declared | None:
        for text, word in ((one.type, "type"), (one.unit, "unit")):
            if text is not None:
                self._diagnostics.error("AE102", f"a parameter with `values` has no `{word}`", text.span)
                return None
        if one.range is not None:
            self._diagnostics.error("AE102", "a parameter with `values` has no `range`", name.span)
            return None
        type_ = EnumType(full, tuple(value.value for value, _ in one.values))
        if name.value not in self._known:
            for value, _ in one.values:
                # Two parameters may have a member of one name, such as `left`.
                if not any(value.value in enum.members for enum in self.enums.values()):
                    check_name_is_free(value, self._used, "value", self._diagnostics)
            self.enums[full] = type_
        return Declared(t.Variable(full, type_, t.VariableRole.STATE), name.span)

    def _by_type(self, full: str, name: TextField, one: declared.TaskParameter) -> Declared | None:
        if one.type is None:
            self._diagnostics.error(
                "AE102",
                f"`{name.value}` has neither `type` nor `values`",
                name.span,
                help=("as in `type: objects`, or `values: {left: {words: [left half]}}`",),
            )
            return None
        if one.type.value == OBJECTS and OBJECTS not in self._site.enums:
            self._diagnostics.error(
                "AE122",
                f"`{name.value}` is one of the objects of the site, and this site declares none",
                one.type.span,
                help=("list them in the site file, as in `objects: {red_can: {words: [can]}}`",),
            )
            return None
        quantity = Quantity(one.span, one.type, one.unit, one.range, one.description)
        variable = elaborate_variable(
            full, quantity, t.VariableRole.STATE, self._site.enums, self._diagnostics
        )
        if variable is not None and isinstance(variable.variable.type, FamilyType | VectorType):
            headline = "a parameter of a task is a truth, a number, or a member of an enum"
            self._diagnostics.error("AE208", headline, one.type.span)
            return None
        return variable

    def _default(self, one: declared.TaskParameter, variable: Declared) -> Any:
        if one.default is None:
            return None
        site = replace(self._site, enums={**self._site.enums, **self.enums})
        return elaborate_value(one.default, variable, site, self._diagnostics)

    def _phrases(self, one: declared.TaskParameter) -> Mapping[str, tuple[str, ...]]:
        if one.values.items:
            return {name.value: phrases_of(value.words, self._diagnostics) for name, value in one.values}
        if one.type is not None and one.type.value == OBJECTS:
            return {name: kind.phrases for name, kind in self._site.objects.items()}
        enum = None if one.type is None else self._site.enums.get(one.type.value)
        return {} if enum is None else {member: (member.replace("_", " "),) for member in enum.members}


def _is_alike(one: TaskParameter, other: TaskParameter) -> bool:
    return (
        one.declared.variable == other.declared.variable
        and one.declared.range == other.declared.range
        and (one.default, one.phrases) == (other.default, other.phrases)
    )


def elaborate_objects(site: declared_site.Site, diagnostics: Diagnostics) -> dict[str, ObjectKind]:
    """Elaborate the objects of a site.

    Args:
        site: the declared site.
        diagnostics: receives the faults.

    Returns:
        The objects by name.
    """
    return {name.value: _object_kind(name, one, diagnostics) for name, one in site.objects}


def phrases_of(words: Sequence[TextField], diagnostics: Diagnostics) -> tuple[str, ...]:
    """Elaborate phrases to all that their patterns stand for.

    Args:
        words: the declared phrases.
        diagnostics: receives the faults.

    Returns:
        The phrases in lower case, without brackets.
    """
    patterns = patterns_of(words, diagnostics)
    return tuple(dict.fromkeys(phrase for one in patterns for phrase in expanded(one)))


def patterns_of(words: Sequence[TextField], diagnostics: Diagnostics) -> tuple[str, ...]:
    """Elaborate phrases; each must have a letter or digit whatever is left out, or nobody could say it.

    Args:
        words: the declared phrases, with optional words and alternatives in brackets.
        diagnostics: receives the faults.

    Returns:
        The phrases in lower case, with their brackets.
    """
    for phrase in words:
        phrases = expanded(phrase.value)
        if not phrases:
            help_ = (f"write at most {MAX_PHRASES} phrases in one, as in `into (two) (trays|boxes)`",)
            headline = f"the brackets of `{phrase.value}` are not closed, nested, empty or stand for too many"
            diagnostics.error("AE112", headline, phrase.span, help=help_)
        elif not all(map(normalized_words, phrases)):
            are_all = not any(map(normalized_words, phrases))
            headline = f"`{phrase.value}` {'has' if are_all else 'may have'} no word"
            diagnostics.error("AE112", headline, phrase.span)
    return tuple(phrase.value.casefold() for phrase in words)


def _object_kind(name: TextField, kind: declared_objects.ObjectKind, diagnostics: Diagnostics) -> ObjectKind:
    if not kind.words:
        diagnostics.error("AE112", f"no word asks for `{name.value}`", name.span)
    if kind.box is not None and kind.cylinder is not None:
        diagnostics.error("AE102", f"`{name.value}` has either `box` or `cylinder`", name.span)
    shapes: Mapping[Literal["box", "cylinder"], tuple[tuple[TextField, ...] | None, int]] = {
        "box": (kind.box, 3),
        "cylinder": (kind.cylinder, 2),
    }
    shape: Literal["box", "cylinder", ""] = ""
    size: tuple[float, ...] = ()
    for word, (lengths, count) in shapes.items():
        if lengths is None:
            continue
        if len(lengths) != count:
            headline = f"a {word} has {count} lengths, not {len(lengths)}"
            diagnostics.error("AE112", headline, name.span)
        found = [elaborate_quantity(one, LENGTH, diagnostics) for one in lengths]
        for length, text in zip(found, lengths, strict=True):
            if length is not None and not 0 < length <= 2:
                diagnostics.error("AE111", "a length is above 0 m and at most 2 m", text.span)
        shape, size = word, tuple(float(one) for one in found if one is not None)
    return ObjectKind(phrases_of(kind.words, diagnostics), shape, size, _colour(kind, diagnostics))


def _colour(kind: declared_objects.ObjectKind, diagnostics: Diagnostics) -> tuple[float, float, float] | None:
    if kind.colour is None:
        return None
    parts = [float(one.value) for one in kind.colour]
    if len(parts) != 3 or not all(0 <= one <= 1 for one in parts):
        span = kind.colour[0].span if kind.colour else kind.span
        diagnostics.error("AE111", "a colour is red, green and blue, each from 0 to 1", span)
        return None
    return (parts[0], parts[1], parts[2])
