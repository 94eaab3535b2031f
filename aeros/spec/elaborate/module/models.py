"""Elaboration of a module's models: kinds, interfaces and bounds."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Final

from aeros.models.interface import ModelKind
from aeros.spec.declared import models as declared
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.elaborate.expressions import elaborate_unit
from aeros.spec.elaborate.names import check_name_is_free, resolve_name
from aeros.spec.expr.units import format_quantity
from aeros.spec.model.models import ExactBox, ModelBound, ModelValue, ModuleModel
from aeros.spec.text.fields import MappingField, NumberField, TextField

_EVALUATED: Final = ("onnx", "table")


def elaborate_models(
    models: MappingField[declared.Model], diagnostics: Diagnostics
) -> dict[str, ModuleModel]:
    """Elaborate the models that a manifest declares.

    Args:
        models: declared models by name.
        diagnostics: receives the faults.

    Returns:
        The models by name, without the parts that have a fault.
    """
    return {name.value: _model(name, model, diagnostics) for name, model in models}


def _model(name: TextField, model: declared.Model, diagnostics: Diagnostics) -> ModuleModel:
    kind: ModelKind = model.kind.value
    used: dict[str, str] = {}
    inputs = _values(model.inputs, "an input of this model", used, diagnostics)
    outputs = _values(model.outputs, "an output of this model", used, diagnostics)
    if kind in _EVALUATED:
        if model.file is None:
            diagnostics.error("AE102", f"the field `file` is missing in `{name.value}`", name.span)
        for what, values in (("inputs", model.inputs), ("outputs", model.outputs)):
            if not values:
                diagnostics.error(
                    "AE112",
                    f"`{name.value}` is evaluated, so it needs {what}",
                    name.span,
                    help=(f"declare its `{what}`, each with a `range`",),
                )
    elif model.inputs or model.outputs or model.bounds:
        diagnostics.error(
            "AE112",
            f"`{name.value}` is a file of bytes, which has neither inputs, outputs nor bounds",
            model.kind.span,
            help=("write `kind: onnx` or `kind: table`, or remove them",),
        )
    bounds: dict[str, ModelBound] = {}
    for bound in model.bounds:
        if bound.id.value in bounds:
            diagnostics.error("AE120", f"there are two bounds named `{bound.id.value}`", bound.id.span)
        bounds[bound.id.value] = ModelBound(
            bound.id.value,
            {
                **{value.name: (value.range,) * value.size for value in inputs.values()},
                **_boxes(bound.given, inputs, "an input of this model", diagnostics),
            },
            _boxes(bound.then, outputs, "an output of this model", diagnostics),
            bound.runtime_checked is not None and bound.runtime_checked.value,
            bound.id.span,
        )
    file = "" if model.file is None else model.file.value
    place = name.span if model.file is None else model.file.span
    return ModuleModel(name.value, kind, file, inputs, outputs, tuple(bounds.values()), name.span, place)


def _values(
    entries: MappingField[declared.ModelValue], what: str, used: dict[str, str], diagnostics: Diagnostics
) -> dict[str, ModelValue]:
    values: dict[str, ModelValue] = {}
    for name, value in entries:
        unit = elaborate_unit(value.unit, diagnostics)
        free = check_name_is_free(name, used, what.partition(" ")[2], diagnostics)
        low, high = (one.value for one in value.range)
        if low >= high:
            place = value.range[0].span.merge(value.range[1].span)
            diagnostics.error("AE208", "a range is two numbers, the lower one first", place)
        elif unit is not None and unit.offset:
            headline = f"a model has no values in {unit.text}, as its numbers are only scaled"
            shown = value.unit.span if value.unit else None
            diagnostics.error("AE204", headline, shown, help=("write `unit: K`",))
        elif unit is not None and free:
            used[name.value] = what
            shape = tuple(one.value for one in value.shape)
            ends = low * unit.factor, high * unit.factor
            values[name.value] = ModelValue(name.value, shape, unit, ends, name.span)
    return values


def _boxes(
    entries: MappingField[declared.ModelBox],
    values: Mapping[str, ModelValue],
    what: str,
    diagnostics: Diagnostics,
) -> dict[str, ExactBox]:
    boxes: dict[str, ExactBox] = {}
    for name, box in entries:
        value = resolve_name(name, values, what, diagnostics)
        if value is None:
            continue
        lower = _ends(box.lower, value, value.range[0], name.span, diagnostics)
        upper = _ends(box.upper, value, value.range[1], name.span, diagnostics)
        if lower is None or upper is None:
            continue
        if any(low > high for low, high in zip(lower, upper, strict=True)):
            diagnostics.error("AE208", f"the box of `{name.value}` is empty", box.span)
            continue
        boxes[name.value] = tuple(zip(lower, upper, strict=True))
    return boxes


def _ends(
    numbers: tuple[NumberField, ...] | None,
    value: ModelValue,
    end: Fraction,
    place: SourceSpan,
    diagnostics: Diagnostics,
) -> tuple[Fraction, ...] | None:
    """Return one end of a box for each component, SI; `end` where none is written."""
    if numbers is None:
        return (end,) * value.size
    if len(numbers) not in (1, value.size):
        diagnostics.error(
            "AE112",
            f"{len(numbers)} numbers for the {value.size} components of `{value.name}`",
            place,
            help=("write one number for all of them, or one for each",),
        )
        return None
    ends = tuple(one.value * value.unit.factor for one in numbers) * (value.size if len(numbers) == 1 else 1)
    low, high = value.range
    for number, written in zip(ends, numbers * (value.size if len(numbers) == 1 else 1), strict=True):
        if not low <= number <= high:
            bounds = " to ".join(format_quantity(one, value.unit) for one in value.range)
            headline = f"`{written.value}` is outside the range of `{value.name}`, {bounds}"
            diagnostics.error("AE111", headline, written.span)
            return None
    return ends
