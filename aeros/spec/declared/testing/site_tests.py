"""Schema of a file of site tests, unresolved: expected decisions on requests, expected verdicts on modules.

Values are still text; `aeros.cli.author.site_tests.read` gives them meaning under a site.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from aeros.spec.declared.field_types import ByVariable, Identifier, Named
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import (
    ChoiceField,
    ExpressionField,
    IntegerField,
    LengthBounds,
    MappingField,
    Pattern,
    TextField,
    ValueBounds,
)

Value = ExpressionField | tuple[ExpressionField, ...]
"""Constant of a variable's type; a list for a position and for one number or truth value of each member."""

SkillName = Annotated[TextField, Pattern("dotted")]
Counts = Annotated[MappingField[Annotated[IntegerField, ValueBounds(0, 1_000_000)]], Pattern("slug")]


@dataclass(frozen=True)
class SiteTest:
    """One expectation: of the decision on a request, or of the verdict on a module.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    expect: ChoiceField[Literal["ALLOW", "ATTENUATE", "DENY", "proved", "rejected", "undecided"]] = field(
        metadata={"doc": "the decision on a request, or the verdict on a module, as in `expect: DENY`"}
    )
    description: TextField | None = field(default=None, metadata={"doc": "the reason for the test"})
    skill: SkillName | None = field(
        default=None, metadata={"doc": "the skill that asks, as in `skill: make_dumplings.wrap`"}
    )
    action: Identifier | None = field(
        default=None, metadata={"doc": "the site's name of the requested action, as in `action: grip`"}
    )
    parameters: Named[Value] = field(
        default=MappingField(), metadata={"doc": "parameters of the action, by name"}
    )
    inputs: Named[Value] = field(
        default=MappingField(), metadata={"doc": "inputs that the skill runs with, by name"}
    )
    state: ByVariable[Value] = field(
        default=MappingField(),
        metadata={"doc": "measured values, in addition to those of the file, and in their place"},
    )
    unmeasured: tuple[Annotated[TextField, Pattern("dotted")], ...] = field(
        default=(), metadata={"doc": "state variables of the file without a value in this test"}
    )
    ages: ByVariable[TextField] = field(
        default=MappingField(),
        metadata={"doc": "ages of measured values, by name; 0 s for the others"},
    )
    usage: Counts = field(
        default=MappingField(),
        metadata={"doc": "actions that each quota has counted so far; 0 for the others"},
    )
    by: tuple[TextField, ...] = field(
        default=(),
        metadata={"doc": "rules or codes that the reasons have to name, as in `by: [separation]`"},
    )
    becomes: Named[Value] = field(
        default=MappingField(),
        metadata={"doc": "parameters of the action that an `ATTENUATE` allows, by name"},
    )
    verify: TextField | None = field(
        default=None, metadata={"doc": "path of the module whose verdict is expected, relative to this file"}
    )
    codes: tuple[TextField, ...] | None = field(
        default=None,
        metadata={"doc": "codes of all errors of that module, as in `codes: [AE501]`; unchecked if absent"},
    )


@dataclass(frozen=True)
class SiteTests:
    """A whole file of site tests.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    schema: Literal["aeros/tests/1"] = field(metadata={"doc": "`schema: aeros/tests/1`"})
    description: TextField = field(metadata={"doc": "the subject of the tests, for readers of the file"})
    tests: Annotated[Named[SiteTest], LengthBounds(1, 10_000)] = field(metadata={"doc": "the tests, by name"})
    site: TextField | None = field(
        default=None,
        metadata={"doc": "path of the site file, relative to this file; the reference site if absent"},
    )
    modules: tuple[TextField, ...] = field(
        default=(), metadata={"doc": "paths of the modules whose skills ask, relative to this file"}
    )
    state: ByVariable[Value] = field(
        default=MappingField(), metadata={"doc": "measured values of every test"}
    )
