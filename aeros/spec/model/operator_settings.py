"""Settings that an operator adds to a site at run time: blocks, and the configuration of modules."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from aeros.spec.model.configured import ModuleConfiguration
from aeros.spec.model.policy import OperatorOverride

if TYPE_CHECKING:
    from aeros.spec.model.site import Site


@dataclass(frozen=True)
class OperatorSettings:
    """Settings in addition to those of a site file.

    Attributes:
        blocks: operator overrides.
        configurations: settings of modules, by module; they come before those of the site file.
    """

    blocks: tuple[OperatorOverride, ...] = ()
    configurations: Mapping[str, ModuleConfiguration] = field(default_factory=dict)

    def applied_to(self, site: Site) -> Site:
        """Add the settings to a site.

        Args:
            site: the site of a file.

        Returns:
            The site with them; the same site if there are none.
        """
        return site.with_overrides(self.blocks).with_configurations(self.configurations)

    def __hash__(self) -> int:
        return hash(self.blocks)

    @property
    def identity(self) -> list[Any]:
        """Plain data that is equal for settings that say the same."""
        configured = {name: one.to_json() for name, one in sorted(self.configurations.items()) if one}
        return [[one.identity for one in self.blocks], configured]


NO_SETTINGS: Final = OperatorSettings()
"""No setting beyond those of the site file."""
