"""Elaboration of the objects of a site: their words, shapes and colours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

from aeros.spec.declared import objects as declared
from aeros.spec.declared import site as declared_site
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.words import normalized_words
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.expr.units import LENGTH
from aeros.spec.model.objects import ObjectKind
from aeros.spec.text.fields import TextField


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
    """Elaborate phrases; each must have a letter or digit, or nobody could say it.

    Args:
        words: the declared phrases.
        diagnostics: receives the faults.

    Returns:
        The phrases in lower case.
    """
    for phrase in words:
        if not normalized_words(phrase.value):
            diagnostics.error("AE112", f"`{phrase.value}` has no word", phrase.span)
    return tuple(phrase.value.casefold() for phrase in words)


def _object_kind(name: TextField, kind: declared.ObjectKind, diagnostics: Diagnostics) -> ObjectKind:
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


def _colour(kind: declared.ObjectKind, diagnostics: Diagnostics) -> tuple[float, float, float] | None:
    if kind.colour is None:
        return None
    parts = [float(one.value) for one in kind.colour]
    if len(parts) != 3 or not all(0 <= one <= 1 for one in parts):
        span = kind.colour[0].span if kind.colour else kind.span
        diagnostics.error("AE111", "a colour is red, green and blue, each from 0 to 1", span)
        return None
    return (parts[0], parts[1], parts[2])
