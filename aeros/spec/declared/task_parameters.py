"""Schema of the parameters of tasks, which instructions set."""

from __future__ import annotations

from dataclasses import dataclass, field

from aeros.spec.declared.field_types import Named
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import ExpressionField, MappingField, NumberField, TextField


@dataclass(frozen=True)
class ParameterValue:
    """One value that a parameter of a task may have.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    words: tuple[TextField, ...] = field(
        default=(),
        metadata={"doc": "the phrases for it, in the singular, as in `words: [left half, left side]`"},
    )


@dataclass(frozen=True)
class TaskParameter:
    """Part of a task that an instruction says, such as the object to fetch; no skill changes it.

    It is a state variable of the module: conditions, skills and perceivers read it by its name.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    type: TextField | None = field(
        default=None,
        metadata={
            "doc": "`objects` for one of the site's objects, another enum of the site, `bool`, `int` or "
            "`real`, as in `type: objects`; absent if `values` are given"
        },
    )
    values: Named[ParameterValue] = field(
        default=MappingField(),
        metadata={"doc": "its values, in place of a type, as in `values: {left: {words: [left half]}}`"},
    )
    unit: TextField | None = field(default=None, metadata={"doc": "the unit of `range`, as in `unit: cm`"})
    range: tuple[NumberField, ...] | None = field(
        default=None, metadata={"doc": "lowest and highest value, as in `range: [1, 2]`"}
    )
    default: ExpressionField | None = field(
        default=None,
        metadata={
            "doc": "its value if an instruction does not say it, as in `default: left`; without a default, "
            "the instruction must"
        },
    )
    description: TextField | None = field(default=None, metadata={"doc": "its meaning, for people"})
