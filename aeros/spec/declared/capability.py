"""Schema of the `capabilities:` of a module, and of those that it requires of others."""

from __future__ import annotations

from dataclasses import dataclass, field

from aeros.spec.declared.field_types import Identifier, Named
from aeros.spec.declared.quantity import Quantity
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import ExpressionField, MappingField, TextField


@dataclass(frozen=True)
class Interface:
    """The promise of every alternative that provides a capability.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    inputs: Named[Quantity] = field(
        default=MappingField(),
        metadata={"doc": "inputs that each alternative has, with at least this range"},
    )
    outputs: Named[Quantity] = field(
        default=MappingField(),
        metadata={"doc": "outputs that each alternative has, with at most this range"},
    )
    precondition: ExpressionField | None = field(
        default=None,
        metadata={
            "doc": "each alternative can start wherever this holds, as in `precondition: gripper_empty`; "
            "in every state if absent"
        },
    )
    achieves: ExpressionField | None = field(
        default=None,
        metadata={
            "doc": "a condition that holds whenever an alternative has succeeded, as in `achieves: holding`"
        },
    )


@dataclass(frozen=True)
class Capability:
    """An ability. A step that names it runs one of the alternatives that provide it, so each must suffice.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    description: TextField = field(metadata={"doc": "the ability that it gives the robot, for people"})
    provided_by: tuple[Identifier | tuple[Identifier, ...], ...] = field(
        metadata={
            "doc": "alternatives: each a skill, a composition, or skills that run one after the other, as in "
            "`provided_by: [wipe, [fetch, tidy]]`"
        }
    )
    version: TextField | None = field(
        default=None,
        metadata={"doc": "its semantic version, which dependencies refer to; the module's if absent"},
    )
    interface: Interface | None = field(
        default=None, metadata={"doc": "a promise that is proved of each alternative"}
    )


@dataclass(frozen=True)
class RequiredCapability:
    """Capability that some other module must provide.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    version: TextField = field(metadata={"doc": 'the versions that suit, as in `version: ">=1.2"`'})
    interface: Interface | None = field(
        default=None, metadata={"doc": "a promise that is proved of each alternative of each provider"}
    )
