"""Schema of an overlay: what an operator adds to a site file without a copy of it, unresolved and closed.

An overlay can grant access, block actions and set modules. It has no invariants, vocabulary or limits, so it
cannot weaken Φ.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal, TypeVar

from aeros.spec.declared.configuration import ModuleSettings
from aeros.spec.declared.field_types import Identifier, Named
from aeros.spec.declared.policy import Access, OperatorOverride
from aeros.spec.declared.site import Site
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.fields import MappingField, TextField

_T = TypeVar("_T")


@dataclass(frozen=True)
class Overlay:
    """An operator's additions to a site.

    Attributes:
        span: its place in the file.
    """

    span: SourceSpan
    schema: Literal["aeros/overlay/1"] = field(metadata={"doc": "`schema: aeros/overlay/1`"})
    base: TextField | None = field(
        default=None,
        metadata={
            "doc": "the site file or overlay that it adds to, relative to this file, as in "
            "`base: cell.yaml`; the reference site if absent"
        },
    )
    description: TextField | None = field(default=None, metadata={"doc": "its purpose, for people"})
    grants: Named[Access] = field(
        default=MappingField(),
        metadata={
            "doc": "further access, by module, in addition to that of the site, as in "
            "`grants: {sort_bolts: {actuators: [base]}}`"
        },
    )
    blocks: tuple[OperatorOverride, ...] = field(default=(), metadata={"doc": "further operator overrides"})
    modules: Named[ModuleSettings] = field(
        default=MappingField(),
        metadata={
            "doc": "bindings and parameters of modules, which come before those of the site, as in "
            "`modules: {clean_pot: {set: {force: 6 N}}}`"
        },
    )


def with_overlay(site: Site, overlay: Overlay) -> Site:
    """Add an overlay to a site.

    Args:
        site: the site as declared.
        overlay: the overlay.

    Returns:
        The site with the access, blocks and settings of both. A setting of the overlay replaces one of the
        same name. All else of the site is as it was.
    """
    policy = replace(
        site.policy,
        grants=_merged(site.policy.grants, overlay.grants, _joined_access),
        blocks=(*site.policy.blocks, *overlay.blocks),
    )
    return replace(site, policy=policy, modules=_merged(site.modules, overlay.modules, _joined_settings))


def _merged(
    below: MappingField[_T], above: MappingField[_T], join: Callable[[_T, _T], _T]
) -> MappingField[_T]:
    """Merge two mappings; a name that both have is placed where the upper one has it."""
    old = {key.value: value for key, value in below}
    new = {
        key.value: (key, join(old[key.value], value) if key.value in old else value) for key, value in above
    }
    kept = (new.pop(key.value, (key, value)) for key, value in below)
    return MappingField((*kept, *new.values()), below.span or above.span)


def _joined_access(below: Access, above: Access) -> Access:
    return replace(
        above,
        actuators=_joined_names(below.actuators, above.actuators),
        sensors=_joined_names(below.sensors, above.sensors),
        channels=_joined_names(below.channels, above.channels),
        compute=_joined_names(below.compute, above.compute),
    )


def _joined_names(below: tuple[Identifier, ...], above: tuple[Identifier, ...]) -> tuple[Identifier, ...]:
    known = {one.value for one in above}
    return (*above, *(one for one in below if one.value not in known))


def _joined_settings(below: ModuleSettings, above: ModuleSettings) -> ModuleSettings:
    return replace(
        above,
        bind=_merged(below.bind, above.bind, lambda _, upper: upper),
        set=_merged(below.set, above.set, lambda _, upper: upper),
    )
