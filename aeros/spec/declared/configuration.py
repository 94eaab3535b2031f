"""Schema of configuration: needs and parameters that modules declare, and settings of a site for modules."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from aeros.spec.declared.field_types import Identifier, Named
from aeros.spec.declared.quantity import Quantity
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import ChoiceField, ExpressionField, MappingField, TextField

NeedWord = ChoiceField[
    Literal["volume", "variable", "constant", "camera", "action", "tool", "actuator", "sensor", "resource"]
]
"""Sort of thing that a module may need of a site."""


@dataclass(frozen=True)
class Need:
    """A thing of the site that the module calls by a name of its own; `aeros configure` binds it.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    is_: NeedWord = field(
        metadata={
            "doc": "`volume`, `variable`, `constant`, `camera`, `action`, `tool`, `actuator`, `sensor` "
            "or `resource`"
        }
    )
    type: TextField | None = field(
        default=None, metadata={"doc": "the type of a variable, as in `type: vec3`; `real` if it has a unit"}
    )
    unit: TextField | None = field(
        default=None, metadata={"doc": "a unit in which a variable or constant can be written"}
    )
    offers: Identifier | None = field(
        default=None,
        metadata={"doc": "a word that the site lists under its `offers`, as in `offers: surface`"},
    )
    sees: Identifier | None = field(
        default=None, metadata={"doc": "the volume that a camera must see, by the module's name for it"}
    )
    parameters: tuple[Identifier, ...] = field(
        default=(), metadata={"doc": "the parameters that an action or tool must have"}
    )
    description: TextField | None = field(default=None, metadata={"doc": "its meaning, for people"})


@dataclass(frozen=True)
class Parameter(Quantity):
    """A constant of the module that `aeros configure` sets, for every run until the next."""

    default: ExpressionField | None = field(
        default=None, metadata={"doc": "its value until it is set, as in `default: 6 s`"}
    )


@dataclass(frozen=True)
class ModuleSettings:
    """Settings of a site for a module; those that an operator gives to `aeros configure` come first.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    bind: Named[Identifier] = field(
        default=MappingField(),
        metadata={"doc": "the site's name for what the module needs, as in `bind: {surface: bench}`"},
    )
    set: Named[ExpressionField] = field(
        default=MappingField(), metadata={"doc": "values of parameters, as in `set: {cooking_time: 6 s}`"}
    )
