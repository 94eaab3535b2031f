"""Elaboration of a site's obstacles, and of the space that a measured object takes up."""

from __future__ import annotations

from fractions import Fraction

from aeros.spec.declared import motion as declared
from aeros.spec.declared.perception import OccupiedSpace
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.elaborate.expressions import elaborate_quantity
from aeros.spec.elaborate.names import resolve_name
from aeros.spec.elaborate.vocabulary import SiteVocabulary
from aeros.spec.expr.scope import AxisAlignedBox
from aeros.spec.expr.units import LENGTH
from aeros.spec.model.motion import ObstaclePolicy, WatchedVolume
from aeros.spec.text.fields import TextField

Corner = tuple[Fraction, Fraction, Fraction]


def elaborate_obstacles(
    declaration: declared.Obstacles | None, vocabulary: SiteVocabulary, diagnostics: Diagnostics
) -> ObstaclePolicy | None:
    """Elaborate the obstacles that a site looks for in pictures.

    Args:
        declaration: the declared section, if there is one.
        vocabulary: vocabulary of the site.
        diagnostics: receives the faults.

    Returns:
        The policy in SI units; None if there is none, or after reporting every fault.
    """
    if declaration is None:
        return None
    volumes = []
    for name, watched in declaration.within:
        box = resolve_name(name, vocabulary.volumes, "a volume", diagnostics)
        surface = elaborate_quantity(watched.surface, LENGTH, diagnostics)
        least = _positive(watched.least_height, "least_height", diagnostics)
        most = _greatest_height(watched.greatest_height, least, diagnostics)
        if box is not None and surface is not None and least is not None:
            near = watched.explained_within
            within = None if near is None else _positive(near, "explained_within", diagnostics)
            volumes.append(WatchedVolume(name.value, box, surface, least, most, within))
    margin = _positive(declaration.margin, "margin", diagnostics)
    explained = _positive(declaration.explained_within, "explained_within", diagnostics)
    largest = _corner(declaration.largest_explained, "largest_explained", declaration.span, diagnostics)
    base = None
    if declaration.base is not None:
        base = resolve_name(declaration.base, vocabulary.volumes, "a volume", diagnostics)
    if margin is None or explained is None or largest is None:
        return None
    return ObstaclePolicy(tuple(volumes), margin, explained, largest, base)


def elaborate_occupied_space(
    declaration: OccupiedSpace, largest: Corner | None, diagnostics: Diagnostics
) -> AxisAlignedBox | None:
    """Elaborate the space that a measured object takes up.

    Args:
        declaration: the declared corners.
        largest: greatest edges that the site allows, m; None if it looks for no obstacles.
        diagnostics: receives the faults.

    Returns:
        The space, relative to the measured position, m; None after reporting every fault.
    """
    lower = _corner(declaration.lower, "lower", declaration.span, diagnostics)
    upper = _corner(declaration.upper, "upper", declaration.span, diagnostics)
    if lower is None or upper is None:
        return None
    edges = [b - a for a, b in zip(lower, upper, strict=True)]
    if min(edges) <= 0:
        diagnostics.error("AE208", "`lower` is below `upper` along every axis", declaration.span)
        return None
    if largest is not None and any(edge > most for edge, most in zip(edges, largest, strict=True)):
        sizes, most = (" x ".join(f"{float(1000 * one):g}" for one in each) for each in (edges, largest))
        diagnostics.error(
            "AE208",
            f"`occupies` is {sizes} mm large; the site lets a module explain {most} mm",
            declaration.span,
            help=("declare the space of the object alone, or several variables with a space each",),
        )
        return None
    return AxisAlignedBox(lower, upper)


def _greatest_height(
    text: TextField | None, least: Fraction | None, diagnostics: Diagnostics
) -> Fraction | None:
    """Return the greatest height of an obstacle, m; None if there is no bound, or after reporting a fault."""
    found = None if text is None else elaborate_quantity(text, LENGTH, diagnostics)
    if text is not None and found is not None and least is not None and found <= least:
        diagnostics.error("AE208", "`greatest_height` is above `least_height`", text.span)
        return None
    return found


def _positive(text: TextField, name: str, diagnostics: Diagnostics) -> Fraction | None:
    found = elaborate_quantity(text, LENGTH, diagnostics)
    if found is not None and found <= 0:
        diagnostics.error("AE208", f"`{name}` is above 0", text.span)
        return None
    return found


def _corner(
    texts: tuple[TextField, ...], name: str, span: SourceSpan, diagnostics: Diagnostics
) -> Corner | None:
    if len(texts) != 3:
        diagnostics.error("AE112", f"`{name}` has three lengths, along x, y and z", span)
        return None
    x, y, z = (elaborate_quantity(text, LENGTH, diagnostics) for text in texts)
    return None if x is None or y is None or z is None else (x, y, z)
