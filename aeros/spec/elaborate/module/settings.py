"""Settings of a module at a site: each need and parameter, with its value and the choices for it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Setting:
    """One need or parameter of a module, with what it is bound or set to.

    Attributes:
        name: the module's name for it.
        value: name of a thing of the site, or value of a parameter; empty if there is none.
        choices: names of the things of the site that suit; empty for a parameter.
        is_parameter: True for a parameter.
        source: the reason for the value: `set` by the operator, `site file`, `same name`, `only choice` or
            `default`.
        description: its meaning, in the words of the manifest; empty if a parameter has none.
        allowed: the values that a parameter may have; empty for a need.
    """

    name: str
    value: str
    choices: tuple[str, ...]
    is_parameter: bool
    source: str
    description: str
    allowed: str = ""

    @property
    def is_open(self) -> bool:
        """True if it has no value that suits, so that the module cannot be proved."""
        return not self.value if self.is_parameter else self.value not in self.choices


def configure_command(module: str, settings: Iterable[Setting]) -> str:
    """Write the command that sets what is open.

    Args:
        module: id of the module.
        settings: its settings.

    Returns:
        The command, with the first choice for each need; empty if no command would set anything.
    """
    options = [
        f"--set {one.name}=…" if one.is_parameter else f"--bind {one.name}={one.choices[0]}"
        for one in settings
        if one.is_open and (one.is_parameter or one.choices)
    ]
    return f"aeros configure {module} {' '.join(options)}" if options else ""
