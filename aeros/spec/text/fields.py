"""Field types of a schema: values with the place they were written at, and the forms of names."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Final, Generic, TypeVar

from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.nodes import ScalarNode

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class TextField:
    """Text as written, never interpreted.

    Attributes:
        value: the text.
        span: its place in the file.
        node: the YAML scalar it was read from.
    """

    value: str
    span: SourceSpan
    node: ScalarNode

    def __str__(self) -> str:
        return self.value


@dataclass(frozen=True, slots=True)
class ExpressionField:
    """Text of an expression, not parsed yet.

    Attributes:
        value: the text of the expression.
        span: its place in the file.
        node: the YAML scalar it was read from.
    """

    value: str
    span: SourceSpan
    node: ScalarNode

    def __str__(self) -> str:
        return self.value


@dataclass(frozen=True, slots=True)
class BooleanField:
    """`true` or `false`. Read `value`: the field itself has no truth value.

    Attributes:
        value: the truth value.
        span: its place in the file.
        node: the YAML scalar it was read from.
    """

    value: bool
    span: SourceSpan
    node: ScalarNode

    def __bool__(self) -> bool:
        raise MisuseError("a Boolean is a place in a file: use its value")


@dataclass(frozen=True, slots=True)
class IntegerField:
    """A whole number in decimal digits.

    Attributes:
        value: the number.
        span: its place in the file.
        node: the YAML scalar it was read from.
    """

    value: int
    span: SourceSpan
    node: ScalarNode


@dataclass(frozen=True, slots=True)
class NumberField:
    """A decimal literal.

    Attributes:
        value: the rational that it denotes, exactly: `1.10` is 11/10.
        span: its place in the file.
        node: the YAML scalar it was read from.
    """

    value: Fraction
    span: SourceSpan
    node: ScalarNode


@dataclass(frozen=True, slots=True)
class ChoiceField(Generic[T]):
    """One of the words of `T`, a `Literal`.

    Attributes:
        value: the word.
        span: its place in the file.
        node: the YAML scalar it was read from.
    """

    value: T
    span: SourceSpan
    node: ScalarNode


@dataclass(frozen=True, slots=True)
class MappingField(Generic[T]):
    """Mapping whose keys the user names.

    Attributes:
        items: pairs of key and value, in the order written.
        span: its place in the file; None if the file lacks it.
    """

    items: tuple[tuple[TextField, T], ...] = ()
    span: SourceSpan | None = None

    def __iter__(self) -> Iterator[tuple[TextField, T]]:
        return iter(self.items)

    def __len__(self) -> int:
        return len(self.items)


@dataclass(frozen=True, slots=True)
class Pattern:
    """Form of a `TextField`, or of the keys of a `MappingField`.

    Attributes:
        name: name of the form in `PATTERNS`.
    """

    name: str

    def __post_init__(self) -> None:
        if self.name not in PATTERNS:
            raise MisuseError(f"there is no pattern {self.name!r}")


@dataclass(frozen=True, slots=True)
class ValueBounds:
    """Bounds of an `IntegerField` or `NumberField`.

    Attributes:
        lo: least value; None for no bound.
        hi: greatest value; None for no bound.
    """

    lo: int | Fraction | None = None
    hi: int | Fraction | None = None


@dataclass(frozen=True, slots=True)
class LengthBounds:
    """Bounds of the number of entries of a list or `MappingField`.

    Attributes:
        lo: least number.
        hi: greatest number; None for no bound.
    """

    lo: int = 0
    hi: int | None = None


@dataclass(frozen=True, slots=True)
class _Form:
    regex: re.Pattern[str]
    words: str
    example: str


MAX_NAME: Final = 128
"""Limit on the characters of a name."""

PATTERNS: Final = {
    "identifier": _Form(
        re.compile(r"[a-z][a-z0-9_]*"), "a lower-case letter, then letters, digits and `_`", "move_tool"
    ),
    "slug": _Form(
        re.compile(r"[a-z][a-z0-9-]*"), "a lower-case letter, then letters, digits and `-`", "move-tool"
    ),
    "dotted": _Form(
        re.compile(r"[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)*"), "identifiers joined by `.`", "pick.move_tool"
    ),
    "full name": _Form(
        re.compile(r"[a-z][a-z0-9_]*\.[a-z][a-z0-9_]*"), "a module, `.`, a name in it", "kettle.water_hot"
    ),
    "reference": _Form(
        re.compile(r"[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)?"),
        "a name, or the name of a required module, `.` and a name",
        "gripping.grasp",
    ),
    "entry": _Form(
        re.compile(r"[a-z][a-z0-9_]*:[a-z][a-z0-9_]*"), "a file without `.py`, `:`, a function", "skills:wrap"
    ),
}
"""The forms a name can have."""

_STANDS_ALONE: Final = re.compile(r"(?<![\w.])[A-Za-z_]\w*(?![\w.])")


def undotted_names(text: str) -> set[str]:
    """List the names in an expression that are no part of a longer one, as `hot` is in `kettle.hot`.

    Args:
        text: text of the expression.

    Returns:
        The names.
    """
    return set(_STANDS_ALONE.findall(text))
