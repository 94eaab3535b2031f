"""Differences between two versions of a file as declared: every field whose text has another meaning.

It knows no field by name, so a field that is added to a schema is compared, too.  Lists whose entries have an
`id` are compared by it, and other lists entry by entry.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, is_dataclass
from itertools import zip_longest
from typing import Any, Final

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import MappingField

_PLACES: Final = ("span", "key_span")
"""Fields of declared things that are places in the file."""

Path = tuple[str, ...]
"""Names of fields, keys and entries from the top of a file to a part of it."""


@dataclass(frozen=True)
class DeclaredDifference:
    """One part of a file that differs.

    Attributes:
        path: names from the top of the file to it.
        pattern: the same, with `*` for keys and entries that the user names.
        old: the part before; None if it is new.
        new: the part now; None if it was removed.
        old_place: place to show of the old version; None if there is none.
        new_place: place to show of the new version; None if there is none.
    """

    path: Path
    pattern: Path
    old: Any
    new: Any
    old_place: SourceSpan | None
    new_place: SourceSpan | None

    @property
    def is_of_presence(self) -> bool:
        """True if the part is in one version alone."""
        return self.old is None or self.new is None


@dataclass(frozen=True)
class _Pair:
    """The two versions of one part, with the places of their names."""

    path: Path
    pattern: Path
    old: Any
    new: Any
    old_key: SourceSpan | None = None
    new_key: SourceSpan | None = None

    def below(self, name: str, old: Any, new: Any) -> _Pair:
        """Return the part in a field."""
        return _Pair((*self.path, name), (*self.pattern, name), old, new)

    def entry(self, name: str, old: Any, new: Any) -> _Pair:
        """Return the part under a key or in a list."""
        return _Pair((*self.path, name), (*self.pattern, "*"), old, new)

    def difference(self) -> DeclaredDifference:
        """Return the difference of the whole part."""
        return DeclaredDifference(
            self.path,
            self.pattern,
            self.old,
            self.new,
            self.old_key or span_of(self.old),
            self.new_key or span_of(self.new),
        )


def declared_differences(old: Any, new: Any) -> Iterator[DeclaredDifference]:
    """Compare two declared things of one schema.

    Args:
        old: the version before.
        new: the version now.

    Yields:
        Each part that differs, as deep in the file as possible.
    """
    yield from _differences(_Pair((), (), old, new))


def span_of(part: Any) -> SourceSpan | None:
    """Return the place of a part of a file.

    Args:
        part: a field, a declared thing, or a list of them.

    Returns:
        Its place; None if it is absent.
    """
    if isinstance(part, tuple):
        spans = [one for one in map(span_of, part) if one is not None]
        return SourceSpan(spans[0].source, spans[0].start, spans[-1].end) if spans else None
    return getattr(part, "span", None)


def _differences(pair: _Pair) -> Iterator[DeclaredDifference]:
    old, new = pair.old, pair.new
    if old is None and new is None:
        return
    if old is None or new is None or type(old) is not type(new):
        yield pair.difference()
    elif isinstance(old, MappingField):
        keys = [{name.value: (name.span, value) for name, value in side} for side in (old, new)]
        for name in dict.fromkeys([*keys[0], *keys[1]]):
            (old_key, one), (new_key, other) = (side.get(name, (None, None)) for side in keys)
            inner = pair.entry(name, one, other)
            yield from _differences(_Pair(inner.path, inner.pattern, inner.old, inner.new, old_key, new_key))
    elif isinstance(old, tuple):
        yield from _list_differences(pair)
    elif _is_plain(old):
        if old.value != new.value:
            yield pair.difference()
    elif is_dataclass(old):
        for field in fields(old):
            if field.name not in _PLACES:
                name = field.name.removesuffix("_")
                yield from _differences(pair.below(name, getattr(old, field.name), getattr(new, field.name)))
    elif old != new:
        yield pair.difference()


def _list_differences(pair: _Pair) -> Iterator[DeclaredDifference]:
    """Compare two lists: by the ids of their entries, as a whole if they hold plain values, or in order."""
    if all(hasattr(one, "id") and one.id is not None for one in (*pair.old, *pair.new)):
        old, new = ({one.id.value: one for one in side} for side in (pair.old, pair.new))
        if [name for name in old if name in new] != [name for name in new if name in old]:
            yield pair.difference()
        for name in dict.fromkeys([*old, *new]):
            yield from _differences(pair.entry(name, old.get(name), new.get(name)))
    elif all(_is_plain(one) for one in (*pair.old, *pair.new)):
        if _values(pair.old) != _values(pair.new):
            yield pair.difference()
    else:
        for number, (one, other) in enumerate(zip_longest(pair.old, pair.new), 1):
            yield from _differences(pair.entry(str(number), one, other))


def _is_plain(part: Any) -> bool:
    """Return True for a value, and for a list of values."""
    return all(map(_is_plain, part)) if isinstance(part, tuple) else hasattr(part, "node")


def _values(parts: Iterable[Any]) -> list[Any]:
    return [_values(one) if isinstance(one, tuple) else one.value for one in parts]
