"""Schema of `compositions` in an `ecm.yaml`, unresolved: graphs over the module's skills."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from aeros.spec.declared.field_types import Identifier, Named, Reference
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import (
    ChoiceField,
    ExpressionField,
    IntegerField,
    MappingField,
    Pattern,
    TextField,
    ValueBounds,
)

Retry = Annotated[IntegerField, ValueBounds(0, 100)]


@dataclass(frozen=True)
class OutputReference:
    """Source of an input: the output of a step that has succeeded.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    from_: Annotated[TextField, Pattern("dotted")] = field(
        metadata={"doc": "a step and its output", "example": "measure.width"}
    )


@dataclass(frozen=True)
class Handler:
    """A skill that runs after a failure: between two tries of a step, or after the last one.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    skill: Reference = field(metadata={"doc": "the skill or capability that runs, as in `skill: recover`"})
    inputs: Named[ExpressionField] = field(
        default=MappingField(), metadata={"doc": "its inputs, as in `inputs: {force: 8 N}`"}
    )
    retry: Retry | None = field(default=None, metadata={"doc": "how many times it is retried itself"})
    between_tries: Reference | None = field(
        default=None,
        metadata={"doc": "the handler between two of its own tries; it must not lead back to this one"},
    )
    on_failure: Reference | None = field(
        default=None,
        metadata={"doc": "the handler after its own last try; it must not lead back to this one"},
    )


@dataclass(frozen=True)
class Part:
    """One node of a composition graph, of exactly one form.

    The forms are `seq`, `par`, `any`, `tolerate`, `if`, `check`, `hold`, `timeout`, and a step's `skill`.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    seq: tuple[Part, ...] | None = field(
        default=None,
        metadata={"doc": "parts that run in sequence, each after the previous one has succeeded"},
    )
    par: tuple[Part, ...] | None = field(
        default=None, metadata={"doc": "parts that run in parallel; this part succeeds when all of them have"}
    )
    any: tuple[Part, ...] | None = field(
        default=None,
        metadata={
            "doc": "alternatives: each runs only after the previous one has failed; this part succeeds with "
            "the first that does"
        },
    )
    tolerate: Part | None = field(
        default=None,
        metadata={"doc": "a part that may fail: then this part has succeeded nevertheless"},
    )
    check: ExpressionField | None = field(
        default=None,
        metadata={"doc": "a condition on the state; this part fails if it does not hold"},
    )
    hold: ExpressionField | None = field(
        default=None,
        metadata={
            "doc": "a condition on the state that is held while `part` runs: once it is not measured as "
            "true, the running steps are stopped and this part fails",
            "example": "{hold: robot_at_table, part: {skill: wipe}, on_failure: stop}",
        },
    )
    timeout: TextField | None = field(
        default=None,
        metadata={
            "doc": "the time that `part` has, as in `timeout: 20 s`; once it has passed, the running steps "
            "are stopped and this part fails"
        },
    )
    part: Part | None = field(
        default=None, metadata={"doc": "the part that runs under `hold` or within `timeout`"}
    )
    if_: ExpressionField | None = field(
        default=None, metadata={"doc": "a condition on the state, as in `if: object_detected`"}
    )
    then: Part | None = field(default=None, metadata={"doc": "the part that runs if the condition holds"})
    else_: Part | ChoiceField[Literal["nothing"]] | None = field(
        default=None,
        metadata={
            "doc": "the part that runs otherwise, or `nothing`; optional only if the condition always holds"
        },
    )
    skill: Reference | None = field(
        default=None,
        metadata={
            "doc": "the skill that this step runs, or a capability: one of its skills; `MODULE.NAME` if it "
            "is of a required module"
        },
    )
    id: Identifier | None = field(
        default=None, metadata={"doc": "the step's name; the skill's name if absent"}
    )
    inputs: Named[ExpressionField | OutputReference] = field(
        default=MappingField(),
        metadata={"doc": "its inputs, as in `inputs: {force: 8 N, width: {from: measure.width}}`"},
    )
    retry: Retry | None = field(
        default=None, metadata={"doc": "how many times this part is retried after it has failed"}
    )
    between_tries: Reference | None = field(
        default=None, metadata={"doc": "the handler or skill that runs between two tries of a step"}
    )
    on_failure: Reference | None = field(
        default=None,
        metadata={
            "doc": "the handler or skill that runs after the last try; then, or with `stop` at once, the "
            "composition fails. `hold` and `timeout` take `stop` alone"
        },
    )


@dataclass(frozen=True)
class Composition:
    """A graph of skills that is proved as a whole.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    description: TextField = field(metadata={"doc": "the composition's purpose, for people"})
    do: Part = field(metadata={"doc": "the graph, as in `do: {seq: [{skill: fetch}, {skill: tidy}]}`"})
    precondition: ExpressionField | None = field(
        default=None, metadata={"doc": "the condition that must hold before it starts"}
    )
    handlers: Named[Handler] = field(
        default=MappingField(), metadata={"doc": "named handlers that `on_failure` refers to"}
    )
