"""Types of fields that several schemas share: names, slugs, mappings by name, and words for risk."""

from __future__ import annotations

from typing import Annotated, Literal, TypeVar

from aeros.spec.text.fields import ChoiceField, MappingField, Pattern, TextField

Identifier = Annotated[TextField, Pattern("identifier")]
Reference = Annotated[TextField, Pattern("reference")]
"""Name of a skill or capability of this module, or `MODULE.NAME` for one of a required module."""
Slug = Annotated[TextField, Pattern("slug")]
_T = TypeVar("_T")
Named = Annotated[MappingField[_T], Pattern("identifier")]
"""A mapping whose keys are identifiers."""
ByVariable = Annotated[MappingField[_T], Pattern("dotted")]
"""A mapping whose keys are state variables, perhaps of another module."""
RiskWord = ChoiceField[Literal["low", "medium", "high"]]
